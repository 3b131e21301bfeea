"""Make names known in their scope, and report a name that something else has."""

from __future__ import annotations

from codegen.diagnostics import Note

from . import ast
from .codes import Code
from .metadata_rules import check_metadata
from .resolver import Resolver, declared_kind, with_article
from .symbols import Scope

_FOLLOWABLE = (ast.Interface, ast.Class)


class Declarer:
    """Declares definitions one after the other, as they stand in the source."""

    def __init__(self, resolver: Resolver) -> None:
        self._resolver = resolver

    def declare(self, definition: ast.Definition, scope: Scope) -> bool:
        """Declare what a module or the root holds; return whether it has its name to itself."""
        self._set_scoped(definition, scope)
        if not scope.name and not isinstance(definition, ast.Module):
            message = f"{with_article(declared_kind(definition).kind)} can be defined only inside a module"
            self._resolver.error(Code.OUTSIDE_MODULE, message, definition.token)
        before = self._resolver.symbols.get(definition.scoped)
        if before is not None and not self._may_follow(definition, before):
            return False
        self._differs_from_modules_around(definition, scope)
        if before is None or not isinstance(definition, ast.ForwardDeclaration):
            self._resolver.symbols.add(definition)
        return True

    def declare_inside(self, definition: ast.Definition, scope: Scope) -> bool:
        """Declare a member, an operation, a parameter or an enumerator; return whether its name is new."""
        self._set_scoped(definition, scope)
        before = self._resolver.symbols.get(definition.scoped)
        if before is not None:
            self._taken(definition, before)
            return False
        self._resolver.symbols.add(definition)
        return True

    def inherited(self, definition: ast.Definition, inherited: dict[str, ast.Definition]) -> None:
        """Report a member or operation whose name comes from a base; `inherited` is by lower case."""
        base = inherited.get(definition.name.lower())
        if base is None:
            return
        note = Note("first defined here", base.token.location)
        if base.name == definition.name:
            message = f"{definition.kind} `{definition.name}` is inherited already"
            self._resolver.error(Code.REDEFINITION, message, definition.token, note)
        else:
            message = (
                f"{definition.kind} `{definition.name}` differs only in capitalization "
                f"from the inherited `{base.name}`"
            )
            self._resolver.error(Code.CAPITALIZATION, message, definition.token, note)

    def _set_scoped(self, definition: ast.Definition, scope: Scope) -> None:
        definition.scoped = f"{scope.name}::{definition.name}"
        check_metadata(definition, self._resolver)

    def _may_follow(self, definition: ast.Definition, before: ast.Definition) -> bool:
        """Return whether a second definition of a name only continues the first; report it if not."""
        if isinstance(definition, ast.Module) and isinstance(before, ast.Module):
            if before.name == definition.name:
                return True
        elif declared_kind(definition) in _FOLLOWABLE and declared_kind(before) in _FOLLOWABLE:
            if declared_kind(definition) is not declared_kind(before) or definition.local != before.local:
                return self._different_kind(definition, before)
            if ast.ForwardDeclaration in {type(definition), type(before)}:
                if before.name != definition.name:
                    note = Note("first declared here", before.token.location)
                    message = f"`{definition.name}` differs only in capitalization from `{before.name}`"
                    self._resolver.warning(Code.DOUBTFUL_CAPITALIZATION, message, definition.token, note)
                return True
        self._taken(definition, before)
        return False

    def _different_kind(self, definition: ast.Definition, before: ast.Definition) -> bool:
        note = Note("first declared here", before.token.location)
        first = f"{'local ' if before.local else ''}{declared_kind(before).kind}"
        message = f"`{definition.name}` was declared as {with_article(first)}"
        self._resolver.error(Code.REDEFINITION, message, definition.token, note)
        return False

    def _taken(self, definition: ast.Definition, before: ast.Definition) -> None:
        kind = declared_kind(before).kind
        note = Note(f"first defined here, as {with_article(kind)}", before.token.location)
        if before.name == definition.name:
            message = f"{declared_kind(definition).kind} `{definition.name}` is defined again"
            self._resolver.error(Code.REDEFINITION, message, definition.token, note)
        else:
            message = (
                f"{declared_kind(definition).kind} `{definition.name}` differs only in capitalization "
                f"from `{before.name}`"
            )
            self._resolver.error(Code.CAPITALIZATION, message, definition.token, note)

    def _differs_from_modules_around(self, definition: ast.Definition, scope: Scope) -> None:
        for module in scope.name.split("::"):
            if module.lower() == definition.name.lower():
                what = declared_kind(definition).kind
                message = f"{what} `{definition.name}` has the name of a module around it"
                self._resolver.error(Code.REDEFINITION, message, definition.token)
                return
