"""The rules for `local`: what never travels is used only by what never travels either."""

from __future__ import annotations

from collections.abc import Iterable

from codegen.diagnostics import Note

from . import ast
from .codes import Code
from .lexer import Token
from .resolver import Resolver, is_local
from .symbols import Scope


class LocalityRules:
    """Reports what travels but is made of something local."""

    def __init__(self, resolver: Resolver) -> None:
        self._resolver = resolver

    def type(self, kind: ast.Type | None, scope: Scope, what: str) -> None:
        """Report a local type in a scope that is not local; `what` names what has the type."""
        if not scope.local and is_local(kind) and kind is not None:
            name = kind.name if not isinstance(kind, ast.ProxyType) else kind.target.name
            message = f"the type `{name}` of {what} is local, so that it cannot travel"
            self._resolver.error(Code.LOCAL_TYPE, message, kind.token)

    def thrown(self, exception: ast.ExceptionType, named: ast.NamedType, scope: Scope) -> None:
        """Report a local exception that an operation throws to its caller."""
        if exception.local and not scope.local:
            message = f"exception `{named.name}` is local, so that no operation throws it to a caller"
            self._resolver.error(Code.LOCAL_TYPE, message, named.token)

    def bases(self, definition: ast.Definition, bases: Iterable[tuple[ast.Definition, Token]]) -> None:
        """Report bases that are local when the derived is not; except for exceptions, also the reverse."""
        for base, token in bases:
            if base.local == definition.local or (isinstance(base, ast.ExceptionType) and definition.local):
                continue
            which = "a local" if base.local else "no local"
            note = Note("the base is defined here", base.token.location)
            message = f"`{definition.name}` cannot extend {which} {base.kind} such as `{base.name}`"
            self._resolver.error(Code.LOCAL_TYPE, message, token, note)
