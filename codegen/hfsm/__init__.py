"""Compile automaton documents (`*.xml`) into components that run on `hfsm_runtime`.

The way of a document: `reader` makes a `document.Document` of the file, `program` analyzes its code after
`checks` has looked at its structure, `generator` writes the component down. `writer` saves a document.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from ..diagnostics import Diagnostics, Location
from ..files import GeneratedFile
from .generator import GENERATED_BY, generate
from .known_interfaces import find_interfaces
from .names import identifier
from .reader import parse_document, read_document
from .understanding import understand
from .writer import DocumentNotWritableError, write_document

__all__ = [
    "DocumentNotWritableError",
    "compile_document",
    "parse_document",
    "read_document",
    "write_document",
]

_HEAD: Final = 4000
"""Characters of a file in which a component says what it was generated from."""


def compile_document(
    path: Path, output: Path | None, diagnostics: Diagnostics, include: Sequence[Path] = ()
) -> list[GeneratedFile] | None:
    """Return the component of a document as a file, or None after errors were reported.

    `output` is the directory of the file, by default that of the document. `include` are directories with
    packages of proxies beside the package `interfaces`. Nothing is written.
    """
    document = read_document(path, diagnostics)
    if document is None:
        return None
    program = understand(document, path, find_interfaces(include), diagnostics)
    if program is None:
        return None
    target = (output or path.parent) / f"{identifier(path.stem, 'component')}.py"
    try:
        if target.is_file() and not _is_generated(target):
            message = f"{target.name} was not made by codegen: move it away, or rename the document"
            diagnostics.error("E540", message, Location(path))
            return None
    except OSError as error:
        diagnostics.error("E500", f"{target} cannot be read: {error.strerror or error}", Location(path))
        return None
    return [GeneratedFile(target, generate(program))]


def _is_generated(file: Path) -> bool:
    with file.open(encoding="utf-8", errors="replace") as text:
        return GENERATED_BY in text.read(_HEAD)
