"""Hold the translation units of a run: one for each file, whether it was given or is included only."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.diagnostics import Diagnostics

from . import ast
from .checker import check
from .lexer import Source
from .parser import parse
from .places import FileNames, NestedModules, Places
from .preprocessor import Preprocessor, SourceFiles, TranslationUnit


@dataclass(frozen=True, slots=True)
class Unit:
    """What one file says by itself, with all that it includes."""

    tree: ast.Module
    included: tuple[Source, ...]


class Units:
    """Read each file as the main file of a unit, once."""

    def __init__(self, files: SourceFiles, include_directories: Sequence[Path]) -> None:
        self._files = files
        self._include_directories = include_directories
        self._units: dict[Source, Unit | None] = {}

    def read(self, source: Source, diagnostics: Diagnostics) -> Unit | None:
        """Return the unit of a file, or None after reporting what is wrong with it."""
        if source not in self._units:
            errors_before = len(diagnostics.errors)
            preprocessor = Preprocessor(self._files, self._include_directories, diagnostics)
            read = preprocessor.unit(source)
            tree = checked_tree(read, diagnostics)
            sound = len(diagnostics.errors) == errors_before
            self._units[source] = Unit(tree, tuple(read.included)) if sound else None
        return self._units[source]

    def trees(self) -> Iterator[ast.Module]:
        """Yield what the units that were read define."""
        return (unit.tree for unit in self._units.values() if unit is not None)

    def with_included(self, given: Iterable[Source]) -> dict[Source, Unit | None]:
        """Return files and all that they include, each with its own unit, in an order of their own.

        The order depends on the files that it has alone, not on which of them were given: those that no
        other one includes come first. A file that is not sound without its includers has no unit.
        """
        found: dict[Source, Unit | None] = {}
        waiting = list(given)
        while waiting:
            source = waiting.pop()
            if source not in found:
                # Of the files given all is told by now; one that needs its includers may be wrong alone.
                unit = found[source] = self.read(source, Diagnostics())
                waiting += unit.included if unit is not None else ()
        included = {each for unit in found.values() if unit is not None for each in unit.included}
        order = sorted(found, key=lambda source: (source in included, source.path.resolve()))
        return {source: found[source] for source in order}


def checked_tree(unit: TranslationUnit, diagnostics: Diagnostics) -> ast.Module:
    """Return what a translation unit defines; what is wrong with it goes to `diagnostics`."""
    tree = parse(unit, diagnostics)
    if unit.complete:  # else every name of the file that is not found would seem undefined
        check(tree, diagnostics)
    return tree


def places_of(units: dict[Source, Unit | None], nested: NestedModules) -> dict[Source, Places]:
    """Return the places of each file in its own unit, or else in the first one that includes it."""
    names = FileNames()
    own = {source: Places(unit.tree, nested, names) for source, unit in units.items() if unit is not None}
    places: dict[Source, Places] = {}
    for source in units:
        if source in own:
            places[source] = own[source]
        else:
            includers = (each for each, unit in units.items() if unit is not None and source in unit.included)
            places[source] = own[next(includers)]
    return places
