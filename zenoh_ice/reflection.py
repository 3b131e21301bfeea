"""Describe generated types and interfaces at run time: members, operations, docs and fingerprints.

    >>> from zenoh_ice.reflection import describe
    >>> from interfaces.nao import PoseHeadPrx
    >>> [operation.name for operation in describe(PoseHeadPrx).operations]
    ['setPose', 'setSpeed', 'stop', 'getPose', 'getLimits']

Names and types are those of Slice, from the root: `::nao::HeadPose`, `sequence` types by their name.

codegen writes the descriptions into the `schema.json` of each generated package; they are read when somebody
first asks. A servant sends those of its interface as the answer to `ice_describe`.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from importlib import resources
from typing import Annotated, Any, Final, Literal

import msgspec

from .exceptions import ConfigurationException, MarshalException, ZenohIceError
from .interface import OBJECT_TYPE_ID, Interface
from .text import cut, printable

__all__ = [
    "OBJECT_DEFINITION",
    "RETURN_VALUE",
    "Definition",
    "Enumerator",
    "Member",
    "OperationDescription",
    "Schema",
    "canonical_lines",
    "describe",
    "describe_difference",
    "describe_package",
    "first_difference",
    "parse_schema",
    "schema_of",
    "unscoped",
]

RETURN_VALUE: Final = "returnValue"
"""The name of what an operation returns, among its results."""

_SCHEMA_FILE: Final = "schema.json"
_BUILTIN_TYPES: Final = frozenset(
    {"bool", "byte", "short", "int", "long", "float", "double", "string", "Object", "Value"}
)
_TYPE_KINDS: Final = frozenset({"interface", "struct", "class", "enumeration", "sequence", "dictionary"})
# As in Slice a name neither begins nor ends with an underscore nor has two together: `__init__` and the like
# cannot be members.
_NAME: Final = re.compile(r"[A-Za-z](?:_?[A-Za-z0-9])*", re.ASCII)
_LONGEST_NAME: Final = 256  # characters, with all that it is in
_LONGEST_SHOWN: Final = 200  # characters of what is wrong
_LARGEST_SCHEMA: Final = 1 << 18
"""Characters of a schema that are read or sent; the largest of ours has 20,000."""
_DEEPEST: Final = 32
"""Types within types, or types that extend each other."""
_WIDEST: Final = 64
"""Types that a sequence or a dictionary is written with, all in all."""

_LONGEST_DIFFERENCE: Final = 1024  # characters; one side of it is what the other process says


class Member(msgspec.Struct, frozen=True, omit_defaults=True):
    """A member of a struct, a class or an exception, a parameter, or a result."""

    name: str
    type: str
    doc: str = ""
    optional: bool = False
    default: bool | int | float | str | None = None
    """The default value, an enumerator by its name; None where there is none."""


class Enumerator(msgspec.Struct, frozen=True, omit_defaults=True):
    """A value of an enumeration."""

    name: str
    value: Annotated[int, msgspec.Meta(ge=0, le=(1 << 31) - 1)]
    doc: str = ""


class OperationDescription(msgspec.Struct, frozen=True, omit_defaults=True):
    """An operation of an interface."""

    name: str
    doc: str = ""
    parameters: tuple[Member, ...] = ()
    results: tuple[Member, ...] = ()
    """What it returns, by the name `returnValue`, and its out parameters."""
    exceptions: dict[str, str] = {}
    """Type ids of the exceptions that it throws, each with its doc."""
    idempotent: bool = False
    streamed: bool = False


class Definition(msgspec.Struct, frozen=True, omit_defaults=True):
    """What a Slice file defines; what does not belong to its kind is empty."""

    kind: Literal[
        "interface", "struct", "class", "exception", "enumeration", "sequence", "dictionary", "constant"
    ]
    module: str
    """The Python module in the package."""
    name: str
    """The name in Python."""
    fingerprint: str
    """The beginning of the digest of its canonical form, which changes with what travels and nothing else."""
    doc: str = ""
    bases: tuple[str, ...] = ()
    members: tuple[Member, ...] = ()
    """Its own members, without those of its bases."""
    operations: tuple[OperationDescription, ...] = ()
    enumerators: tuple[Enumerator, ...] = ()
    element: str = ""
    key: str = ""
    value: str = ""
    type: str = ""
    constant: bool | int | float | str | None = None


class Schema(msgspec.Struct, frozen=True):
    """An interface, what it extends, and every type that they use."""

    interface: str
    definitions: dict[str, Definition]
    """All of them, by type id."""

    def lineage(self, type_id: str) -> list[str]:
        """Return the type ids of a definition and of all that it extends, itself first, each once."""
        found = [type_id]
        for each in found:  # which grows meanwhile
            found += [base for base in self.definitions[each].bases if base not in found]
        return found

    def part(self, interface: str) -> Schema:
        """Return the schema of another interface of this one."""
        return _closure(interface, self.definitions.__getitem__)

    def members(self, type_id: str) -> list[Member]:
        """Return the members of a struct, a class or an exception, those of its bases first."""
        return [
            member for each in reversed(self.lineage(type_id)) for member in self.definitions[each].members
        ]

    def operations(self) -> Iterator[tuple[str, OperationDescription]]:
        """Yield the operations of the interface and of those that it extends, each with its interface."""
        for type_id in self.lineage(self.interface):
            for operation in self.definitions[type_id].operations:
                yield type_id, operation

    def as_json(self) -> str:
        """Return what `parse_schema` reads; raises ConfigurationException when it is too large to be sent."""
        text = msgspec.json.encode(self).decode()
        if len(text) > _LARGEST_SCHEMA:
            raise ConfigurationException(
                f"the schema of {self.interface} has {len(text)} characters where {_LARGEST_SCHEMA} are sent"
            )
        return text

    def kind(self, type_name: str) -> str:
        """Return the kind of what a type is called; nothing for builtin types and proxies."""
        definition = self.definitions.get(type_name)
        return definition.kind if definition else ""

    def type_text(self, type_name: str, *, optional: bool = False, scoped: bool = True) -> str:
        """Return a type with sequences and dictionaries as what they are made of: `sequence<double>`."""
        text = type_name if scoped else unscoped(type_name)
        definition = self.definitions.get(type_name)
        if definition is not None and definition.kind in {"sequence", "dictionary"}:
            inner = ", ".join(self.type_text(each, scoped=scoped) for each in _inner_types(definition))
            text = f"{definition.kind}<{inner}>"
        return f"optional {text}" if optional else text


OBJECT_DEFINITION: Final = Definition(
    kind="interface",
    module="",
    name="Object",
    fingerprint="",
    operations=(
        OperationDescription("ice_ping", idempotent=True),
        OperationDescription(
            "ice_isA",
            parameters=(Member("id", "string"),),
            results=(Member(RETURN_VALUE, "bool"),),
            idempotent=True,
        ),
        OperationDescription("ice_id", results=(Member(RETURN_VALUE, "string"),), idempotent=True),
        OperationDescription("ice_ids", results=(Member(RETURN_VALUE, "sequence<string>"),), idempotent=True),
        OperationDescription("ice_describe", results=(Member(RETURN_VALUE, "string"),), idempotent=True),
    ),
)
"""What every servant answers besides its interface."""


class _PackageSchema(msgspec.Struct):
    definitions: dict[str, Definition]


@lru_cache(maxsize=64)
def describe_package(package: str) -> dict[str, Definition]:
    """Return all definitions of a generated package, by type id: `describe_package("interfaces.nao")`.

    Raises ConfigurationException when codegen did not make the package.
    """
    try:
        data = (resources.files(package) / _SCHEMA_FILE).read_bytes()
        return msgspec.json.decode(data, type=_PackageSchema).definitions
    except (OSError, ImportError, TypeError, ValueError, msgspec.MsgspecError) as error:
        raise ConfigurationException(
            f"{package or 'what stands in no package'} has no readable {_SCHEMA_FILE}:"
            f" generate it with codegen ({error})"
        ) from error


def describe(generated: type[Any]) -> Definition:
    """Return the description of a generated class: struct, enumeration, exception, proxy or servant.

    Subclasses of them are described as what they extend. Raises ConfigurationException for others.
    """
    for cls in generated.__mro__:
        package, _, module = cls.__module__.rpartition(".")
        if not package or package == __package__:
            continue
        interface = vars(cls).get("ice_interface")
        try:
            definitions = describe_package(package)
        except ConfigurationException:
            continue
        for type_id, definition in definitions.items():
            named = definition.module == module and definition.name == cls.__name__
            if named or (isinstance(interface, Interface) and interface.type_id == type_id):
                return definition
    raise ConfigurationException(f"{generated.__qualname__} is not, and does not extend, what codegen made")


def schema_of(interface: Interface) -> Schema:
    """Return the schema of an interface that codegen made.

    Raises ConfigurationException when a package that it needs has none.
    """
    if interface.type_id == OBJECT_TYPE_ID:
        return Schema(OBJECT_TYPE_ID, {OBJECT_TYPE_ID: OBJECT_DEFINITION})
    package = interface.module.rpartition(".")[0]
    slice_module = interface.type_id.rpartition("::")[0]
    root = package.rsplit(".", slice_module.count("::"))[0]

    def find(type_id: str) -> Definition:
        # The package of another Slice module lies beside that of the interface.
        module = type_id.rpartition("::")[0]
        parts = (f"_{part}" if keyword.iskeyword(part) else part for part in module.split("::")[1:])
        known = describe_package(package if module == slice_module else ".".join((root, *parts)))
        if type_id not in known:
            raise ConfigurationException(f"no {_SCHEMA_FILE} describes {type_id}: run codegen again")
        return known[type_id]

    return _closure(interface.type_id, find)


def _closure(interface: str, find: Callable[[str], Definition]) -> Schema:
    """Return the schema of an interface with all that it extends and uses."""
    definitions: dict[str, Definition] = {}
    waiting = [interface]
    while waiting:
        type_id = waiting.pop()
        if type_id in definitions or type_id in _BUILTIN_TYPES or type_id.endswith("*"):
            continue  # of proxies nothing is said but the name of their interface
        definitions[type_id] = definition = find(type_id)
        waiting += [*definition.bases, *_used_types(definition)]
        waiting += [thrown for operation in definition.operations for thrown in operation.exceptions]
    return Schema(interface, definitions)


def unscoped(type_id: str) -> str:
    """Return the last part of a scoped name: `HeadPose` of `::nao::HeadPose`."""
    return type_id.rpartition("::")[2]


def _inner_types(definition: Definition) -> tuple[str, ...]:
    """Return what a sequence or a dictionary is made of."""
    return (definition.element,) if definition.kind == "sequence" else (definition.key, definition.value)


def _used_types(definition: Definition) -> list[str]:
    """Return the names of the types that a definition is made of."""
    used = [member.type for member in definition.members]
    for operation in definition.operations:
        used += [member.type for member in (*operation.parameters, *operation.results)]
    if definition.kind in {"sequence", "dictionary"}:
        used += _inner_types(definition)
    return used


def parse_schema(text: str) -> Schema:
    """Return the schema that another process sent, checked, so that it can be used without further care.

    Raises MarshalException, with the name of what is wrong, for a text that is too large or no schema, and
    for a schema that names what it does not describe, or has types that hold or extend themselves.
    """
    if len(text) > _LARGEST_SCHEMA:
        raise _malformed(f"it has {len(text)} characters where at most {_LARGEST_SCHEMA} are read")
    try:
        schema = msgspec.json.decode(text, type=Schema)
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise _malformed(printable(str(error), _LONGEST_SHOWN)) from error
    if schema.kind(schema.interface) != "interface":
        raise _malformed("it does not describe its interface", schema.interface)
    _Checker(schema).check()
    return schema


class _Checker:
    def __init__(self, schema: Schema) -> None:
        self._schema: Final = schema
        self._sizes: dict[str, tuple[int, int]] = {}
        self._around: list[str] = []

    def check(self) -> None:
        for type_id, definition in self._schema.definitions.items():
            self._check_type_id(type_id)
            self._check_bases(type_id, definition)
        for type_id, definition in self._schema.definitions.items():
            self._check_names(type_id, (each.name for each in definition.enumerators))
            if definition.kind != "interface":
                self._check_names(type_id, (each.name for each in self._schema.members(type_id)))
            for operation in definition.operations:
                self._check_operation(type_id, operation)
            for used in _used_types(definition):
                self._size(used)
        own = self._schema.interface
        self._check_names(own, (operation.name for _, operation in self._schema.operations()))

    def _check_operation(self, type_id: str, operation: OperationDescription) -> None:
        for members in (operation.parameters, operation.results):
            self._check_names(f"{type_id}::{operation.name}", (each.name for each in members))
        for thrown in operation.exceptions:
            if self._schema.kind(thrown) != "exception":
                raise _malformed("it does not describe an exception", thrown)

    def _check_type_id(self, type_id: str) -> None:
        root, *names = type_id.split("::")
        if root or not names or len(type_id) > _LONGEST_NAME or not all(map(_NAME.fullmatch, names)):
            raise _malformed("there is what is no scoped name of Slice", type_id)

    def _check_names(self, where: str, names: Iterable[str]) -> None:
        seen: set[str] = set()
        for name in names:
            if len(name) > _LONGEST_NAME or not _NAME.fullmatch(name):
                raise _malformed(f"{_shown(where)} has what is no name of Slice", name)
            if name in seen:
                raise _malformed(f"{_shown(where)} has a name twice", name)
            seen.add(name)

    def _check_bases(self, type_id: str, definition: Definition) -> None:
        for base in definition.bases:
            if self._schema.kind(base) != definition.kind:
                raise _malformed(f"it does not describe what {_shown(type_id)} extends", base)
        if definition.kind == "interface":
            return
        next_id, length = type_id, 0
        while bases := self._schema.definitions[next_id].bases:
            length += 1
            next_id = bases[0]
            if len(bases) > 1 or length > _DEEPEST or next_id not in self._schema.definitions:
                raise _malformed("a type extends itself, or too many", type_id)

    def _size(self, name: str) -> tuple[int, int]:
        """Return how deep types lie within a type, and of how many it is written; raises MarshalException."""
        if name in _BUILTIN_TYPES:
            return 1, 1
        if name.endswith("*"):
            if name not in {"Object*", "Value*"}:
                self._check_type_id(name.removesuffix("*"))
            return 1, 1
        if (known := self._sizes.get(name)) is not None:
            return known
        definition = self._schema.definitions.get(name)
        if definition is None or definition.kind not in _TYPE_KINDS:
            raise _malformed("it does not describe a type", name)
        if name in self._around:
            raise _malformed("a type holds itself", name)
        depth = width = 1
        if definition.kind in {"struct", "sequence", "dictionary"}:
            self._around.append(name)
            if len(self._around) > _DEEPEST:
                raise _malformed("types are nested too deeply", name)
            sizes = [self._size(each) for each in _used_types(definition)]
            self._around.pop()
            depth += max((inner for inner, _ in sizes), default=0)
            if definition.kind != "struct":
                width += sum(inner for _, inner in sizes)
        if depth > _DEEPEST or width > _WIDEST:
            raise _malformed("types are nested too deeply", name)
        self._sizes[name] = depth, width
        return depth, width


def _malformed(problem: str, name: str | None = None) -> MarshalException:
    told = problem if name is None else f"{problem}: {_shown(name)}"
    return MarshalException(f"malformed schema of an interface: {told}")


def _shown(name: str) -> str:
    return repr(cut(name, _LONGEST_SHOWN))


def describe_difference(found: Schema, wanted: Interface) -> str:
    """Return in what an interface differs from the one that a servant describes."""
    if wanted.type_id not in found.lineage(found.interface):
        return printable(f"the servant has no {wanted.type_id}")
    try:
        expected = schema_of(wanted)
    except ZenohIceError as error:
        return f"the difference is not known ({error})"
    return printable(first_difference(expected, found.part(wanted.type_id)), _LONGEST_DIFFERENCE)


def first_difference(expected: Schema, found: Schema) -> str:
    """Return the first member in which two schemas differ, as the two sides have it."""
    ours, theirs = canonical_lines(expected), canonical_lines(found)
    for subject in sorted({*ours, *theirs}):
        own, other = ours.get(subject), theirs.get(subject)
        if own is None:
            return f"the proxy lacks `{other}`"
        if other is None:
            return f"the servant lacks `{own}`"
        if own != other:
            return f"the proxy has `{own}` where the servant has `{other}`"
    return "they are described alike"


def canonical_lines(schema: Schema) -> dict[str, str]:
    """Return the canonical form of a schema, of which codegen takes the fingerprint, line by line.

    Each line comes by what it is about, such as the scoped name of a member.
    """
    return {
        subject: subject + rest
        for type_id, definition in schema.definitions.items()
        for subject, rest in _lines(schema, type_id, definition)
    }


def _lines(schema: Schema, type_id: str, definition: Definition) -> Iterator[tuple[str, str]]:
    match definition.kind:
        case "interface" | "struct" | "class" | "exception":
            bases = ", ".join(sorted(definition.bases))
            yield f"{definition.kind} {type_id}", f" extends {bases}" if bases else ""
        case "enumeration":
            yield f"enum {type_id}", ""
        case _:  # what uses them says what they are made of
            return
    for member in definition.members:
        yield f"{type_id}::{member.name}", f": {_type(schema, member)}"
    for enumerator in definition.enumerators:
        yield f"{type_id}::{enumerator.name}", f" = {enumerator.value}"
    for operation in definition.operations:
        yield f"{type_id}::{operation.name}", _signature(schema, operation)


def _signature(schema: Schema, operation: OperationDescription) -> str:
    parameters = ", ".join(f"{_type(schema, each)} {each.name}" for each in operation.parameters)
    results = [
        _type(schema, each) + ("" if each.name == RETURN_VALUE else f" {each.name}")
        for each in operation.results
    ]
    text = f"({parameters}): {', '.join(results) or 'void'}"
    if operation.exceptions:
        text += f" throws {', '.join(sorted(operation.exceptions))}"
    return text + " idempotent" * operation.idempotent + " stream" * operation.streamed


def _type(schema: Schema, member: Member) -> str:
    return schema.type_text(member.type, optional=member.optional)
