"""The names of a translation unit: what is declared, and what a name means where it stands."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain, islice

from codegen.diagnostics import Note, did_you_mean

from . import ast
from .lexer import Token

# Looking for near names is slow; a file with more wrong names than this needs no proposal for each.
_MOST_PROPOSALS = 30
_MOST_CANDIDATES = 3000

Kinds = tuple[type[ast.Definition], ...]


@dataclass(frozen=True, slots=True)
class Introduction:
    """The first use or declaration of a name in a scope: what it means there from then on."""

    scoped: str
    kind: type[ast.Definition]
    token: Token


@dataclass(slots=True, eq=False)
class Scope:
    """A body of the source that names are looked up from; a module has one each time it is opened."""

    name: str = ""
    """The scoped name of what it is the body of: `::jderobot`; empty for the root."""
    local: bool = False
    introduced: dict[str, Introduction] = field(default_factory=dict)
    """By name in lower case."""


def enclosing_scopes(scope: str) -> Iterator[str]:
    """Yield `::a::b`, `::a` and the root's empty name for the scope `::a::b`."""
    while scope:
        yield scope
        scope = scope.rpartition("::")[0]
    yield ""


class Symbols:
    """Definitions by scoped name without regard to capitalization, as Slice allows only one of a spelling."""

    def __init__(self) -> None:
        self._by_lower_case: dict[str, ast.Definition] = {}
        self._enumerators: defaultdict[str, list[ast.Enumerator]] = defaultdict(list)
        self._expected: dict[str, ast.Definition] = {}
        self._proposals = 0

    def get(self, scoped: str) -> ast.Definition | None:
        """Return the first definition whose scoped name differs from `scoped` at most in capitalization."""
        return self._by_lower_case.get(scoped.lower())

    def add(self, definition: ast.Definition) -> None:
        """Declare a definition under its scoped name; it takes the place of a declaration of it."""
        key = definition.scoped.lower()
        if isinstance(self._by_lower_case.get(key), ast.ForwardDeclaration):
            self._by_lower_case[key] = definition
        self._by_lower_case.setdefault(key, definition)
        if isinstance(definition, ast.Enumerator):
            enumeration, _, name = key.rpartition("::")
            container = enumeration.rpartition("::")[0]
            self._enumerators[f"{container}::{name}"].append(definition)

    def candidates(self, name: str, scope: str) -> Iterator[tuple[ast.Definition, str]]:
        """Yield what `name` could mean in `scope`, the innermost first, and what it is called there."""
        for outer in ("",) if name.startswith("::") else enclosing_scopes(scope):
            expected = f"{outer}::{name.removeprefix('::')}"
            definition = self._by_lower_case.get(expected.lower())
            if definition is not None:
                yield definition, expected

    def find(self, name: str, scope: str) -> ast.Definition | None:
        """Return what `name` means in `scope`, whatever its capitalization."""
        return next((definition for definition, _ in self.candidates(name, scope)), None)

    def enumerators(self, name: str, scope: str) -> list[ast.Enumerator]:
        """Return the enumerators that `name` could mean when their enumeration is left out of it."""
        container, separator, last = name.rpartition("::")
        scopes = enclosing_scopes(scope)
        if separator:
            found = self.find(container, scope)
            scopes = iter([found.scoped] if found else [])
        for each in scopes:
            enumerators = self._enumerators.get(f"{each}::{last}".lower())
            if enumerators:
                return enumerators
        return []

    def expect(self, module: ast.Module) -> None:
        """Remember what a module will define, for those who use it too early."""
        for definition in module.definitions:
            self._expected.setdefault(definition.name, definition)
            if isinstance(definition, ast.Module):
                self.expect(definition)

    def help(self, name: str, scope: str, kinds: Kinds, also: Iterable[str] = ()) -> tuple[Note, ...]:
        """Return notes that help with an undefined name: it is defined later, or a near one was meant.

        Proposed are names of one of `kinds`, and those in `also`.
        """
        later = self._expected.get(name.rpartition("::")[2])
        if later is not None and not later.scoped and isinstance(later, kinds):
            return (Note("it is defined here, but must be before it is used", later.token.location),)
        if self._proposals == _MOST_PROPOSALS:
            return ()
        self._proposals += 1
        candidates = list(islice(chain(also, self._spellings(scope, kinds)), _MOST_CANDIDATES))
        last = name.rpartition("::")[2]
        elsewhere = [candidate for candidate in candidates if candidate.endswith(f"::{last}")]
        return did_you_mean(elsewhere[0] if elsewhere else name, candidates)

    def _spellings(self, scope: str, kinds: Kinds) -> Iterator[str]:
        """Yield every declared name of some kinds the way it can be written in `scope`."""
        for definition in self._by_lower_case.values():
            kind = definition.of if isinstance(definition, ast.ForwardDeclaration) else type(definition)
            if not issubclass(kind, kinds):
                continue
            for outer in enclosing_scopes(scope):
                if definition.scoped.startswith(f"{outer}::"):
                    yield definition.scoped.removeprefix(f"{outer}::")
                    break
