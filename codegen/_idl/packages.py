"""Assign definitions to Python modules, and generate their packages."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from codegen.files import GeneratedFile, read_regular

from ..python_layout import GENERATED_BY, docstring
from . import ast
from .doc_comments import parse_doc_comment
from .lexer import Source
from .names import Package, exported_names, file_module, module_package, relative_name
from .schema import SCHEMA_FILE, kept_entries, schema_entry, schema_text

_HEADER = re.compile(rf'"""(?:(.+?)\n\n)?{GENERATED_BY}(.+?)\. Do not edit', re.DOTALL)
_IMPORT = re.compile(r"^from (\.+)([\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)
_PART = re.compile(r"(_idl)?(_part\d+)?$")

ModuleKey = tuple[Source, str]
"""An IDL file, and the scoped name of a Slice module that it opens."""


@dataclass(slots=True, eq=False)
class GeneratedModule:
    """A Python module with the definitions of one IDL file in one Slice module."""

    source: Source
    slice_module: str
    """The scoped name of the Slice module: `jderobot`."""
    doc: str | None = None
    """The raw doc comment of the Slice module in this file."""
    definitions: list[ast.Definition] = field(default_factory=list)
    name: str = ""

    @property
    def package(self) -> Package:
        """The path of its packages."""
        return module_package(self.slice_module)

    @property
    def text(self) -> str:
        """The first paragraphs of its docstring, empty without a doc comment."""
        return parse_doc_comment(self.doc).text


def modules_of(trees: Mapping[Source, ast.Module | None]) -> dict[ModuleKey, GeneratedModule]:
    """Return the Python modules for the definitions of files; `trees` are those of their translation units.

    A file without a tree is generated as part of the first file that includes it. Two files with the same
    name in one unit become two modules; the name of the second one, in the order of includes, contains its
    directory.
    """
    nested: defaultdict[str, set[str]] = defaultdict(set)
    for around, definition in chain.from_iterable(tree.walk() for tree in trees.values() if tree is not None):
        if isinstance(definition, ast.Module):
            nested[around.scoped.removeprefix("::")].add(definition.name)
    modules: dict[ModuleKey, GeneratedModule] = {}
    for main, tree in trees.items():
        found = _modules_in(tree) if tree is not None else {}
        # Names from another unit are kept, so that all units import the same modules.
        used = {(modules[key].slice_module, modules[key].name) for key in found if key in modules}
        for key, module in found.items():
            if key in modules:
                module.name = modules[key].name
            else:
                taken = nested[module.slice_module].union(*map(exported_names, module.definitions))
                module.name = file_module(module.source.path, taken)
                if (module.slice_module, module.name) in used:
                    module.name = file_module(_with_directory(module.source.path), taken)
                used.add((module.slice_module, module.name))
            if key not in modules or module.source is main:
                modules[key] = module
    return modules


def _modules_in(tree: ast.Module) -> dict[ModuleKey, GeneratedModule]:
    """Return the modules for the definitions of a translation unit, without names."""
    found: dict[ModuleKey, GeneratedModule] = {}
    for around, definition in tree.walk():
        if not isinstance(definition, ast.Module | ast.ForwardDeclaration) and not _is_skipped(definition):
            key = definition.token.source, definition.module
            module = found.setdefault(key, GeneratedModule(*key))
            module.definitions.append(definition)
            module.doc = module.doc or around.doc
    return found


def _is_skipped(definition: ast.Definition) -> bool:
    """Return whether nothing is generated for a definition: it is local, or a constant of a local type."""
    return definition.local or (isinstance(definition, ast.Constant) and ast.is_local(definition.type))


def _with_directory(path: Path) -> Path:
    return path.with_stem(f"{path.parent.name}_{path.stem}")


# Packages


@dataclass(frozen=True, slots=True)
class ModuleSummary:
    """A module as it is listed in the `__init__.py` and the schema of its package."""

    name: str
    source: str
    """The name of the IDL file."""
    text: str
    """The first paragraphs of its docstring, empty without a doc comment."""
    entries: Mapping[str, dict[str, Any]] | None = None
    """Its entries in the schema, or None for an existing module, whose entries are kept."""

    @classmethod
    def of(cls, module: GeneratedModule) -> ModuleSummary:
        """Return the summary of a module of this run."""
        entries = {each.scoped: schema_entry(each, module.name) for each in module.definitions}
        return cls(module.name, module.source.path.name, module.text, entries)


def header(text: str, sources: Iterable[str]) -> list[str]:
    """Return the docstring of a generated file: its description and its sources."""
    made = f"{GENERATED_BY}{', '.join(sources)}. Do not edit: change the IDL and run codegen."
    return docstring(f"{text}\n\n{made}" if text else made)


def package_files(
    root: Path, slice_module: str, modules: Iterable[ModuleSummary], next_in_cycle: Package | None = None
) -> list[GeneratedFile]:
    """Return the files of a typed package that exports all definitions of its modules.

    Packages that depend on each other each import the `next_in_cycle` before their own modules: then all of
    them have begun when the first module is imported, and no module waits for a package that waits for it.
    """
    here = module_package(slice_module)
    directory = root.joinpath(*here)
    ordered = sorted(modules, key=lambda module: module.name)
    text = next((module.text for module in ordered if module.text), "")
    sources = sorted({module.source for module in ordered})
    imports = [] if next_in_cycle is None else [_import_of(next_in_cycle, here)]
    imports += [f"from .{module.name} import *  # noqa: F403" for module in ordered]
    lines = [*header(text, sources), *(["", *imports] if imports else [])]
    schema = directory / SCHEMA_FILE
    return [
        GeneratedFile(directory / "__init__.py", "\n".join(lines) + "\n"),
        GeneratedFile(directory / "py.typed", ""),
        GeneratedFile(schema, _schema(schema, ordered, sources)),
    ]


def _import_of(package: Package, here: Package) -> str:
    """Return the import of another package, under a name that is not exported."""
    *around, name = package
    return f"from {relative_name(here, tuple(around))} import {name} as _{'_'.join(package)}  # noqa: F401"


def _schema(path: Path, modules: list[ModuleSummary], sources: list[str]) -> str:
    """Return the schema of a package, with the old entries of modules that this run does not generate."""
    on_disk = {module.name for module in modules if module.entries is None}
    entries: dict[str, dict[str, Any]] = {}
    if on_disk and path.is_file():
        entries = kept_entries(path.read_text("utf-8", errors="replace"), on_disk)
    for module in modules:
        entries |= module.entries or {}
    return schema_text(f"{GENERATED_BY}{', '.join(sources)}. Do not edit: change the IDL.", entries)


class EarlierModules(NamedTuple):
    """The modules of earlier runs in a directory that this run does not generate."""

    kept: dict[Package, list[ModuleSummary]]
    """The modules that stay, by their package."""
    needs: dict[Package, set[Package]]
    """The packages that they import from, by their package."""
    leftovers: list[Path]
    """Files without a source, in packages of this run or in packages that become empty."""


def earlier_modules(
    root: Path,
    packages: Collection[Package],
    generated: Collection[Path],
    sources: Collection[Path],
    *,
    knows_all_sources: bool,
) -> EarlierModules:
    """Return the modules that earlier runs generated in the directory `root`.

    A leftover was generated from one of the `sources` of this run or, with `knows_all_sources`, from a file
    that is no longer in the directory. A module that is imported by another one that stays is not a leftover,
    since an included file can be in any directory.
    """
    modules: dict[Path, ModuleSummary] = {}
    imports: dict[Path, set[Path]] = {}
    inits = [init for init in sorted(root.glob("*/__init__.py")) if _HEADER.match(_text(init))]
    for path in (each for init in inits for each in sorted(init.parent.rglob("*.py"))):
        match = _HEADER.match(text := _text(path))
        if path.name == "__init__.py":
            continue
        imports[path] = _imports(path, text)
        if match and path not in generated:
            paragraphs = [" ".join(paragraph.split()) for paragraph in (match[1] or "").split("\n\n")]
            modules[path] = ModuleSummary(path.stem, match[2], "\n\n".join(paragraphs))
    gone = {
        path
        for path, summary in modules.items()
        if _was_made_from(summary, sources) or (knows_all_sources and not (root / summary.source).is_file())
    }
    stay = [path for path in imports if path not in gone]
    for path in stay:  # grows while it is read
        needed = imports[path] & gone
        gone -= needed
        stay += needed
    kept: defaultdict[Package, list[ModuleSummary]] = defaultdict(list)
    needs: defaultdict[Package, set[Package]] = defaultdict(set)
    left: defaultdict[Path, list[Path]] = defaultdict(list)
    for path, summary in modules.items():
        if path in gone:
            left[path.parent].append(path)
        else:
            package = path.parent.relative_to(root).parts
            kept[package].append(summary)
            needs[package] |= {
                each.parent.relative_to(root).parts for each in imports[path] if each.is_relative_to(root)
            }
    leftovers: list[Path] = []
    for directory, paths in left.items():
        package = directory.relative_to(root).parts
        if package in packages:
            leftovers += paths
        elif package not in kept:
            leftovers += [*paths, *(directory / name for name in ("__init__.py", "py.typed", SCHEMA_FILE))]
    return EarlierModules(kept, needs, leftovers)


def _imports(path: Path, text: str) -> set[Path]:
    """Return the generated modules that one imports; with a package, these are all modules in it."""
    found: set[Path] = set()
    for match in _IMPORT.finditer(text):
        module = path.parents[len(match[1]) - 1].joinpath(*filter(None, match[2].split(".")))
        if (file := module.with_suffix(".py")).is_file():
            found.add(file)
        else:
            for name in re.findall(r"\w+", match[3]):
                found |= set((module / name).glob("*.py"))
    return found


def _text(path: Path) -> str:
    try:
        return read_regular(path).decode(errors="replace").replace("\r\n", "\n")
    except OSError:  # what cannot be read was not generated by this run
        return ""


def _was_made_from(summary: ModuleSummary, sources: Iterable[Path]) -> bool:
    """Return whether a module was generated from one of the files, and not from a file of the same name."""
    names = {
        file_module(each, ())
        for path in sources
        if path.name == summary.source
        for each in (path, _with_directory(path))
    }
    return summary.name in names or _PART.sub("", summary.name) in names
