"""Lead interface files as far as their checked trees, each once, whether it was given or is included only."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.diagnostics import Diagnostics, did_you_mean

from . import ast
from .checker import check
from .lexer import Source
from .parser import parse
from .preprocessor import Preprocessor, SourceFiles

__all__ = ["Unit", "Units", "UnknownNameError", "find_definition", "load_definitions"]


@dataclass(frozen=True, slots=True)
class Unit:
    """What one file says by itself, with all that it includes."""

    tree: ast.Module
    included: tuple[Source, ...]


class Units:
    """Read each file as the main file of a translation unit, once."""

    def __init__(self, files: SourceFiles, include_directories: Sequence[Path]) -> None:
        self._preprocessor = Preprocessor(files, include_directories)
        self._units: dict[Source, Unit | None] = {}

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


def load_definitions(
    paths: Sequence[Path], include_directories: Sequence[Path], diagnostics: Diagnostics
) -> dict[str, ast.Definition]:
    """Return everything that files and what they include define, by scoped name, without modules.

    The order is that of the source. What is wrong goes to `diagnostics`; a file with an error is left out.
    """
    files = SourceFiles(diagnostics)
    units = Units(files, include_directories)
    found: dict[str, ast.Definition] = {}
    for path in paths:
        source = files.load(path)
        unit = units.read(source, diagnostics) if source is not None else None
        for definition in _walk(unit.tree) if unit is not None else ():
            found.setdefault(definition.scoped, definition)
    return found


def _walk(module: ast.Module) -> Iterator[ast.Definition]:
    for definition in module.definitions:
        if isinstance(definition, ast.Module):
            yield from _walk(definition)
        elif not isinstance(definition, ast.ForwardDeclaration):
            yield definition


class UnknownNameError(Exception):
    """No definition has the name, or several have."""


def find_definition(name: str, definitions: Mapping[str, ast.Definition]) -> ast.Definition:
    """Return a definition or an operation by its scoped name or the end of it: `nao::HeadPose`, `HeadPose`.

    An operation, own or inherited, is named with its interface: `PoseHead::getPose`. Dots stand for colons.
    Raises UnknownNameError.
    """
    wanted = "::" + name.replace(".", "::").removeprefix("::")
    found = _matches(wanted, definitions)
    if not found:
        owner, _, member = wanted.rpartition("::")
        interfaces = [each for each in _matches(owner, definitions) if isinstance(each, ast.Interface)]
        found = [each for interface in interfaces for each in _operations(interface) if each.name == member]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(each.scoped for each in found)
        raise UnknownNameError(f"`{name}` may be {names}: write more of the name")
    known = [scoped.removeprefix("::") for scoped in definitions]
    notes = did_you_mean(name, [*known, *(each.rpartition("::")[2] for each in known)])
    hint = f": {notes[0].message}" if notes else ""
    raise UnknownNameError(f"no file defines `{name}`{hint}")


def _matches(wanted: str, definitions: Mapping[str, ast.Definition]) -> list[ast.Definition]:
    exact = definitions.get(wanted)
    if exact is not None:
        return [exact]
    return [definition for scoped, definition in definitions.items() if scoped.endswith(wanted)]


def _operations(interface: ast.Interface) -> list[ast.Operation]:
    found = {each.name: each for base in interface.ancestors() for each in base.operations}
    return list({**found, **{each.name: each for each in interface.operations}}.values())
