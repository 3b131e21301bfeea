"""Lead IDL files through all stages: from paths to the text of generated packages."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.diagnostics import Diagnostics, Location, Note
from codegen.files import GeneratedFile

from . import ast
from .codes import Code
from .lexer import Source
from .loading import Unit, Units
from .names import exported_names, module_package
from .packages import (
    GENERATED_BY,
    EarlierModules,
    GeneratedModule,
    ModuleSummary,
    NestedModules,
    Places,
    package_files,
    report_cycles,
)
from .python_writer import write_module
from .schema import schema_entry


@dataclass(frozen=True, slots=True)
class Compilation:
    """What a run makes: files, and the leftovers of earlier runs that no IDL file accounts for any more."""

    files: tuple[GeneratedFile, ...] = ()
    leftovers: tuple[Path, ...] = ()


@dataclass(slots=True)
class _Root:
    """A directory that generated packages go to."""

    directory: Path
    knows_all_sources: bool
    """Whether every IDL file of its packages lies in it, so that a module without its file is a leftover."""
    sources: dict[Source, Places]
    """The files, each with the places of its translation unit."""

    def modules(self) -> Iterator[tuple[GeneratedModule, Places]]:
        """Yield all modules."""
        for source, places in self.sources.items():
            for module in places.modules_of(source):
                yield module, places

    def path(self, module: GeneratedModule) -> Path:
        return self.directory.joinpath(*module.package, f"{module.name}.py")


def compile_interfaces(
    paths: Sequence[Path],
    include_directories: Sequence[Path],
    output: Path | None,
    diagnostics: Diagnostics,
) -> Compilation:
    """Compile IDL files and all that they include.

    The packages, one for each Slice module, go to the directory `output`, or else beside the files that were
    given. What is wrong goes to `diagnostics`; after an error the compilation is empty. Nothing is written.
    """
    units = Units(include_directories, diagnostics)
    sources = {source: path for path in paths if (source := units.load(path)) is not None}
    for source in sources:
        units.read(source, diagnostics)
    if diagnostics.has_errors:
        return Compilation()
    directories: dict[Path, Path] = {}
    given: defaultdict[Path, list[Source]] = defaultdict(list)
    for source, path in sorted(sources.items(), key=lambda each: each[1].resolve()):
        directory = output or path.parent
        given[directories.setdefault(directory.resolve(), directory)].append(source)
    with_included = {directory: units.with_included(each) for directory, each in given.items()}
    nested = NestedModules(units.trees())
    roots = [
        _Root(directory, output is None, _places_of(each, nested))
        for directory, each in with_included.items()
    ]
    return _generate_all(roots, output, diagnostics)


def _places_of(units: dict[Source, Unit | None], nested: NestedModules) -> dict[Source, Places]:
    """Return the places of each file in its own unit, or else in the first one that includes it."""
    names: dict[tuple[Source, str], Path] = {}
    own = {source: Places(unit.tree, nested, names) for source, unit in units.items() if unit is not None}
    places: dict[Source, Places] = {}
    for source in units:
        if source in own:
            places[source] = own[source]
        else:
            includers = (each for each, unit in units.items() if unit is not None and source in unit.included)
            places[source] = own[next(includers)]
    return places


def _generate_all(roots: Sequence[_Root], output: Path | None, diagnostics: Diagnostics) -> Compilation:
    for root in roots:
        _report_clashes(root, diagnostics)
        report_cycles(root.modules(), diagnostics)
    # Modules in a cycle have no order in which they could be written.
    compilations = [] if diagnostics.has_errors else [_generate(root) for root in roots]
    generated = [file for compilation in compilations for file in compilation.files]
    for file in generated:
        _report_foreign_file(file.path, diagnostics)
    if diagnostics.has_errors:
        return Compilation()
    if output is not None:
        generated += _package_root(output)
    leftovers = [path for compilation in compilations for path in compilation.leftovers]
    return Compilation(tuple(generated), tuple(leftovers))


def _report_clashes(root: _Root, diagnostics: Diagnostics) -> None:
    """Report names that files which do not include each other define twice, and modules of one path."""
    defined: dict[tuple[str, ...], ast.Definition] = {}
    paths: dict[Path, GeneratedModule] = {}
    for module, _ in root.modules():
        path = root.path(module)
        other = paths.setdefault(path, module)
        if other is not module:
            message = f"{path} would be made from this file and from {other.source.path}"
            note = Note("rename one of the files, or compile them to different directories")
            diagnostics.error(Code.NAME_CLASH_IN_OUTPUT, message, Location(module.source.path), [note])
        for definition in module.definitions:
            for name in exported_names(definition):
                first = defined.setdefault((*module.package, name), definition)
                same = first.token.source is definition.token.source
                if first is not definition and not same:
                    note = Note("first defined here", first.token.location)
                    message = f"`{definition.name}` is defined in two files"
                    diagnostics.error(Code.REDEFINITION, message, definition.token.location, [note])


def _generate(root: _Root) -> Compilation:
    files: list[GeneratedFile] = []
    summaries: defaultdict[str, list[ModuleSummary]] = defaultdict(list)
    for module, places in root.modules():
        files.append(GeneratedFile(root.path(module), write_module(module, places)))
        entries = {each.scoped: schema_entry(each, module.name) for each in module.definitions}
        summary = ModuleSummary(module.name, module.source.path.name, module.text, entries)
        summaries[module.slice_module].append(summary)
        parts = module.slice_module.split("::")
        for length in range(1, len(parts)):
            summaries.setdefault("::".join(parts[:length]), [])
    packages = {name: root.directory.joinpath(*module_package(name)) for name in summaries}
    earlier = EarlierModules(
        root.directory,
        packages.values(),
        {file.path for file in files},
        [source.path for source in root.sources],
        knows_all_sources=root.knows_all_sources,
    )
    for name, modules in summaries.items():
        files += package_files(packages[name], name, [*modules, *earlier.kept(packages[name])])
    return Compilation(tuple(files), tuple(earlier.leftovers))


def _report_foreign_file(path: Path, diagnostics: Diagnostics) -> None:
    """Report a file that stands where a generated one belongs but was written by someone else."""
    try:
        text = path.read_text("utf-8", errors="replace")
    except OSError:  # absent, or reported when it is compared with what was generated
        return
    if text.strip() and GENERATED_BY not in text:
        message = f"{path} was not made by codegen and is not overwritten"
        note = Note("move it away, or write to another directory with -o")
        diagnostics.error(Code.FOREIGN_FILE, message, Location(path), [note])


def _package_root(output: Path) -> tuple[GeneratedFile, ...]:
    """Return what makes the output directory a typed package, as far as it is not one."""
    wanted = [
        GeneratedFile(output / "__init__.py", '"""Packages generated by codegen from Slice."""\n'),
        GeneratedFile(output / "py.typed", ""),
    ]
    return tuple(file for file in wanted if not file.path.exists())
