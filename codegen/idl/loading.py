"""Lead interface files as far as their checked trees, each once, whether it was given or is included only."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.diagnostics import Diagnostics

from . import ast
from .checker import check
from .lexer import Source
from .parser import parse
from .preprocessor import Preprocessor

__all__ = ["Unit", "Units"]


@dataclass(frozen=True, slots=True)
class Unit:
    """What one file says by itself, with all that it includes."""

    tree: ast.Module
    included: tuple[Source, ...]


class Units:
    """Read each file as the main file of a translation unit, once."""

    def __init__(self, include_directories: Sequence[Path], diagnostics: Diagnostics) -> None:
        self._preprocessor = Preprocessor(include_directories, diagnostics)
        self._units: dict[Source, Unit | None] = {}

    def load(self, path: Path) -> Source | None:
        """Return the source at `path`, or None after reporting why it cannot be read."""
        return self._preprocessor.load(path)

    def read(self, source: Source, diagnostics: Diagnostics) -> Unit | None:
        """Return the unit of a file, or None after reporting what is wrong with it."""
        if source not in self._units:
            errors_before = len(diagnostics.errors)
            read = self._preprocessor.unit(source, diagnostics)
            tree = parse(read, diagnostics)
            if read.complete:  # else every name of the file that is not found would seem undefined
                check(tree, diagnostics)
            sound = len(diagnostics.errors) == errors_before
            self._units[source] = Unit(tree, tuple(read.included)) if sound else None
        return self._units[source]

    def trees(self) -> Iterator[ast.Module]:
        """Yield what the units that were read define."""
        return (unit.tree for unit in self._units.values() if unit is not None)

    def with_included(self, given: Iterable[Source]) -> dict[Source, Unit | None]:
        """Return files and all that they include, each with its own unit, in a fixed order.

        The order depends on the files that it has alone, not on which of them were given: those that no
        other one includes come first. A file that is not sound without its includers has no unit.
        """
        found: dict[Source, Unit | None] = {}
        waiting = list(given)
        while waiting:
            source = waiting.pop()
            if source not in found:
                # The files given have been reported on; one that needs its includers may be wrong alone.
                unit = found[source] = self.read(source, Diagnostics())
                waiting += unit.included if unit is not None else ()
        included = {each for unit in found.values() if unit is not None for each in unit.included}
        order = sorted(found, key=lambda source: (source in included, source.path.resolve()))
        return {source: found[source] for source in order}
