"""Check a tree by the rules of Slice, and set its names, values and tags.

The tree is walked in the order of the source, since names must be declared before use. The rules are those
of the reference compiler, slice2py of Ice 3.7.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from codegen.diagnostics import Diagnostics, did_you_mean

from . import ast
from .constants import ConstantChecker
from .report import Code, note_at
from .resolver import Resolver, Scope, declared_kind, with_article

_DEEPEST_TYPE = 100
_TAG = "the tag of an optional value"
_KEY_TYPES = frozenset({"bool", "byte", "short", "int", "long", "string"})
_METADATA = frozenset(
    """
    amd async-oneway bitset deepcopy delegate deprecate deprecated format marshaled-result nonmutating
    preserve-slice property protected stop stream UserException
    """.split()  # noqa: SIM905 - a list of words is easier to read than of literals
)
"""Metadata without a colon that Slice or codegen knows."""

_Inherited = dict[str, ast.Definition]
"""Members and operations of bases, by name in lower case."""


def check(root: ast.Module, diagnostics: Diagnostics) -> None:
    """Resolve the names of a translation unit in place and report its errors."""
    _Checker(diagnostics).check(root)


class _Checker:
    def __init__(self, diagnostics: Diagnostics) -> None:
        self._resolver = Resolver(diagnostics)
        self._error, self._warning = self._resolver.report.error, self._resolver.report.warning
        self._constants = ConstantChecker(self._resolver)
        self._depths: dict[str, int] = {}
        self._compact_ids: dict[int, ast.Literal] = {}

    def check(self, root: ast.Module) -> None:
        """Check a translation unit."""
        self._resolver.symbols.expect(root)
        self._definitions(root, Scope())
        self._resolver.finish()

    def _definitions(self, module: ast.Module, scope: Scope) -> None:
        """Check the definitions of a module or of the root, whose body is `scope`."""
        for definition in module.definitions:
            self._metadata(definition)
            self._definition(definition, scope)
            self._limit_depth(definition)

    def _definition(self, definition: ast.Definition, scope: Scope) -> None:
        match definition:
            case ast.Module():
                if self._resolver.declare(definition, scope):
                    self._resolver.introduce(definition.name, scope, definition.token, definition)
                self._definitions(definition, Scope(definition.scoped))
            case ast.ForwardDeclaration():
                new = self._resolver.declare(definition, scope)
                if new and definition.of is ast.Interface:
                    self._resolver.introduce(definition.name, scope, definition.token, definition)
            case ast.Struct():
                self._items(definition, definition.members, self._body(definition, scope), {})
            case ast.ExceptionType():
                if definition.base is not None:
                    base = self._resolver.exception(definition.base, scope, Code.WRONG_KIND)
                    if not definition.local:
                        self._never_local(base, definition.base)
                inherited = _names_in(definition.ancestors())
                self._items(definition, definition.members, self._body(definition, scope), inherited)
            case ast.Class():
                self._class(definition, scope)
            case ast.Interface():
                self._interface(definition, scope)
            case ast.Enumeration():
                body = self._body(definition, scope)
                for enumerator in definition.enumerators:
                    self._constants.check_enumerator_value(enumerator, body)
                    self._resolver.declare_inside(enumerator, body)
                self._constants.number_enumerators(definition)
            case ast.Sequence():
                self._resolver.data_type(definition.element, replace(scope, local=definition.local))
                self._resolver.declare(definition, scope)
                self._resolver.warn_of_deprecated_type(definition.element)
            case ast.Dictionary():
                self._dictionary(definition, scope)
            case ast.Constant():
                if self._resolver.data_type(definition.type, replace(scope, local=True)):
                    what = f"constant `{definition.name}`"
                    self._constants.check_value(definition.literal, definition.type, what, scope)
                self._resolver.declare(definition, scope)

    def _body(self, definition: ast.Definition, scope: Scope) -> Scope:
        """Declare a definition and return the scope of its body."""
        if self._resolver.declare(definition, scope):
            self._resolver.introduce(definition.name, scope, definition.token, definition)
            return Scope(definition.scoped, local=definition.local)
        return Scope(f"{definition.scoped} (again)", local=definition.local)

    def _metadata(self, definition: ast.Definition) -> None:
        """Report metadata that is unknown or not allowed."""
        kind = with_article(definition.kind)
        is_operation = isinstance(definition, ast.Operation)
        for metadata in definition.metadata:
            text = metadata.text
            if text == "stream" and not is_operation:
                self._error(Code.BAD_STREAM, f"only operations can be streamed, not {kind}", metadata.token)
            elif text == "stop" and not is_operation:
                self._error(Code.BAD_STOP, f'["stop"] is for operations, not for {kind}', metadata.token)
            elif text == "amd":
                message = '["amd"] has no effect: a servant answers a call when its method returns'
                self._warning(Code.IGNORED_AMD, message, metadata.token)
            elif ":" not in text and text not in _METADATA:
                message = f'unknown metadata ["{text}"] is ignored'
                self._warning(Code.UNKNOWN_METADATA, message, metadata.token, *did_you_mean(text, _METADATA))

    def _limit_depth(self, definition: ast.Definition) -> None:
        """Report types that contain or extend others too deeply for recursive algorithms."""
        depth = 0
        for named in _parts(definition):
            part = named.definition
            if part is None or isinstance(part, ast.ForwardDeclaration):
                continue
            if self._depths.get(part.scoped, 0) >= _DEEPEST_TYPE:
                message = f"`{named.name}` is nested too deeply: more than {_DEEPEST_TYPE} levels"
                self._error(Code.TOO_DEEP, message, named.token)
                named.definition = None
            else:
                depth = max(depth, self._depths.get(part.scoped, 0))
        self._depths[definition.scoped] = depth + 1

    # Structs, exceptions and classes

    def _items(
        self,
        owner: ast.Definition,
        items: Iterable[ast.Member | ast.Operation],
        scope: Scope,
        inherited: _Inherited,
    ) -> None:
        """Check the members and operations of `owner`, whose body is `scope`."""
        tags: dict[int, ast.Literal] = {}
        for item in items:
            self._metadata(item)
            if isinstance(item, ast.Member):
                self._member(item, owner, scope, inherited)
                self._unique_number(item.tag, "tag", tags)
            else:
                self._operation(item, owner, scope, inherited)

    def _member(self, member: ast.Member, owner: ast.Definition, scope: Scope, inherited: _Inherited) -> None:
        if isinstance(owner, ast.Struct):
            if member.tag is not None:
                message = f"member `{member.name}` cannot be optional in a struct"
                self._error(Code.BAD_TAG, message, member.tag.token, note_at("use a class or an exception"))
        elif member.tag is not None:
            self._constants.check_number(member.tag, _TAG, scope)
        if not self._resolver.data_type(member.type, scope):
            self._resolver.declare_inside(member, scope)
            return
        if member.default is not None:
            self._constants.check_value(member.default, member.type, f"member `{member.name}`", scope)
        new = self._resolver.declare_inside(member, scope)
        self._resolver.report_inherited(member, inherited)
        if (
            isinstance(owner, ast.Struct)
            and isinstance(member.type, ast.NamedType)
            and member.type.definition is owner
        ):
            self._error(Code.CONTAINS_ITSELF, f"struct `{owner.name}` contains itself", member.type.token)
            member.type.definition = None
        self._resolver.warn_of_deprecated_type(member.type)
        if new:
            self._resolver.introduce(member.name, scope, member.token, member)

    def _class(self, definition: ast.Class, scope: Scope) -> None:
        number = definition.compact_id
        if number is not None:
            self._constants.check_number(number, "the compact id of a class", scope)
        if definition.base is not None:
            self._resolver.complete(definition.base, ast.Class, definition, scope)
        definition.implements = self._bases(definition, definition.implements, scope)
        items: list[ast.Member | ast.Operation] = [*definition.members, *definition.operations]
        items.sort(key=lambda item: item.token.offset)
        body = self._body(definition, scope)
        self._items(definition, items, body, self._inherited(definition))
        self._unique_number(number, "compact id", self._compact_ids)
        if not definition.local and (definition.implements or definition.operations):
            what = "operations" if definition.operations else "implemented interfaces"
            message = f"{what} of a class are deprecated and ignored; use an interface"
            self._warning(Code.DEPRECATED, message, definition.token)

    # Dictionaries

    def _dictionary(self, dictionary: ast.Dictionary, scope: Scope) -> None:
        inside = replace(scope, local=dictionary.local)
        key = self._resolver.data_type(dictionary.key, inside)
        value = self._resolver.data_type(dictionary.value, inside)
        self._resolver.declare(dictionary, scope)
        if key:
            self._dictionary_key(dictionary)
        if value:
            self._resolver.warn_of_deprecated_type(dictionary.value)

    def _dictionary_key(self, dictionary: ast.Dictionary) -> None:
        reason = _why_not_a_key(dictionary.key)
        token = dictionary.key.token
        if reason:
            message = f"the key of dictionary `{dictionary.name}` {reason}"
            note = note_at("a key can be a bool, an integer, a string, an enumeration, or a struct of these")
            self._error(Code.BAD_DICTIONARY_KEY, message, token, note)
        elif _holds_sequence(dictionary.key):
            message = f"sequences in the key of dictionary `{dictionary.name}` are deprecated"
            self._warning(Code.DEPRECATED, message, token)

    # Interfaces, and what classes implement

    def _interface(self, definition: ast.Interface, scope: Scope) -> None:
        definition.bases = self._bases(definition, definition.bases, scope)
        body = self._body(definition, scope)
        inherited = self._inherited(definition)
        self._items(definition, definition.operations, body, inherited)
        if not definition.local:
            self._stops(definition)
            self._generated_names(definition, inherited)

    def _bases(
        self, derived: ast.Interface | ast.Class, named: Sequence[ast.NamedType], scope: Scope
    ) -> list[ast.NamedType]:
        """Resolve the interfaces that are extended or implemented; return the valid ones, each once."""
        good: dict[str, ast.NamedType] = {}
        for each in named:
            base = self._resolver.complete(each, ast.Interface, derived, scope)
            if base is not None:
                good.setdefault(base.scoped, each)
        return list(good.values())

    def _inherited(self, derived: ast.Interface | ast.Class) -> _Inherited:
        """Return the inherited members and operations; report operations that two bases define."""
        named = derived.bases if isinstance(derived, ast.Interface) else [derived.base, *derived.implements]
        bases = [each.definition for each in named if each is not None and each.definition is not None]
        inherited: _Inherited = {}
        for base in bases:
            for name, operation in _names_in([base]).items():
                other = inherited.setdefault(name, operation)
                if other is not operation and isinstance(operation, ast.Operation):
                    notes = [note_at("one is here", other.token)]
                    notes.append(note_at("the other is here", operation.token))
                    message = f"`{derived.name}` inherits `{operation.name}` from two unrelated interfaces"
                    self._error(Code.AMBIGUOUS_OPERATION, message, derived.token, *notes)
        return inherited

    def _operation(
        self, operation: ast.Operation, owner: ast.Definition, scope: Scope, inherited: _Inherited
    ) -> None:
        if operation.return_tag is not None:
            self._constants.check_number(operation.return_tag, _TAG, scope)
        if operation.returns is not None:
            self._resolver.data_type(operation.returns, scope)
        new = self._resolver.declare_inside(operation, scope)
        self._resolver.report_inherited(operation, inherited)
        if operation.name.lower() == owner.name.lower():
            message = f"operation `{operation.name}` has the name of its {owner.kind}"
            self._error(Code.REDEFINITION, message, operation.token)
        if operation.streamed and operation.returns is None and not operation.outputs:
            message = f"operation `{operation.name}` is streamed but returns nothing"
            self._error(Code.BAD_STREAM, message, operation.token)
        if new:
            self._resolver.introduce(operation.name, scope, operation.token, operation)
        self._parameters(operation, Scope(operation.scoped, local=scope.local))
        self._throws(operation, scope)

    def _parameters(self, operation: ast.Operation, scope: Scope) -> None:
        tags: dict[int, ast.Literal] = {}
        self._unique_number(operation.return_tag, "tag", tags)
        before: ast.Parameter | None = None
        for parameter in operation.parameters:
            self._metadata(parameter)
            if parameter.tag is not None:
                self._constants.check_number(parameter.tag, _TAG, scope)
            if self._resolver.data_type(parameter.type, scope):
                self._resolver.warn_of_deprecated_type(parameter.type)
            if self._resolver.declare_inside(parameter, scope):
                self._resolver.introduce(parameter.name, scope, parameter.token, parameter)
            if before is not None and before.out and not parameter.out:
                note = note_at("the out parameter is here", before.token)
                message = f"in parameter `{parameter.name}` comes after an out parameter"
                self._error(Code.OUT_BEFORE_IN, message, parameter.token, note)
            self._unique_number(parameter.tag, "tag", tags)
            before = parameter

    def _never_local(self, exception: ast.ExceptionType | None, named: ast.NamedType) -> None:
        if exception is not None and exception.local:
            self._error(Code.LOCAL, f"`{named.name}` is local: it is never sent", named.token)

    def _unique_number(self, number: ast.Literal | None, what: str, used: dict[int, ast.Literal]) -> None:
        """Report a tag or a compact id that is in `used`, or add it."""
        if number is None or not isinstance(number.value, int):
            return
        first = used.setdefault(number.value, number)
        if first is not number:
            note = note_at("first used here", first.token)
            self._error(Code.BAD_TAG, f"{what} {number.value} is used twice", number.token, note)

    def _throws(self, operation: ast.Operation, scope: Scope) -> None:
        thrown: dict[str, ast.NamedType] = {}
        for named in operation.throws:
            exception = self._resolver.exception(named, scope, Code.BAD_THROWS)
            if not scope.local:
                self._never_local(exception, named)
            first = thrown.setdefault(exception.scoped, named) if exception else named
            if first is not named:
                note = note_at("first named here", first.token)
                self._error(Code.BAD_THROWS, f"`{named.name}` is in `throws` twice", named.token, note)

    def _stops(self, owner: ast.Interface) -> None:
        """Report stop operations that cannot be called without further information, or several of them."""
        marked = [operation for operation in owner.operations if operation.stop]
        for operation in marked:
            if operation is not marked[0]:
                note = note_at("the first is here", marked[0].token)
                message = f'`{owner.name}` has two operations marked ["stop"]; one must stop everything'
                self._error(Code.BAD_STOP, message, operation.token, note)
            problems = []
            if operation.returns is not None or operation.outputs:
                problems.append("returns something")
            if any(parameter.tag is None for parameter in operation.inputs):
                problems.append("has a parameter that is not optional")
            if not operation.idempotent:
                problems.append("is not idempotent")
            if problems:
                message = f'operation `{operation.name}` is marked ["stop"] but {" and ".join(problems)}'
                self._error(Code.BAD_STOP, message, operation.token)

    def _generated_names(self, interface: ast.Interface, inherited: _Inherited) -> None:
        """Report operations and parameters with a name that proxies, servants or the protocol use."""
        own = interface.operations
        for operation in own:
            if operation.name.startswith("ice_"):
                message = f"operation `{operation.name}`: names with `ice_` are reserved"
                self._error(Code.RESERVED_NAME, message, operation.token)
            for parameter in operation.outputs:
                if parameter.name == "returnValue" and operation.returns is not None:
                    message = "`returnValue` is reserved: it is the return value in the protocol"
                    self._error(Code.RESERVED_NAME, message, parameter.token)
        operations = {each.name: each for each in inherited.values() if isinstance(each, ast.Operation)}
        operations |= {operation.name: operation for operation in own}
        for operation in operations.values():
            other = operations.get(f"{operation.name}Publisher")
            if operation.streamed and other is not None and (operation in own or other in own):
                note = note_at(f"it is generated for the stream `{operation.name}`", operation.token)
                message = f"operation `{other.name}` has the name of a generated method"
                self._error(Code.NAME_CLASH_IN_OUTPUT, message, other.token, note)


# Parts of definitions


def _names_in(bases: Iterable[ast.Definition]) -> _Inherited:
    """Return the members and operations of classes, interfaces, exceptions and their bases."""
    found: _Inherited = {}
    for base in bases:
        if isinstance(base, ast.Interface):
            for interface in (base, *base.ancestors()):
                found |= {operation.name.lower(): operation for operation in interface.operations}
        elif isinstance(base, ast.Derivable):
            for derivable in (base, *base.ancestors()):
                found |= {member.name.lower(): member for member in derivable.members}
                if isinstance(derivable, ast.Class):
                    found |= {operation.name.lower(): operation for operation in derivable.operations}
                    found |= _names_in(
                        named.definition for named in derivable.implements if named.definition is not None
                    )
    return found


def _parts(definition: ast.Definition) -> Iterator[ast.NamedType]:
    """Yield the types of members, elements and bases of a definition, but not of members of classes."""
    types: list[ast.Type | None] = []
    match definition:
        case ast.Struct():
            types = [member.type for member in definition.members]
        case ast.Class():
            types = [definition.base]
        case ast.ExceptionType():
            types = [definition.base, *(member.type for member in definition.members)]
        case ast.Interface():
            types = [*definition.bases]
        case ast.Sequence():
            types = [definition.element]
        case ast.Dictionary():
            types = [definition.key, definition.value]
    yield from (kind for kind in types if isinstance(kind, ast.NamedType))


def _why_not_a_key(kind: ast.Type) -> str:
    """Return why a type cannot be the key of a dictionary, or an empty text if it can."""
    match kind:
        case ast.BuiltinType(name=name):
            return "" if name in _KEY_TYPES else f"is {with_article(name)}"
        case ast.NamedType(definition=ast.Enumeration()):
            return ""
        case ast.NamedType(definition=ast.Sequence() as sequence):
            reason = _why_not_a_key(sequence.element)
            return f"is a sequence whose element {reason}" if reason else ""
        case ast.NamedType(definition=ast.Struct() as struct):
            for member in struct.members:
                reason = _why_not_a_key(member.type)
                if reason:
                    return f"has a member `{member.name}` that {reason}"
            return ""
        case ast.NamedType(definition=ast.Definition() as definition):
            return f"is {with_article(declared_kind(definition).kind)}"
        case ast.ProxyType():
            return "is a proxy"
    return ""


def _holds_sequence(kind: ast.Type) -> bool:
    """Return whether a type is a sequence or a struct that contains one."""
    match kind:
        case ast.NamedType(definition=ast.Sequence()):
            return True
        case ast.NamedType(definition=ast.Struct() as struct):
            return any(_holds_sequence(member.type) for member in struct.members)
    return False
