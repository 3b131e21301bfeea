"""Write the `__init__.py` of generated packages, and read what is in them."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codegen.files import GeneratedFile

from .layout import INDENT, LINE_LENGTH, bracketed, docstring, source_order
from .schema import SCHEMA_FILE, kept_entries, schema_text
from .writer import GENERATED_BY, default_module_text, header


@dataclass(frozen=True, slots=True)
class ModuleSummary:
    """What a package must know of one of its modules."""

    name: str
    source: str
    """Name of the IDL file."""
    text: str
    """First paragraphs of its docstring."""
    exported: tuple[str, ...]
    needs: frozenset[tuple[str, ...]]
    """Paths of the packages that it imports from, its own apart."""
    entries: Mapping[str, dict[str, Any]] | None = None
    """What the schema says of it; None for a module on disk, whose entries are kept."""
    imports: frozenset[tuple[str, ...]] = frozenset()
    """Of a module on disk: paths of all that it imports from generated packages."""


def packages_in_cycles(needed: Mapping[tuple[str, ...], Iterable[tuple[str, ...]]]) -> set[tuple[str, ...]]:
    """Return the packages that need themselves by way of others; `needed` is what each one needs."""

    def reachable(start: tuple[str, ...]) -> set[tuple[str, ...]]:
        found: set[tuple[str, ...]] = set()
        waiting = [start]
        while waiting:
            for package in needed.get(waiting.pop(), ()):
                # Before a package those around it are imported.
                around = {package[:length] for length in range(1, len(package) + 1)}
                waiting += around - found
                found |= around
        return found

    return {package for package in needed if package in reachable(package)}


def package_files(
    directory: Path, slice_module: str, modules: Iterable[ModuleSummary], *, lazy: bool = False
) -> list[GeneratedFile]:
    """Return the files that make a directory a typed package which offers all that its modules define.

    A `lazy` one imports a module only when a name of it is asked for, so that packages can need each other.
    """
    ordered = sorted(modules, key=lambda module: module.name)
    default = default_module_text(slice_module)
    text = next((module.text for module in ordered if module.text != default), default)
    sources = sorted({module.source for module in ordered})
    imports: list[str] = []
    module_of: dict[str, str] = {}
    for module in ordered:
        names = source_order(module.exported)
        line = f"from .{module.name} import {', '.join(names)}"
        if len(line) > LINE_LENGTH:
            imports += [f"from .{module.name} import (", *(f"{INDENT}{name}," for name in names), ")"]
        elif names:
            imports.append(line)
        module_of |= dict.fromkeys(names, module.name)
    exported = source_order(module_of)
    every = bracketed("__all__ = [", [f'"{name}"' for name in exported], "]")
    if lazy:
        pairs = [f'"{name}": "{module_of[name]}"' for name in exported]
        body = _lazy_imports(imports, every, bracketed("_MODULES = {", pairs, "}"))
    else:
        body = [*([*imports, ""] if imports else []), *every]
    lines = [
        *docstring(header(text, *map(Path, sources))),
        "",
        "from __future__ import annotations",
        "",
        *body,
    ]
    return [
        GeneratedFile(directory / "__init__.py", "\n".join(lines) + "\n"),
        GeneratedFile(directory / "py.typed", ""),
        GeneratedFile(directory / SCHEMA_FILE, _schema(directory / SCHEMA_FILE, ordered, sources)),
    ]


def _schema(path: Path, modules: list[ModuleSummary], sources: list[str]) -> str:
    """Return the schema of a package; of modules that were not made anew it says what it said before."""
    on_disk = {module.name for module in modules if module.entries is None}
    entries: dict[str, dict[str, Any]] = {}
    if on_disk and path.is_file():
        entries = kept_entries(path.read_text("utf-8", errors="replace"), on_disk)
    for module in modules:
        entries |= module.entries or {}
    return schema_text(f"{GENERATED_BY}{', '.join(sources)}. Do not edit: change the IDL.", entries)


def _lazy_imports(imports: list[str], every: list[str], modules: list[str]) -> list[str]:
    return [
        "from importlib import import_module",
        "from typing import TYPE_CHECKING",
        "",
        "if TYPE_CHECKING:",
        *(INDENT + line for line in imports),
        "",
        *every,
        "",
        "# These packages need each other: a module is imported when one of its names is first asked for.",
        *modules,
        "",
        "if not TYPE_CHECKING:",
        "",
        f"{INDENT}def __getattr__(name):",
        f"{INDENT * 2}if name not in _MODULES:",
        f'{INDENT * 3}raise AttributeError(f"module {{__name__!r}} has no attribute {{name!r}}")',
        f'{INDENT * 2}value = getattr(import_module(f".{{_MODULES[name]}}", __name__), name)',
        f"{INDENT * 2}globals()[name] = value",
        f"{INDENT * 2}return value",
    ]


def read_summary(path: Path, package: tuple[str, ...]) -> ModuleSummary | None:
    """Return the summary of a generated module on disk, or None for a file that codegen did not make."""
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return None
    doc = ast.get_docstring(tree) or ""
    text, mark, made_from = doc.rpartition(GENERATED_BY)
    if not mark:
        return None
    exported: list[str] = []
    for statement in tree.body:
        if isinstance(statement, ast.Assign) and isinstance(statement.value, ast.List):
            names = [target.id for target in statement.targets if isinstance(target, ast.Name)]
            if names == ["__all__"]:
                exported = [e.value for e in statement.value.elts if isinstance(e, ast.Constant)]  # type: ignore[misc]
    paragraphs = [" ".join(paragraph.split()) for paragraph in text.strip().split("\n\n")]
    source = made_from.partition(". Do not edit")[0]
    needs = frozenset(_imported_packages(tree, package))
    return ModuleSummary(
        path.stem,
        source,
        "\n\n".join(paragraphs),
        tuple(exported),
        needs,
        imports=frozenset(_imported_names(tree, package)),
    )


def _imported_names(tree: ast.Module, package: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Yield the paths of modules that a module of `package` imports from, and of what it imports there."""
    for statement in tree.body:
        if isinstance(statement, ast.ImportFrom) and statement.level > 0:
            root = package[: len(package) - statement.level + 1]
            origin = (*root, *(statement.module.split(".") if statement.module else ()))
            yield origin
            yield from ((*origin, alias.name) for alias in statement.names)


def _imported_packages(tree: ast.Module, package: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Yield the packages that a module of `package` imports from, and their modules, which does no harm."""
    for statement in tree.body:
        if isinstance(statement, ast.ImportFrom) and statement.level > 1:
            root = package[: len(package) - statement.level + 1]
            parts = (*root, *(statement.module or "").split("."))
            yield from (parts[:length] for length in range(1, len(parts) + 1))
