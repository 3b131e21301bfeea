"""Find what names mean, and report those that mean nothing, the wrong thing, or no longer the same."""

from __future__ import annotations

from codegen.diagnostics import Diagnostics, Note

from . import ast
from .codes import Code
from .lexer import Token
from .phrase_parser import BUILTIN_TYPES
from .symbols import Introduction, Kinds, Scope, Symbols

_DATA_TYPES = (ast.Struct, ast.Class, ast.Interface, ast.Enumeration, ast.Sequence, ast.Dictionary)
_PROXY_TARGETS = (ast.Interface, ast.Class)


class Resolver:
    """The names of a translation unit as far as it has been walked, and the report of what is wrong."""

    def __init__(self, diagnostics: Diagnostics) -> None:
        self.symbols = Symbols()
        self._diagnostics = diagnostics
        self._named_types: list[ast.NamedType] = []

    def error(self, code: Code, message: str, token: Token, *notes: Note) -> None:
        """Report an error at a token."""
        self._diagnostics.error(code, message, token.location, notes)

    def warning(self, code: Code, message: str, token: Token, *notes: Note) -> None:
        """Report a warning at a token."""
        self._diagnostics.warning(code, message, token.location, notes)

    def note(self, code: Code, message: str, token: Token) -> None:
        """Tell something about a token that need not be changed."""
        self._diagnostics.note(code, message, token.location)

    # Types

    def data_type(self, kind: ast.Type, scope: Scope) -> bool:
        """Resolve the type of something that travels; return whether it means something."""
        if isinstance(kind, ast.BuiltinType):
            return True
        if isinstance(kind, ast.NamedType):
            return self._type(kind, scope)
        target = kind.target
        if isinstance(target, ast.BuiltinType):
            return True
        if not self._type(target, scope, _PROXY_TARGETS):
            return False
        definition = target.definition
        if definition is None or not issubclass(declared_kind(definition), _PROXY_TARGETS):
            return not self._wrong_kind(Code.WRONG_KIND, target, "an interface")
        if definition.local:
            message = f"`{target.name}` is local: there is no proxy for it"
            self.error(Code.LOCAL_TYPE, message, target.token)
        return True

    def _type(self, named: ast.NamedType, scope: Scope, proposed: Kinds = _DATA_TYPES) -> bool:
        """Look a type up; what is found in an inner scope but is no type hides no type further out.

        `proposed` are the kinds of definitions that an undefined name could have been meant for.
        """
        wrong: ast.Definition | None = None
        for definition, expected in self.symbols.candidates(named.name, scope.name):
            kind = declared_kind(definition)
            if issubclass(kind, _DATA_TYPES):
                self._found(named, definition, expected, scope)
                return True
            wrong = wrong or definition
            if kind is ast.ExceptionType:
                break
        if wrong is None:
            self._undefined(named, scope, proposed)
        else:
            named.definition = wrong
            self._wrong_kind(Code.WRONG_KIND, named, "a type of data")
        return False

    def warn_of_deprecated_type(self, kind: ast.Type) -> None:
        """Warn of interfaces by value and of proxies for classes."""
        if isinstance(kind, ast.NamedType) and is_kind(kind.definition, ast.Interface):
            message = f"interface `{kind.name}` by value is deprecated; `{kind.name}*` is its proxy"
            self.warning(Code.DEPRECATED, message, kind.token)
        if isinstance(kind, ast.ProxyType) and is_class(kind.target):
            message = f"`{kind.target.name}*`, a proxy for a class, is deprecated"
            self.warning(Code.DEPRECATED, message, kind.target.token)

    # Bases and exceptions

    def base(self, named: ast.NamedType, derived: ast.Definition, scope: Scope) -> ast.Definition | None:
        """Resolve a class or interface that `derived` extends: it must be complete."""
        wanted = ast.Interface if isinstance(derived, ast.Interface) else ast.Class
        return self.complete(named, wanted, derived, scope)

    def complete(
        self, named: ast.NamedType, wanted: type[ast.Definition], derived: ast.Definition, scope: Scope
    ) -> ast.Definition | None:
        """Resolve a class or interface of the wanted kind that is defined, not only declared."""
        if named.name.removeprefix("::") in {derived.name, derived.scoped.removeprefix("::")}:
            found = self.symbols.find(named.name, scope.name)
            if found is None or found.scoped == derived.scoped:
                message = f"{derived.kind} `{derived.name}` extends itself"
                self.error(Code.BAD_INHERITANCE, message, named.token)
                return None
        if not self._type(named, scope, (wanted,)):
            return None
        definition = named.definition
        if definition is None or declared_kind(definition) is not wanted:
            self._wrong_kind(Code.WRONG_KIND, named, with_article(wanted.kind))
            return None
        if isinstance(definition, ast.ForwardDeclaration):
            note = Note("declared here", definition.token.location)
            message = f"`{named.name}` is declared but not defined yet"
            self.error(Code.BAD_INHERITANCE, message, named.token, note)
            named.definition = None
            return None
        return definition

    def exception(self, named: ast.NamedType, scope: Scope, code: Code) -> ast.ExceptionType | None:
        """Resolve what is thrown or extended by an exception."""
        for definition, expected in self.symbols.candidates(named.name, scope.name):
            if isinstance(definition, ast.ExceptionType):
                self._found(named, definition, expected, scope)
                return definition
            named.definition = definition
            self._wrong_kind(code, named, "an exception")
            return None
        self._undefined(named, scope, (ast.ExceptionType,))
        return None

    def _found(self, named: ast.NamedType, definition: ast.Definition, expected: str, scope: Scope) -> None:
        named.definition = definition
        self._named_types.append(named)
        if definition.scoped != expected:
            message = f"`{named.name}` differs only in capitalization from `{definition.scoped}`"
            note = Note("defined here", definition.token.location)
            self.error(Code.CAPITALIZATION, message, named.token, note)
        self.introduce(named.name, scope, named.token)

    def _undefined(self, named: ast.NamedType, scope: Scope, kinds: Kinds) -> None:
        builtin = BUILTIN_TYPES if ast.Struct in kinds else ()
        notes = self.symbols.help(named.name, scope.name, kinds, builtin)
        self.error(Code.UNDEFINED_NAME, f"`{named.name}` is not defined", named.token, *notes)

    def _wrong_kind(self, code: Code, named: ast.NamedType, wanted: str) -> bool:
        found = named.definition
        if found is not None:
            note = Note(f"`{found.name}` is defined here", found.token.location)
            message = f"`{named.name}` is {with_article(declared_kind(found).kind)}, not {wanted}"
            self.error(code, message, named.token, note)
        named.definition = None
        return True

    # Meanings

    def introduce(
        self, name: str, scope: Scope, token: Token, definition: ast.Definition | None = None
    ) -> None:
        """Fix the meaning of a name in a scope from its first use or declaration on.

        Of `A::B` it is the meaning of `A` that is fixed. Names of members and of parameters are apart from
        those of types. `definition` is what the whole name means; without it, it is looked up.
        """
        first, _, rest = name.partition("::")
        if not first:
            return
        if definition is None or rest:
            definition = self.symbols.find(first, scope.name)
        if definition is None:
            return
        kind = declared_kind(definition)
        introduction = Introduction(definition.scoped, kind, token)
        before = scope.introduced.setdefault(first.lower(), introduction)
        if before.scoped == introduction.scoped:
            return
        for apart in (ast.Parameter, ast.Member):
            if (before.kind is apart) != (kind is apart):
                return
        note = Note(f"it means `{before.scoped}` here", before.token.location)
        self.error(Code.CHANGED_MEANING, f"`{first}` changes its meaning in this scope", token, note)

    def finish(self) -> None:
        """Let names that were declared before they were defined mean their definition."""
        for named in self._named_types:
            if isinstance(named.definition, ast.ForwardDeclaration):
                named.definition = self.symbols.get(named.definition.scoped)
                if isinstance(named.definition, ast.ForwardDeclaration):
                    self._never_defined(named, named.definition)

    def _never_defined(self, named: ast.NamedType, declaration: ast.ForwardDeclaration) -> None:
        if declaration.of is ast.Class:
            note = Note("declared here", declaration.token.location)
            message = f"`{named.name}` is declared but not defined in any file included here"
            self.warning(Code.NEVER_DEFINED, message, named.token, note)


def with_article(noun: str) -> str:
    """Return a noun with `a` or `an`."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def declared_kind(definition: ast.Definition) -> type[ast.Definition]:
    """Return the kind of a definition, or of what a declaration announces."""
    return definition.of if isinstance(definition, ast.ForwardDeclaration) else type(definition)


def is_kind(definition: ast.Definition | None, kind: type[ast.Definition]) -> bool:
    """Return whether a definition, or what a declaration announces, is of a kind."""
    return definition is not None and declared_kind(definition) is kind


def is_class(kind: ast.Type) -> bool:
    """Return whether a type is a class by its name."""
    return isinstance(kind, ast.NamedType) and is_kind(kind.definition, ast.Class)


def is_local(kind: ast.Type | None) -> bool:
    """Return whether a type never travels: `LocalObject`, and what is marked `local`."""
    match kind:
        case ast.BuiltinType(name=name):
            return name == "LocalObject"
        case ast.NamedType(definition=ast.Definition() as definition):
            return definition.local
        case ast.ProxyType(target=target):
            return is_local(target)
    return False
