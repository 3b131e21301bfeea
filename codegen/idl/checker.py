"""Give every name its meaning and report what breaks the rules of Slice.

The tree is walked in the order of the source, as a name must be declared before it is used. The rules are
those of the reference compiler; names may have underscores and may begin with `ice`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from codegen.diagnostics import Diagnostics, Note, did_you_mean

from . import ast
from .codes import Code
from .constants import ConstantChecker
from .lexer import Token
from .symbols import Symbols

BUILTIN_TYPES = ("bool", "byte", "short", "int", "long", "float", "double", "string")
_DEEPEST_TYPE = 100
_INTEGRAL_KEYS = frozenset({"bool", "byte", "short", "int", "long", "string"})
_RESERVED_SUFFIXES = ("Helper", "Holder", "Prx", "Ptr")
_KNOWN_METADATA = frozenset({"stream", "amd", "nonmutating", "protected", "delegate", "format", "deprecate"})


def check(root: ast.Module, diagnostics: Diagnostics) -> Symbols:
    """Resolve the names of a translation unit in place, report errors, and return what it declares."""
    checker = _Checker(diagnostics)
    checker.module(root, "")
    checker.finish()
    return checker.symbols


class _Checker:
    def __init__(self, diagnostics: Diagnostics) -> None:
        self.symbols = Symbols()
        self._diagnostics = diagnostics
        self._constants = ConstantChecker(self.symbols, diagnostics)
        self._depths: dict[str, int] = {}
        self._compact_ids: dict[str, ast.Class] = {}
        self._named_types: list[ast.NamedType] = []

    def _error(self, code: Code, message: str, token: Token, *notes: Note) -> None:
        self._diagnostics.error(code, message, token.location, notes)

    def finish(self) -> None:
        """Let names that were declared before they were defined mean their definition."""
        for named in self._named_types:
            if isinstance(named.definition, ast.ForwardDeclaration):
                defined = self.symbols.get(named.definition.scoped)
                if defined is named.definition and named.definition.of is ast.Class:
                    note = Note("declared here", named.definition.token.location)
                    message = f"`{named.name}` is declared but not defined in any file included here"
                    self._error(Code.NEVER_DEFINED, message, named.token, note)
                named.definition = defined

    # Declarations

    def module(self, module: ast.Module, scope: str) -> None:
        """Check the definitions of a module or of the root."""
        for definition in module.definitions:
            if not scope and not isinstance(definition, ast.Module):
                message = f"a {definition.kind} can be defined only inside a module"
                self._error(Code.OUTSIDE_MODULE, message, definition.token)
            definition.scoped = f"{scope}::{definition.name}"
            self._metadata(definition)
            self._declare(definition, scope)
            self._definition(definition, scope)

    def _declare(self, definition: ast.Definition, scope: str) -> None:
        """Make a name known in its scope, unless something else has it."""
        token = definition.token
        self._identifier(definition)
        before = self.symbols.get_any_case(definition.scoped)
        if before is None or self._may_follow(definition, before):
            enclosing = scope.rpartition("::")[2]
            nested = isinstance(definition, ast.Module | ast.Enumerator)
            if definition.name.lower() == enclosing.lower() and not nested:
                message = f"{definition.kind} `{definition.name}` has the name of the module around it"
                self._error(Code.REDEFINITION, message, token)
            if not (isinstance(definition, ast.ForwardDeclaration) and before is not None):
                self.symbols.add(definition)
            return
        first = Note(f"first defined here, as {before.kind}", before.token.location)
        if before.name == definition.name:
            self._error(Code.REDEFINITION, f"`{definition.name}` is defined again", token, first)
        else:
            message = f"`{definition.name}` differs only in capitalization from `{before.name}`"
            self._error(Code.CAPITALIZATION, message, token, first)
            self.symbols.add(definition)

    @staticmethod
    def _may_follow(definition: ast.Definition, before: ast.Definition) -> bool:
        """Return whether a second definition of a name only continues the first."""
        if before.name != definition.name:
            return False
        if isinstance(definition, ast.Module):
            return isinstance(before, ast.Module)
        of = definition.of if isinstance(definition, ast.ForwardDeclaration) else type(definition)
        before_of = before.of if isinstance(before, ast.ForwardDeclaration) else type(before)
        return of is before_of and ast.ForwardDeclaration in (type(definition), type(before))

    def _identifier(self, definition: ast.Definition) -> None:
        name, token = definition.name, definition.token
        if name.startswith("_") or name.endswith("_") or "__" in name:
            message = f"`{name}`: a name neither begins nor ends with an underscore nor has two together"
            self._error(Code.RESERVED_NAME, message, token)
        for suffix in _RESERVED_SUFFIXES:
            if name.endswith(suffix) and name != suffix:
                self._error(Code.RESERVED_NAME, f"`{name}`: the suffix `{suffix}` is reserved", token)

    def _metadata(self, definition: ast.Definition) -> None:
        for metadata in definition.metadata:
            text = metadata.text
            if text == "stream" and not isinstance(definition, ast.Operation):
                message = f"only operations can be streamed, not a {definition.kind}"
                self._error(Code.BAD_STREAM, message, metadata.token)
            elif ":" not in text and text not in _KNOWN_METADATA:
                notes = did_you_mean(text, _KNOWN_METADATA)
                message = f'unknown metadata ["{text}"] is ignored'
                self._diagnostics.warning(Code.UNKNOWN_METADATA, message, metadata.token.location, notes)

    def _definition(self, definition: ast.Definition, scope: str) -> None:
        match definition:
            case ast.Module():
                self.module(definition, definition.scoped)
            case ast.Struct():
                self._members(definition.members, definition.scoped, scope)
                self._struct_in_itself(definition)
            case ast.Class() | ast.ExceptionType():
                if definition.base is not None:
                    self._base(definition.base, definition, scope)
                inherited = {
                    member.name.lower(): member for base in definition.ancestors() for member in base.members
                }
                self._members(definition.members, definition.scoped, scope, inherited)
                if isinstance(definition, ast.Class) and definition.compact_id is not None:
                    self._compact_id(definition, definition.compact_id)
            case ast.Interface():
                self._interface(definition, scope)
            case ast.Enumeration():
                for enumerator in definition.enumerators:
                    enumerator.scoped = f"{definition.scoped}::{enumerator.name}"
                    self._declare(enumerator, definition.scoped)
                self._constants.check_enumeration(definition, scope)
            case ast.Sequence():
                self._data_type(definition.element, scope)
            case ast.Dictionary():
                self._data_type(definition.key, scope)
                self._data_type(definition.value, scope)
                self._dictionary_key(definition)
            case ast.Constant():
                self._data_type(definition.type, scope)
                self._constants.check(definition.literal, definition.type, definition.name, scope)
        self._limit_depth(definition)

    # Types

    def _resolve(self, named: ast.NamedType, scope: str, what: str) -> ast.Definition | None:
        """Find what a name means where it stands; report it when it means nothing."""
        definition = self.symbols.find(named.name, scope)
        if definition is None:
            other = self.symbols.find_any_case(named.name, scope)
            if other is not None:
                message = f"`{named.name}` differs only in capitalization from `{other.name}`"
                note = Note("defined here", other.token.location)
                self._error(Code.CAPITALIZATION, message, named.token, note)
                definition = other
            else:
                notes = self.symbols.proposal(named.name, scope, BUILTIN_TYPES)
                self._error(Code.UNDEFINED_NAME, f"`{named.name}` is not defined", named.token, *notes)
                return None
        named.definition = definition
        self._named_types.append(named)
        if what and definition.kind != what:
            forward = isinstance(definition, ast.ForwardDeclaration) and definition.of.kind == what
            if not forward:
                note = Note(f"`{definition.name}` is defined here", definition.token.location)
                message = f"`{named.name}` is a {definition.kind}, not an {what}".replace(
                    "an class", "a class"
                )
                code = Code.BAD_THROWS if what == "exception" else Code.WRONG_KIND
                self._error(code, message, named.token, note)
                named.definition = None
                return None
        return definition

    def _data_type(self, kind: ast.Type, scope: str) -> None:
        """Resolve the type of something that travels."""
        if isinstance(kind, ast.ProxyType):
            if isinstance(kind.target, ast.NamedType):
                self._resolve(kind.target, scope, "interface")
            self._error(Code.NOT_SUPPORTED, "proxies as values are not supported", kind.token)
        elif isinstance(kind, ast.BuiltinType):
            if kind.name not in BUILTIN_TYPES:
                self._error(Code.NOT_SUPPORTED, f"`{kind.name}` as a value is not supported", kind.token)
        else:
            definition = self._resolve(kind, scope, "")
            if definition is None:
                return
            if isinstance(definition, ast.Interface) or (
                isinstance(definition, ast.ForwardDeclaration) and definition.of is ast.Interface
            ):
                message = f"the interface `{kind.name}` is not a value"
                self._error(Code.WRONG_KIND, message, kind.token)
            elif not isinstance(
                definition,
                ast.Struct
                | ast.Class
                | ast.Enumeration
                | ast.Sequence
                | ast.Dictionary
                | ast.ForwardDeclaration,
            ):
                note = Note(f"`{definition.name}` is defined here", definition.token.location)
                message = f"`{kind.name}` is a {definition.kind}, not a type".replace("a e", "an e")
                self._error(Code.WRONG_KIND, message, kind.token, note)
                kind.definition = None

    def _struct_in_itself(self, struct: ast.Struct) -> None:
        for member in struct.members:
            if isinstance(member.type, ast.NamedType) and member.type.definition is struct:
                message = f"struct `{struct.name}` contains itself"
                self._error(Code.CONTAINS_ITSELF, message, member.type.token)
                member.type.definition = None

    def _dictionary_key(self, dictionary: ast.Dictionary) -> None:
        reason = _why_not_a_key(dictionary.key)
        if reason:
            token = dictionary.key.token
            message = f"the key of dictionary `{dictionary.name}` {reason}"
            note = Note("a key is a bool, an integer, a string, an enumeration, or a struct of these")
            self._error(Code.BAD_DICTIONARY_KEY, message, token, note)
        elif isinstance(dictionary.key, ast.NamedType) and isinstance(dictionary.key.definition, ast.Struct):
            message = "structs as keys of a dictionary are not supported"
            self._error(Code.NOT_SUPPORTED, message, dictionary.key.token)

    def _limit_depth(self, definition: ast.Definition) -> None:
        """Report types that contain or extend others too deeply for those that walk them, here and later."""
        depth = 0
        for named in _parts(definition):
            part = named.definition
            if part is None or isinstance(part, ast.ForwardDeclaration):
                continue
            if self._depths.get(part.scoped, 0) >= _DEEPEST_TYPE:
                message = (
                    f"`{named.name}` is nested too deeply: more than {_DEEPEST_TYPE} types in each other"
                )
                self._error(Code.TOO_DEEP, message, named.token)
                named.definition = None
            else:
                depth = max(depth, self._depths.get(part.scoped, 0))
        self._depths[definition.scoped] = depth + 1
        if isinstance(definition, ast.Interface):
            definition.generation = depth

    def _compact_id(self, definition: ast.Class, token: Token) -> None:
        other = self._compact_ids.setdefault(token.text, definition)
        if other is not definition:
            note = Note("first used here", other.token.location)
            message = f"the compact id {token.text} belongs to class `{other.name}`"
            self._error(Code.REDEFINITION, message, token, note)

    # Members, inheritance, operations

    def _unique(
        self, items: Iterable[ast.Definition], scope: str, inherited: dict[str, ast.Member] | None = None
    ) -> None:
        """Report names that appear twice, or differ only in capitalization, or are inherited."""
        seen: dict[str, ast.Definition] = {}
        for item in items:
            item.scoped = f"{scope}::{item.name}"
            self._identifier(item)
            self._metadata(item)
            first = seen.setdefault(item.name.lower(), item)
            if first is not item:
                note = Note("first defined here", first.token.location)
                if first.name == item.name:
                    message = f"{item.kind} `{item.name}` is defined again"
                    self._error(Code.REDEFINITION, message, item.token, note)
                else:
                    message = f"{item.kind} `{item.name}` differs only in capitalization from `{first.name}`"
                    self._error(Code.CAPITALIZATION, message, item.token, note)
            elif inherited and item.name.lower() in inherited:
                base = inherited[item.name.lower()]
                note = Note("first defined here", base.token.location)
                message = f"{item.kind} `{item.name}` is inherited already"
                self._error(Code.REDEFINITION, message, item.token, note)

    def _members(
        self,
        members: Sequence[ast.Member],
        owner: str,
        scope: str,
        inherited: dict[str, ast.Member] | None = None,
    ) -> None:
        self._unique(members, owner, inherited)
        for member in members:
            self._data_type(member.type, scope)
            if member.default is not None:
                self._constants.check(member.default, member.type, member.name, scope)
                message = "the default value is not used: every member is always sent"
                self._diagnostics.warning(Code.DEFAULT_NOT_SENT, message, member.default.token.location)

    def _base(self, named: ast.NamedType, derived: ast.Definition, scope: str) -> ast.Definition | None:
        """Resolve a base, which must be of the same kind and complete."""
        base = self._resolve(named, scope, derived.kind)
        if base is derived or (isinstance(base, ast.ForwardDeclaration) and base.scoped == derived.scoped):
            message = f"{derived.kind} `{derived.name}` extends itself"
            self._error(Code.BAD_INHERITANCE, message, named.token)
        elif isinstance(base, ast.ForwardDeclaration):
            note = Note("declared here", base.token.location)
            message = f"`{named.name}` is declared but not defined yet"
            self._error(Code.BAD_INHERITANCE, message, named.token, note)
        else:
            return base
        named.definition = None
        return None

    def _interface(self, interface: ast.Interface, scope: str) -> None:
        direct: dict[str, ast.NamedType] = {}
        for named in interface.bases:
            base = self._base(named, interface, scope)
            if base is not None:
                direct.setdefault(base.scoped, named)
        interface.bases = list(direct.values())
        inherited = self._inherited_operations(interface)
        self._unique(interface.operations, interface.scoped)
        used: dict[str, Token] = {}
        for operation in interface.operations:
            self._operation(operation, interface, inherited, used)

    def _inherited_operations(self, interface: ast.Interface) -> dict[str, ast.Operation]:
        inherited: dict[str, ast.Operation] = {}
        for base in interface.ancestors():
            for operation in base.operations:
                other = inherited.setdefault(operation.name.lower(), operation)
                if other.scoped != operation.scoped:
                    notes = [Note("one is here", other.token.location)]
                    notes.append(Note("the other is here", operation.token.location))
                    message = f"`{interface.name}` inherits `{operation.name}` from two unrelated interfaces"
                    self._error(Code.AMBIGUOUS_OPERATION, message, interface.token, *notes)
        return inherited

    def _operation(
        self,
        operation: ast.Operation,
        interface: ast.Interface,
        inherited: dict[str, ast.Operation],
        used: dict[str, Token],
    ) -> None:
        """Check an operation; `used` are the names of types that the interface has used so far."""
        token, scope = operation.token, interface.scoped
        before = inherited.get(operation.name.lower())
        if before is not None:
            note = Note("first defined here", before.token.location)
            self._error(Code.REDEFINITION, f"operation `{operation.name}` is inherited already", token, note)
        if operation.name.startswith("ice_"):
            message = f"operation `{operation.name}`: names with `ice_` belong to what every object offers"
            self._error(Code.RESERVED_NAME, message, token)
        if operation.name.lower() == interface.name.lower():
            message = f"operation `{operation.name}` has the name of its interface"
            self._error(Code.REDEFINITION, message, token)
        if operation.returns is not None:
            self._data_type(operation.returns, scope)
        for kind in (operation.returns, *(parameter.type for parameter in operation.parameters)):
            if kind is not None:
                used.setdefault(_first_name(kind).lower(), kind.token)
        meaning = used.get(operation.name.lower())
        if meaning is not None:
            note = Note(f"`{meaning.text}` is used here with its former meaning", meaning.location)
            message = f"`{operation.name}` changes its meaning in `{interface.name}`"
            self._error(Code.CHANGED_MEANING, message, token, note)
        self._unique(operation.parameters, operation.scoped)
        out: ast.Parameter | None = None
        for parameter in operation.parameters:
            self._data_type(parameter.type, scope)
            if parameter.out:
                out = out or parameter
            elif out is not None:
                note = Note("the out parameter is here", out.token.location)
                message = f"in parameter `{parameter.name}` stands behind an out parameter"
                self._error(Code.OUT_BEFORE_IN, message, parameter.token, note)
            if parameter.out and parameter.name == "returnValue" and operation.returns is not None:
                message = "`returnValue` is how the wire calls what an operation returns"
                self._error(Code.RESERVED_NAME, message, parameter.token)
        thrown: set[str] = set()
        for named in operation.throws:
            exception = self._resolve(named, scope, "exception")
            if exception is not None and exception.scoped in thrown:
                self._error(Code.BAD_THROWS, f"`{named.name}` stands in `throws` twice", named.token)
            thrown.add(exception.scoped if exception else "")
        if operation.streamed and operation.returns is None and not operation.outputs:
            message = f"operation `{operation.name}` is streamed but returns nothing"
            self._error(Code.BAD_STREAM, message, token)


def _parts(definition: ast.Definition) -> Iterator[ast.NamedType]:
    """Yield the types that a definition is made of: members, elements, bases, but not members of classes."""
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


def _first_name(kind: ast.Type) -> str:
    """Return the name by which a type is looked up, nothing for a builtin."""
    if isinstance(kind, ast.ProxyType):
        return _first_name(kind.target)
    return kind.name.partition("::")[0] if isinstance(kind, ast.NamedType) else ""


def _why_not_a_key(kind: ast.Type) -> str:
    """Return why values of a type cannot be keys of a dictionary; nothing when they can."""
    match kind:
        case ast.BuiltinType(name=name):
            return "" if name in _INTEGRAL_KEYS else f"is a {name}"
        case ast.NamedType(definition=ast.Enumeration()):
            return ""
        case ast.NamedType(definition=ast.Struct() as struct):
            for member in struct.members:
                reason = _why_not_a_key(member.type)
                if reason:
                    return f"has a member `{member.name}` that {reason}"
            return ""
        case ast.NamedType(definition=ast.Definition() as definition):
            return f"is a {definition.kind}"
        case ast.ProxyType():
            return "is a proxy"
    return ""
