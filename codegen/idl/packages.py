"""Write the `__init__.py` of generated packages, and find what earlier runs left behind."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from codegen.files import GeneratedFile

from .layout import INDENT, LINE_LENGTH, bracketed, docstring, source_order
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


def package_files(
    directory: Path, slice_module: str, modules: Iterable[ModuleSummary]
) -> list[GeneratedFile]:
    """Return the files that make a directory a typed package which offers all that its modules define."""
    ordered = sorted(modules, key=lambda module: module.name)
    default = default_module_text(slice_module)
    text = next((module.text for module in ordered if module.text != default), default)
    sources = sorted({module.source for module in ordered})
    imports: list[str] = []
    exported: list[str] = []
    for module in ordered:
        names = source_order(module.exported)
        line = f"from .{module.name} import {', '.join(names)}"
        if len(line) > LINE_LENGTH:
            imports += [f"from .{module.name} import (", *(f"{INDENT}{name}," for name in names), ")"]
        elif names:
            imports.append(line)
        exported += names
    lines = [
        *docstring(header(text, *map(Path, sources))),
        "",
        "from __future__ import annotations",
        "",
        *([*imports, ""] if imports else []),
        *bracketed("__all__ = [", [f'"{name}"' for name in source_order(exported)], "]"),
    ]
    return [
        GeneratedFile(directory / "__init__.py", "\n".join(lines) + "\n"),
        GeneratedFile(directory / "py.typed", ""),
    ]


def read_summary(path: Path) -> ModuleSummary | None:
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
    return ModuleSummary(path.stem, source, "\n\n".join(paragraphs), tuple(exported))
