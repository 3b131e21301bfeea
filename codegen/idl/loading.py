"""Load interface files up to their checked trees, for whoever wants to know what they define."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.diagnostics import Diagnostics

from . import ast
from .lexer import Source
from .preprocessor import Preprocessor, SourceFiles
from .units import checked_tree

__all__ = ["CheckedFile", "definitions_of", "load_interfaces"]


@dataclass(frozen=True, slots=True)
class CheckedFile:
    """A file with what it and the files that it includes define."""

    path: Path
    source: Source
    included: tuple[Source, ...]
    tree: ast.Module


def load_interfaces(
    paths: Sequence[Path],
    include_directories: Sequence[Path],
    diagnostics: Diagnostics,
) -> list[CheckedFile]:
    """Read, parse and check files, each once, with all that they include.

    What is wrong goes to `diagnostics`; a file that cannot be read is left out.
    """
    files = SourceFiles(diagnostics)
    preprocessor = Preprocessor(files, include_directories, diagnostics)
    sources = {source: path for path in paths if (source := files.load(path)) is not None}
    loaded: list[CheckedFile] = []
    for source, path in sources.items():
        unit = preprocessor.unit(source)
        tree = checked_tree(unit, diagnostics)
        loaded.append(CheckedFile(path, source, tuple(unit.included), tree))
    return loaded


def definitions_of(files: Sequence[CheckedFile]) -> dict[str, ast.Definition]:
    """Return everything that files define, by scoped name in the order of the source, without modules."""
    found: dict[str, ast.Definition] = {}
    for file in files:
        for definition in _walk(file.tree):
            found.setdefault(definition.scoped, definition)
    return found


def _walk(module: ast.Module) -> Iterator[ast.Definition]:
    for definition in module.definitions:
        if isinstance(definition, ast.Module):
            yield from _walk(definition)
        elif not isinstance(definition, ast.ForwardDeclaration):
            yield definition
