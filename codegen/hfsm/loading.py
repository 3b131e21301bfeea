"""Make a component of a document: with all that it imports and extends, checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ..diagnostics import Diagnostics, Location, Severity
from ..files import GeneratedFile
from .analysis import Analysis, analyze
from .checks import check
from .code.names import identifier
from .codes import Code
from .document import Document
from .extension import find_extension
from .formats.reader import read_document
from .generator import GENERATED_BY, check_component, generate
from .imports import resolve
from .known_interfaces import KnownInterfaces, find_interfaces

__all__ = ["LoadedDocument", "compile_document", "component_path", "load_document"]

_HEAD: Final = 4000
"""Characters of a file in which a component says what it was generated from."""


@dataclass(frozen=True, slots=True)
class LoadedDocument:
    """A document with its imports resolved and its code analyzed, and the text of its component."""

    document: Document
    analysis: Analysis
    interfaces: KnownInterfaces
    component: str


def compile_document(
    path: Path,
    output: Path | None,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    with_model: bool = False,
) -> list[GeneratedFile] | None:
    """Return the component of a document as a file, or None after errors were reported.

    `output` is the directory of the file, by default that of the document. `include` are directories with
    packages of proxies beside the package `interfaces`. `with_model` reports what is seen at once never to
    happen, and makes an error of each property that is seen at once to be violated. Errors and warnings are
    reported, without notes. Nothing is written.
    """
    found = Diagnostics()
    loaded = load_document(path, output, found, include)
    if loaded is not None and with_model:
        from .checking import report_violations  # the model checker takes its time to load

        report_violations(loaded, path, found)
    diagnostics.add_all(found, leave_out=[Severity.NOTE])
    if loaded is None or found.has_errors:
        return None
    target = component_path(path, output)
    try:
        if target.is_file() and not _is_generated(target):
            message = f"{target.name} was not made by codegen: move it away, or rename the document"
            diagnostics.error(Code.FILE_IN_THE_WAY, message, Location(path))
            return None
    except OSError as error:
        diagnostics.error(
            Code.UNREADABLE_FILE, f"{target} cannot be read: {error.strerror or error}", Location(path)
        )
        return None
    return [GeneratedFile(target, loaded.component)]


def load_document(
    path: Path,
    output: Path | None,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    document: Document | None = None,
) -> LoadedDocument | None:
    """Return what a document says, or None after errors were reported.

    `output` is the directory of its component, by default that of the document. `include` are directories
    with packages of proxies, and with files to import. `document` is what the file is to hold, as it was
    read from its text, where it has not been saved yet.
    """
    errors = len(diagnostics.errors)
    if document is None:
        document = read_document(path, diagnostics)
    if document is None:
        return None
    document = resolve(document, path, diagnostics, include)
    if len(diagnostics.errors) > errors:
        return None
    extension = find_extension(path, component_path(path, output), diagnostics)
    interfaces = find_interfaces(include)
    analysis = analyze(document, path)
    check(analysis, interfaces, diagnostics, extension)
    if len(diagnostics.errors) > errors:
        return None
    component = generate(analysis, interfaces, extension)
    check_component(component, path, diagnostics)
    if len(diagnostics.errors) > errors:
        return None
    return LoadedDocument(document, analysis, interfaces, component.text)


def component_path(document: Path, output: Path | None) -> Path:
    """Return the file of a document's component, in the directory `output` or beside the document."""
    return (output or document.parent) / f"{identifier(document.stem, 'component')}.py"


def _is_generated(file: Path) -> bool:
    with file.open(encoding="utf-8", errors="replace") as text:
        return GENERATED_BY in text.read(_HEAD)
