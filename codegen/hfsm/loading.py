"""Load a document as far as a component: with all that it imports and extends, checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..diagnostics import Diagnostics
from .code.names import identifier
from .document import Document
from .extension import find_extension
from .formats.reader import read_document
from .generation.generator import check_component, generate
from .generation.understanding import understand
from .imports import resolve
from .known_interfaces import KnownInterfaces, find_interfaces

__all__ = ["LoadedDocument", "component_path", "load_document"]


@dataclass(frozen=True, slots=True)
class LoadedDocument:
    """A document with its imports resolved, the interfaces that it may name, and its component's text."""

    document: Document
    interfaces: KnownInterfaces
    component: str


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
    program = understand(document, path, interfaces, diagnostics, extension)
    if program is None or len(diagnostics.errors) > errors:
        return None
    component = generate(program)
    check_component(program, component, path, diagnostics)
    if len(diagnostics.errors) > errors:
        return None
    return LoadedDocument(document, interfaces, component)


def component_path(document: Path, output: Path | None) -> Path:
    """Return the file of a document's component, in the directory `output` or beside the document."""
    return (output or document.parent) / f"{identifier(document.stem, 'component')}.py"
