"""The tree of a Slice file: what the parser builds, the checker completes and the writer reads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar

from ..graphs import reached
from .doc_comments import DocComment, parse_doc_comment
from .lexer import Token

Value = bool | int | float | str

BUILTIN_TYPES = ("bool", "byte", "short", "int", "long", "float", "double", "string")


@dataclass(slots=True, eq=False)
class BuiltinType:
    """A built-in type: `int`, `string`, ...; `Object` and `Value` mean any class.

    `LocalObject` means any local class or interface.
    """

    name: str
    token: Token


@dataclass(slots=True, eq=False)
class NamedType:
    """A type by its name as written (`Time`, `jderobot::Time`, `::jderobot::Time`).

    The name of an interface without a star means a servant that is passed by value, like a class.
    """

    name: str
    token: Token
    definition: Definition | None = None
    """The definition that the name refers to, set by the checker.

    It is a declaration if no included file has the definition; then only the name is known.
    """


@dataclass(slots=True, eq=False)
class ProxyType:
    """A reference to a remote object: `Camera*`, `Object*`; the target can also be a class."""

    target: BuiltinType | NamedType
    token: Token


Type = BuiltinType | NamedType | ProxyType


def is_local(kind: Type) -> bool:
    """Return whether values of a type are never sent: `LocalObject`, and types that are marked `local`."""
    match kind:
        case BuiltinType(name=name):
            return name == "LocalObject"
        case NamedType(definition=Definition(local=local)):
            return local
    return False


@dataclass(slots=True, eq=False)
class Metadata:
    """A directive in brackets: `["stream"]`."""

    text: str
    token: Token


@dataclass(slots=True, eq=False)
class Definition:
    """Base of everything that has a name."""

    name: str
    token: Token
    doc: str | None = None
    """The raw text of the doc comment."""
    metadata: list[Metadata] = field(default_factory=list)
    scoped: str = ""
    """The name from the root, `::jderobot::Time`; set by the checker."""
    local: bool = False
    """The mark `local`: it exists in one process only, and is never sent."""

    kind: ClassVar[str] = "definition"

    @property
    def documentation(self) -> DocComment:
        """The doc comment by its parts."""
        return parse_doc_comment(self.doc)

    def is_marked(self, text: str) -> bool:
        """Return whether it has some metadata."""
        return any(metadata.text == text for metadata in self.metadata)

    @property
    def module(self) -> str:
        """The scoped name of the module around it, without the leading colons: `jderobot`."""
        return self.scoped.rpartition("::")[0].removeprefix("::")


@dataclass(slots=True, eq=False)
class Literal:
    """A value as written: a literal, or the name of a constant or an enumerator.

    The checker sets the value and the target of a name.
    """

    token: Token
    value: Value | None = None
    name: str | None = None
    target: Constant | Enumerator | None = None


@dataclass(slots=True, eq=False)
class Member(Definition):
    """A member of a struct, a class or an exception; optional if it has a tag."""

    type: Type = field(kw_only=True)
    default: Literal | None = None
    tag: Literal | None = None
    """The number in `optional(n)`; the checker sets `tag.value`."""
    kind: ClassVar[str] = "member"


@dataclass(slots=True, eq=False)
class Parameter(Definition):
    """A parameter of an operation; optional if it has a tag."""

    type: Type = field(kw_only=True)
    out: bool = False
    tag: Literal | None = None
    kind: ClassVar[str] = "parameter"


@dataclass(slots=True, eq=False)
class Operation(Definition):
    """An operation of an interface or a class; `returns` is None for void."""

    returns: Type | None = None
    return_tag: Literal | None = None
    """The number in `optional(n)` before the return type."""
    parameters: list[Parameter] = field(default_factory=list)
    throws: list[NamedType] = field(default_factory=list)
    idempotent: bool = False
    kind: ClassVar[str] = "operation"

    @property
    def streamed(self) -> bool:
        """Whether its results are also published as a stream."""
        return self.is_marked("stream")

    @property
    def stop(self) -> bool:
        """Whether it stops what the interface commands."""
        return self.is_marked("stop")

    @property
    def inputs(self) -> list[Parameter]:
        """The parameters that a caller gives."""
        return [parameter for parameter in self.parameters if not parameter.out]

    @property
    def outputs(self) -> list[Parameter]:
        """The out parameters, which are returned in addition to the return value."""
        return [parameter for parameter in self.parameters if parameter.out]


@dataclass(slots=True, eq=False)
class Interface(Definition):
    """An interface; `bases` are the interfaces that it extends."""

    bases: list[NamedType] = field(default_factory=list)
    operations: list[Operation] = field(default_factory=list)
    kind: ClassVar[str] = "interface"

    @property
    def base_definitions(self) -> list[Interface]:
        """The interfaces that it extends directly."""
        return [base.definition for base in self.bases if isinstance(base.definition, Interface)]

    def ancestors(self) -> Iterator[Interface]:
        """Yield every interface that it extends, directly or not, once."""
        yield from reached(self.base_definitions, lambda each: each.base_definitions)


@dataclass(slots=True, eq=False)
class Struct(Definition):
    """A record that is passed by value."""

    members: list[Member] = field(default_factory=list)
    kind: ClassVar[str] = "struct"


@dataclass(slots=True, eq=False)
class Derivable(Definition):
    """A record that can extend another of its kind."""

    base: NamedType | None = None
    members: list[Member] = field(default_factory=list)

    @property
    def base_definition(self) -> Derivable | None:
        """The definition that it extends."""
        definition = self.base.definition if self.base else None
        return definition if isinstance(definition, Derivable) else None

    def ancestors(self) -> Iterator[Derivable]:
        """Yield the definitions that it extends, the nearest first."""
        base = self.base_definition
        while base is not None:
            yield base
            base = base.base_definition


@dataclass(slots=True, eq=False)
class Class(Derivable):
    """A record that can be null and extend another.

    Operations and implemented interfaces are deprecated in Slice; a proxy `Class*` could call them.
    """

    compact_id: Literal | None = None
    """The number in `class C(1)`; the checker sets `compact_id.value`."""
    implements: list[NamedType] = field(default_factory=list)
    operations: list[Operation] = field(default_factory=list)
    kind: ClassVar[str] = "class"


@dataclass(slots=True, eq=False)
class ExceptionType(Derivable):
    """An exception that an operation can throw."""

    kind: ClassVar[str] = "exception"


@dataclass(slots=True, eq=False)
class Enumerator(Definition):
    """A value of an enumeration; `literal` is as written, `value` its number."""

    literal: Literal | None = None
    value: int = 0
    enumeration: Enumeration | None = None
    kind: ClassVar[str] = "enumerator"


@dataclass(slots=True, eq=False)
class Enumeration(Definition):
    """A type with named values."""

    enumerators: list[Enumerator] = field(default_factory=list)
    kind: ClassVar[str] = "enumeration"


@dataclass(slots=True, eq=False)
class Sequence(Definition):
    """A name for a list of one type."""

    element: Type = field(kw_only=True)
    kind: ClassVar[str] = "sequence"


@dataclass(slots=True, eq=False)
class Dictionary(Definition):
    """A name for a map."""

    key: Type = field(kw_only=True)
    value: Type = field(kw_only=True)
    kind: ClassVar[str] = "dictionary"


@dataclass(slots=True, eq=False)
class Constant(Definition):
    """A named value."""

    type: Type = field(kw_only=True)
    literal: Literal = field(kw_only=True)
    kind: ClassVar[str] = "constant"


@dataclass(slots=True, eq=False)
class ForwardDeclaration(Definition):
    """`interface Camera;` or `class Node;`: the definition follows in this or another file."""

    of: type[Interface] | type[Class] = Interface
    definition: Definition | None = None
    kind: ClassVar[str] = "declaration"


@dataclass(slots=True, eq=False)
class Module(Definition):
    """A namespace; there is a node for each time that it is opened."""

    definitions: list[Definition] = field(default_factory=list)
    kind: ClassVar[str] = "module"

    def walk(self) -> Iterator[tuple[Module, Definition]]:
        """Yield every definition in it, at any depth, with the module around it."""
        for definition in self.definitions:
            yield self, definition
            if isinstance(definition, Module):
                yield from definition.walk()


def types_in(definition: Definition) -> list[Type]:
    """Return the types that a definition names: of its bases, members, operations, elements or value."""
    named: list[Type | None] = []
    match definition:
        case Interface():
            named += definition.bases
            for each in definition.operations:
                named += [each.returns, *(parameter.type for parameter in each.parameters), *each.throws]
        case Struct() | Derivable():
            named += [member.type for member in definition.members]
            named += [definition.base] if isinstance(definition, Derivable) else []
        case Sequence():
            named = [definition.element]
        case Dictionary():
            named = [definition.key, definition.value]
        case Constant():
            named = [definition.type]
    return [kind for kind in named if kind is not None]
