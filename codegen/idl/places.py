"""Where definitions go: which Python module of which package, and which modules need each other."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from . import ast
from .dependencies import named_elements, needed_at_import, needed_in_annotations
from .lexer import Source
from .names import exported_names, file_module, module_package


@dataclass(slots=True, eq=False)
class GeneratedModule:
    """A Python module: what one IDL file defines in one Slice module."""

    source: Source
    slice_module: str
    """The scoped name of the Slice module: `jderobot`."""
    doc: str | None = None
    """The raw doc comment of the Slice module in this file."""
    definitions: list[ast.Definition] = field(default_factory=list)
    name: str = ""

    @property
    def package(self) -> tuple[str, ...]:
        """The path of packages that it stands in."""
        return module_package(self.slice_module)


class NestedModules:
    """The modules in each Slice module, by whatever file: no Python module of a file takes their names."""

    def __init__(self, roots: Iterable[ast.Module]) -> None:
        self._names: defaultdict[str, set[str]] = defaultdict(set)
        for root in roots:
            for module, definition in _walk(root):
                if isinstance(definition, ast.Module):
                    self._names[module.scoped.removeprefix("::")].add(definition.name)

    def of(self, slice_module: str) -> set[str]:
        """Return the names of the modules in a module."""
        return self._names[slice_module]


class FileNames:
    """What the Python modules of files are named after, the same in all units that come together."""

    def __init__(self) -> None:
        self._paths: dict[tuple[Source, str], Path] = {}

    def path(self, module: GeneratedModule) -> Path | None:
        """Return the path that a module is named after, or None if that is open."""
        return self._paths.get((module.source, module.slice_module))

    def set_path(self, module: GeneratedModule, path: Path) -> None:
        """Name a module, and all others that its file makes in this Slice module, after a path."""
        self._paths[module.source, module.slice_module] = path


class Places:
    """The Python modules for everything that a translation unit defines.

    A file has one for each Slice module that it opens. Where these could not be imported, because of two
    modules each needs the other to be there first, a file has one for each time that it opens a module.
    """

    def __init__(self, root: ast.Module, nested: NestedModules, names: FileNames) -> None:
        self._nested = nested
        self._names = names
        self._late: dict[str, bool] = {}
        self._build(root, split=set())
        in_cycles = _Reach(self._edges(needed_at_import)).in_cycles()
        if in_cycles:
            self._build(root, split={module.source for module in in_cycles})
        self._at_import = _Reach(self._edges(needed_at_import, named_elements))
        self._in_all = _Reach(self._edges(needed_at_import, named_elements, needed_in_annotations))

    def of(self, definition: ast.Definition) -> GeneratedModule:
        """Return the module that a definition goes to."""
        return self._places[definition.scoped]

    def modules_of(self, source: Source) -> list[GeneratedModule]:
        """Return the modules that a file makes."""
        return [module for module in self._modules if module.source is source]

    def needed_packages(self, module: GeneratedModule) -> set[tuple[str, ...]]:
        """Return the packages of other modules that a module imports."""
        return {other.package for other in self._in_all.direct(module)} - {module.package}

    def need_each_other(self, one: GeneratedModule, other: GeneratedModule) -> bool:
        """Return whether each of two modules imports the other, at once or by way of more."""
        return self._in_all.leads(one, other) and self._in_all.leads(other, one)

    def is_late(self, definition: ast.Definition) -> bool:
        """Return whether a sequence or dictionary is of a class that can only be defined after it."""
        if definition.scoped not in self._late:
            here = self.of(definition)
            late = any(
                self._at_import.leads(self.of(element), here)
                for element in named_elements(definition)
                if self.of(element) is not here
            )
            self._late[definition.scoped] = late or any(
                self.is_late(element)
                for element in needed_at_import(definition)
                if isinstance(element, ast.Sequence | ast.Dictionary)
            )
        return self._late[definition.scoped]

    def _build(self, root: ast.Module, *, split: set[Source]) -> None:
        self._modules: list[GeneratedModule] = []
        self._places: dict[str, GeneratedModule] = {}
        opened: dict[tuple[Source, str], GeneratedModule] = {}
        current: GeneratedModule | None = None
        for module, definition in _walk(root):
            if not isinstance(definition, ast.Module | ast.ForwardDeclaration):
                key = (definition.token.source, definition.module)
                place = opened.get(key)
                if place is None or (key[0] in split and place is not current):
                    place = opened[key] = GeneratedModule(*key)
                    self._modules.append(place)
                current = place
                place.definitions.append(definition)
                place.doc = place.doc or module.doc
                self._places.setdefault(definition.scoped, place)
        self._name_modules()

    def _name_modules(self) -> None:
        numbers: defaultdict[tuple[Source, str], int] = defaultdict(int)
        owners: dict[tuple[str, str], Source] = {}
        # Those that another unit has named keep their names, so that all units import the same modules.
        for place in sorted(self._modules, key=lambda place: self._names.path(place) is None):
            taken = {name for definition in place.definitions for name in exported_names(definition)}
            taken |= self._nested.of(place.slice_module)
            own = place.source.path
            path = self._names.path(place)
            place.name = file_module(path or own, taken)
            owner = owners.setdefault((place.slice_module, place.name), place.source)
            if path is None and owner is not place.source:
                # A file of the same name in another directory is included before this one.
                path = own.with_stem(f"{own.parent.name}_{own.stem}")
                place.name = file_module(path, taken)
                owners.setdefault((place.slice_module, place.name), place.source)
            self._names.set_path(place, path or own)
            numbers[place.source, place.slice_module] += 1
            number = numbers[place.source, place.slice_module]
            if number > 1:
                place.name += f"_{number}"

    def _edges(
        self, *needed: Callable[[ast.Definition], Iterable[ast.Definition]]
    ) -> dict[GeneratedModule, list[GeneratedModule]]:
        """Return the other modules that each one needs."""
        edges: dict[GeneratedModule, list[GeneratedModule]] = {}
        for module in self._modules:
            others = {
                place: None  # a dict, as it keeps the order
                for definition in module.definitions
                for need in needed
                for other in need(definition)
                if (place := self._places.get(other.scoped)) is not None and place is not module
            }
            edges[module] = list(others)
        return edges


class _Reach:
    """What leads where in a graph of modules."""

    def __init__(self, edges: dict[GeneratedModule, list[GeneratedModule]]) -> None:
        self._edges = edges
        self._found: dict[GeneratedModule, set[GeneratedModule]] = {}

    def direct(self, module: GeneratedModule) -> list[GeneratedModule]:
        return self._edges[module]

    def leads(self, start: GeneratedModule, end: GeneratedModule) -> bool:
        if start not in self._found:
            found: set[GeneratedModule] = set()
            waiting = list(self._edges[start])
            while waiting:
                module = waiting.pop()
                if module not in found:
                    found.add(module)
                    waiting += self._edges[module]
            self._found[start] = found
        return end in self._found[start]

    def in_cycles(self) -> list[GeneratedModule]:
        return [module for module in self._edges if self.leads(module, module)]


def _walk(module: ast.Module) -> Iterator[tuple[ast.Module, ast.Definition]]:
    for definition in module.definitions:
        yield module, definition
        if isinstance(definition, ast.Module):
            yield from _walk(definition)
