"""Find what the names of types mean, and report those that mean nothing or the wrong thing."""

from __future__ import annotations

from codegen.diagnostics import Diagnostics, Note

from . import ast
from .codes import Code
from .lexer import Token
from .phrase_parser import BUILTIN_TYPES
from .symbols import Symbols

_DATA_TYPES = ast.Struct | ast.Class | ast.Interface | ast.Enumeration | ast.Sequence | ast.Dictionary
_PROXY_TARGETS = ast.Interface | ast.Class


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

    def definition(self, named: ast.NamedType, scope: str) -> ast.Definition | None:
        """Find what a name means where it stands; report it when it means nothing."""
        definition = self.symbols.find(named.name, scope)
        if definition is None:
            definition = self.symbols.find_any_case(named.name, scope)
            if definition is None:
                notes = self.symbols.proposal(named.name, scope, BUILTIN_TYPES)
                self.error(Code.UNDEFINED_NAME, f"`{named.name}` is not defined", named.token, *notes)
                return None
            message = f"`{named.name}` differs only in capitalization from `{definition.name}`"
            note = Note("defined here", definition.token.location)
            self.error(Code.CAPITALIZATION, message, named.token, note)
        named.definition = definition
        self._named_types.append(named)
        return definition

    def definition_of(
        self, kind: type[ast.Definition], named: ast.NamedType, scope: str, code: Code = Code.WRONG_KIND
    ) -> ast.Definition | None:
        """Find a definition, or a declaration, of one kind; report a name that means something else."""
        definition = self.definition(named, scope)
        if definition is None or (declared_kind(definition) is kind):
            return definition
        self._wrong_kind(code, named, definition, with_article(kind.kind))
        return None

    def data_type(self, kind: ast.Type, scope: str) -> None:
        """Resolve the type of something that travels."""
        if isinstance(kind, ast.ProxyType):
            if isinstance(kind.target, ast.NamedType):
                definition = self.definition(kind.target, scope)
                if definition is not None and not issubclass(declared_kind(definition), _PROXY_TARGETS):
                    self._wrong_kind(Code.WRONG_KIND, kind.target, definition, "an interface")
        elif isinstance(kind, ast.NamedType):
            definition = self.definition(kind, scope)
            if definition is not None and not issubclass(declared_kind(definition), _DATA_TYPES):
                self._wrong_kind(Code.WRONG_KIND, kind, definition, "a type of data")

    def base(self, named: ast.NamedType, derived: ast.Definition, scope: str) -> ast.Definition | None:
        """Resolve a base, which must be of the same kind and complete."""
        base = self.definition_of(type(derived), named, scope)
        if base is derived or (isinstance(base, ast.ForwardDeclaration) and base.scoped == derived.scoped):
            message = f"{derived.kind} `{derived.name}` extends itself"
            self.error(Code.BAD_INHERITANCE, message, named.token)
        elif isinstance(base, ast.ForwardDeclaration):
            note = Note("declared here", base.token.location)
            message = f"`{named.name}` is declared but not defined yet"
            self.error(Code.BAD_INHERITANCE, message, named.token, note)
        else:
            return base
        named.definition = None
        return None

    def _wrong_kind(self, code: Code, named: ast.NamedType, found: ast.Definition, wanted: str) -> None:
        note = Note(f"`{found.name}` is defined here", found.token.location)
        message = f"`{named.name}` is {with_article(declared_kind(found).kind)}, not {wanted}"
        self.error(code, message, named.token, note)
        named.definition = None

    def finish(self) -> None:
        """Let names that were declared before they were defined mean their definition."""
        for named in self._named_types:
            if isinstance(named.definition, ast.ForwardDeclaration):
                defined = self.symbols.get(named.definition.scoped)
                if defined is named.definition and named.definition.of is ast.Class:
                    note = Note("declared here", named.definition.token.location)
                    message = f"`{named.name}` is declared but not defined in any file included here"
                    self.error(Code.NEVER_DEFINED, message, named.token, note)
                named.definition = defined


def with_article(noun: str) -> str:
    """Return a noun with `a` or `an`."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def declared_kind(definition: ast.Definition) -> type[ast.Definition]:
    """Return the kind of a definition, or of what a declaration announces."""
    return definition.of if isinstance(definition, ast.ForwardDeclaration) else type(definition)
