"""The names of a translation unit: what is declared, and what a name means where it stands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, islice

from codegen.diagnostics import Note, did_you_mean

from . import ast

# Looking for near names is slow; a file with more wrong names than this needs no proposal for each.
_MOST_PROPOSALS = 30
_MOST_CANDIDATES = 3000


def enclosing_scopes(scope: str) -> Iterator[str]:
    """Yield `::a::b`, `::a` and the root's empty name for the scope `::a::b`."""
    while scope:
        yield scope
        scope = scope.rpartition("::")[0]
    yield ""


class Symbols:
    """Definitions by scoped name, and without regard to capitalization."""

    def __init__(self) -> None:
        self._by_name: dict[str, ast.Definition] = {}
        self._by_lower_case: dict[str, ast.Definition] = {}
        self._proposals = 0

    def get(self, scoped: str) -> ast.Definition | None:
        """Return the definition of exactly this scoped name."""
        return self._by_name.get(scoped)

    def get_any_case(self, scoped: str) -> ast.Definition | None:
        """Return the first definition whose scoped name differs from `scoped` at most in capitalization."""
        return self._by_lower_case.get(scoped.lower())

    def add(self, definition: ast.Definition) -> None:
        """Declare a definition under its scoped name; it takes the place of a declaration of it."""
        self._by_name[definition.scoped] = definition
        key = definition.scoped.lower()
        if isinstance(self._by_lower_case.get(key), ast.ForwardDeclaration):
            self._by_lower_case[key] = definition
        self._by_lower_case.setdefault(key, definition)

    def find(self, name: str, scope: str) -> ast.Definition | None:
        """Return what `name` means in `scope`: the definition of the innermost scope that has it."""
        if name.startswith("::"):
            return self._by_name.get(name)
        for outer in enclosing_scopes(scope):
            definition = self._by_name.get(f"{outer}::{name}")
            if definition is not None:
                return definition
        return None

    def find_any_case(self, name: str, scope: str) -> ast.Definition | None:
        """Return what `name` would mean if capitalization did not matter."""
        if name.startswith("::"):
            return self.get_any_case(name)
        for outer in enclosing_scopes(scope):
            definition = self.get_any_case(f"{outer}::{name}")
            if definition is not None:
                return definition
        return None

    def proposal(self, name: str, scope: str, also: Iterable[str] = ()) -> tuple[Note, ...]:
        """Return a note with the name, declared or one of `also`, that is nearest to an undefined one."""
        if self._proposals == _MOST_PROPOSALS:
            return ()
        self._proposals += 1
        return did_you_mean(name, islice(chain(also, self._spellings(scope)), _MOST_CANDIDATES))

    def _spellings(self, scope: str) -> Iterator[str]:
        """Yield every declared name the way it can be written in `scope`."""
        for scoped in self._by_name:
            for outer in enclosing_scopes(scope):
                if scoped.startswith(f"{outer}::"):
                    yield scoped.removeprefix(f"{outer}::")
                    break
