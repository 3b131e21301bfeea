"""Compile automaton documents (`*.xml`) into components that run on `hfsm_runtime`.

The way of a document, as `loading` goes it: `formats` makes a `document.Document` of the file, `imports`
brings in what lies in other files (`merging` joins what they declare), `extension` finds the hand-written
code beside it and `known_interfaces` the proxies, and `generation` makes a `program.Program` of it after
`checks` has looked at its structure, and writes the component down. `code` knows the Python in a document.
`checking` checks a document and, with `model_checker`, what its automata can do, without generating
anything. `scxml` exchanges documents with other programs.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from ..diagnostics import Diagnostics, Location, Severity
from ..files import GeneratedFile
from .extension import extension_path
from .formats.reader import parse_document, read_document
from .formats.writer import DocumentNotWritableError, write_document
from .generation.generator import GENERATED_BY
from .imports import resolve
from .loading import component_path, load_document

__all__ = [
    "DocumentNotWritableError",
    "compile_document",
    "component_path",
    "extension_path",
    "parse_document",
    "read_document",
    "resolve",
    "write_document",
]

_HEAD: Final = 4000
"""Characters of a file in which a component says what it was generated from."""


def compile_document(
    path: Path,
    output: Path | None,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    with_properties: bool = False,
) -> list[GeneratedFile] | None:
    """Return the component of a document as a file, or None after errors were reported.

    `output` is the directory of the file, by default that of the document. `include` are directories with
    packages of proxies beside the package `interfaces`. `with_properties` makes an error of each property
    that is seen at once to be violated. Errors and warnings are reported, without notes. Nothing is written.
    """
    found = Diagnostics()
    loaded = load_document(path, output, found, include)
    if loaded is not None and with_properties and loaded.document.properties:
        from .checking import report_violations  # the model checker takes its time to load

        report_violations(loaded.document, path, found)
    diagnostics.add_all(found, leave_out=[Severity.NOTE])
    if loaded is None or found.has_errors:
        return None
    target = component_path(path, output)
    try:
        if target.is_file() and not _is_generated(target):
            message = f"{target.name} was not made by codegen: move it away, or rename the document"
            diagnostics.error("E540", message, Location(path))
            return None
    except OSError as error:
        diagnostics.error("E500", f"{target} cannot be read: {error.strerror or error}", Location(path))
        return None
    return [GeneratedFile(target, loaded.component)]


def _is_generated(file: Path) -> bool:
    with file.open(encoding="utf-8", errors="replace") as text:
        return GENERATED_BY in text.read(_HEAD)
