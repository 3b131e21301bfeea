"""Run all stages of the compiler: from the paths of IDL files to the text of generated packages."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

from codegen.diagnostics import Diagnostics, Location
from codegen.files import GeneratedFile, read_regular

from ..python_layout import GENERATED_BY
from . import ast
from .checker import check
from .dependencies import ModuleGraph, cycles
from .lexer import Source
from .names import Package, exported_names, module_package, slice_module
from .packages import GeneratedModule, ModuleSummary, earlier_modules, modules_of, package_files
from .parser import parse
from .preprocessor import Preprocessor
from .python_writer import write_module
from .report import Code, SourceReport, note_at
from .resolver import declared_kind


@dataclass(frozen=True, slots=True)
class Compilation:
    """The output of a run: files, and leftovers of earlier runs whose IDL file no longer exists."""

    files: tuple[GeneratedFile, ...] = ()
    leftovers: tuple[Path, ...] = ()


def compile_interfaces(
    paths: Sequence[Path], include_directories: Sequence[Path], output: Path | None, diagnostics: Diagnostics
) -> Compilation:
    """Compile IDL files and the files that they include.

    The packages, one for each Slice module, go to the directory `output`, by default next to the given files.
    Problems are reported to `diagnostics`; after an error the compilation is empty. Nothing is written.
    """
    units = Units(include_directories, diagnostics)
    sources = {source: path for path in paths if (source := units.load(path)) is not None}
    for source in sources:
        units.read(source, diagnostics)
    if diagnostics.errors:
        return Compilation()
    directories: dict[Path, Path] = {}
    given: defaultdict[Path, list[Source]] = defaultdict(list)
    for source, path in sorted(sources.items(), key=lambda each: each[1].resolve()):
        directory = output or path.parent
        given[directories.setdefault(directory.resolve(), directory)].append(source)
    made = [
        _generate(directory, units.with_included(each), diagnostics, knows_all_sources=output is None)
        for directory, each in given.items()
    ]
    files = [file for compilation in made for file in compilation.files]
    for file in files:
        _report_foreign_file(file.path, diagnostics)
    if diagnostics.has_errors:
        return Compilation()
    if output is not None:
        files += _package_root(output)
    return Compilation(tuple(files), tuple(path for compilation in made for path in compilation.leftovers))


def read_definitions(
    paths: Sequence[Path], include_directories: Sequence[Path], diagnostics: Diagnostics
) -> dict[str, ast.Definition]:
    """Return the definitions in IDL files and in those that they include, by scoped name.

    Problems are reported to `diagnostics`; after an error the result is incomplete.
    """
    units = Units(include_directories, diagnostics)
    sources = [source for path in paths if (source := units.load(path)) is not None]
    for source in sources:
        units.read(source, diagnostics)
    modules = modules_of(units.with_included(sources))
    return {each.scoped: each for module in modules.values() for each in module.definitions}


# Sources


@dataclass(frozen=True, slots=True)
class Unit:
    """A file with everything that it includes."""

    tree: ast.Module
    included: tuple[Source, ...]


class Units:
    """Read each file as the main file of a translation unit, once."""

    def __init__(self, include_directories: Sequence[Path], diagnostics: Diagnostics) -> None:
        self._preprocessor = Preprocessor(include_directories, diagnostics)
        self._units: dict[Source, Unit | None] = {}

    def load(self, path: Path) -> Source | None:
        """Return the source at `path`, or None after reporting an error."""
        return self._preprocessor.load(path)

    def read(self, source: Source, diagnostics: Diagnostics) -> Unit | None:
        """Return the unit of a file, or None after reporting errors."""
        if source not in self._units:
            errors_before = len(diagnostics.errors)
            read = self._preprocessor.preprocess(source, diagnostics)
            tree = parse(read.tokens, diagnostics)
            if read.complete:  # otherwise every name of a missing file would seem undefined
                check(tree, diagnostics)
            sound = len(diagnostics.errors) == errors_before
            if sound:
                _note_skipped(tree, source, diagnostics)
            self._units[source] = Unit(tree, tuple(read.included)) if sound else None
        return self._units[source]

    def with_included(self, given: Iterable[Source]) -> dict[Source, ast.Module | None]:
        """Return the trees of files and of everything that they include, each as a separate unit.

        The order is fixed and does not depend on which files were given: files that no other one includes
        come first. A file that has errors only as a separate unit has no tree.
        """
        found: dict[Source, Unit | None] = {}
        waiting = list(given)
        while waiting:
            source = waiting.pop()
            if source not in found:
                # The errors of given files have been reported; an included file may be invalid as a separate
                # unit.
                unit = found[source] = self.read(source, Diagnostics())
                waiting += unit.included if unit is not None else ()
        included = {each for unit in found.values() if unit is not None for each in unit.included}
        order = sorted(found, key=lambda source: (source in included, source.path.resolve()))
        return {source: unit.tree if (unit := found[source]) else None for source in order}


def _note_skipped(tree: ast.Module, source: Source, diagnostics: Diagnostics) -> None:
    """Note which definitions of a file are skipped; what it includes may be another's."""
    for _, definition in tree.walk():
        if definition.local and definition.token.source is source:
            kind = declared_kind(definition).kind
            message = f"local {kind} `{definition.name}` is skipped: it is never sent"
            SourceReport(diagnostics).note(Code.SKIPPED, message, definition.token)


# Packages


def _generate(
    root: Path,
    trees: Mapping[Source, ast.Module | None],
    diagnostics: Diagnostics,
    *,
    knows_all_sources: bool,
) -> Compilation:
    """Return the packages for the directory `root`, and the leftovers in it."""
    graph = ModuleGraph(modules_of(trees))
    files: list[GeneratedFile] = []
    paths: dict[Path, GeneratedModule] = {}
    packages: defaultdict[str, list[ModuleSummary]] = defaultdict(list)
    for module in graph.modules:
        path = root.joinpath(*module.package, f"{module.name}.py")
        other = paths.setdefault(path, module)
        if other is not module:
            message = f"{path} would be generated from this file and from {other.source.path}"
            note = note_at("rename one of the files, or compile them to different directories")
            where = Location(module.source.path)
            SourceReport(diagnostics).error(Code.NAME_CLASH_IN_OUTPUT, message, where, note)
        files.append(GeneratedFile(path, write_module(module, graph)))
        packages[module.slice_module].append(ModuleSummary.of(module))
        parts = module.slice_module.split("::")
        for length in range(1, len(parts)):
            packages.setdefault("::".join(parts[:length]), [])
    _report_redefinitions(graph.modules, diagnostics)
    earlier = earlier_modules(
        root,
        list(map(module_package, packages)),
        paths,
        [source.path for source in trees],
        knows_all_sources=knows_all_sources,
    )
    next_in_cycle = _next_in_cycles(graph, earlier.needs)
    for package in next_in_cycle:
        packages.setdefault(slice_module(package), [])
    for name, made in packages.items():
        package = module_package(name)
        kept = earlier.kept.get(package, [])
        files += package_files(root, name, [*made, *kept], next_in_cycle.get(package))
    return Compilation(tuple(files), tuple(earlier.leftovers))


def _report_redefinitions(modules: Iterable[GeneratedModule], diagnostics: Diagnostics) -> None:
    """Report names that are defined in two files which do not include each other."""
    defined: dict[tuple[str, ...], ast.Definition] = {}
    for module in modules:
        for definition in module.definitions:
            for name in exported_names(definition):
                first = defined.setdefault((*module.package, name), definition)
                if first.token.source is not definition.token.source:
                    note = note_at("first defined here", first.token)
                    message = f"`{definition.name}` is defined in two files"
                    SourceReport(diagnostics).error(Code.REDEFINITION, message, definition.token, note)


def _next_in_cycles(graph: ModuleGraph, earlier: Mapping[Package, Set[Package]]) -> dict[Package, Package]:
    """Return the packages that depend on each other, each with the next one of the same cycle.

    A package is directly before those in it: the packages around the next one have begun, too. `earlier` is
    what kept modules import.
    """
    needs = {package: set(needed) for package, needed in earlier.items()}
    for module in graph.modules:
        needs.setdefault(module.package, set()).update(each.package for each in graph.needed_by(module))
    for package, needed in needs.items():
        # Python imports the packages around a package first.
        needed |= {package[:length] for length in range(1, len(package))}
        needed.discard(package)
    following: dict[Package, Package] = {}
    for package, cycle in cycles(needs).items():
        if package not in following:
            ordered = sorted(cycle)
            following |= zip(ordered, [*ordered[1:], ordered[0]], strict=True)
    return following


def _report_foreign_file(path: Path, diagnostics: Diagnostics) -> None:
    """Report an existing file that codegen did not generate and would overwrite."""
    try:
        text = read_regular(path).decode(errors="replace")
    except OSError:  # absent, or reported when it is compared with the generated file
        return
    if text.strip() and GENERATED_BY not in text:
        message = f"{path} was not generated by codegen and is not overwritten"
        note = note_at("move it, or write to another directory with -o")
        SourceReport(diagnostics).error(Code.FOREIGN_FILE, message, Location(path), note)


def _package_root(output: Path) -> tuple[GeneratedFile, ...]:
    """Return the missing files that make the output directory a typed package.

    One that is called `interfaces` stays a namespace package, as it would hide ours.
    """
    wanted = [
        GeneratedFile(output / "__init__.py", '"""Packages generated by codegen from Slice."""\n'),
        GeneratedFile(output / "py.typed", ""),
    ]
    if output.resolve().name == "interfaces":
        return ()
    return tuple(file for file in wanted if not file.path.exists())
