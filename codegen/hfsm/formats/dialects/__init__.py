"""The dialects of automaton documents: each has a reader that makes the same model of it."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from codegen.diagnostics import Diagnostics

from ...document import Document
from ..xml_tree import XmlElement
from .detection import ROOT_TAGS, Dialect, dialect_of, editor_of
from .native import NativeReader
from .spanish import SpanishReader
from .visualstates import VisualStatesReader

__all__ = ["ROOT_TAGS", "Dialect", "DialectReader", "dialect_of", "editor_of", "reader_of"]


class DialectReader(Protocol):
    """Makes a document of a tree of XML; the document is worth nothing if it has `failed`."""

    failed: bool

    def document(self, root: XmlElement) -> Document:
        """Return the document below a root."""
        ...

    def tell_remarks(self) -> None:
        """Tell what is kept without being used."""
        ...


def reader_of(
    root: XmlElement, path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None = None
) -> DialectReader:
    """Return a reader for the dialect of a document; `remarks` gets what is kept without being used."""
    match dialect_of(root):
        case Dialect.NATIVE:
            return NativeReader(path, diagnostics, remarks)
        case Dialect.SPANISH:
            return SpanishReader(path, diagnostics, remarks)
        case Dialect.VISUALSTATES:
            return VisualStatesReader(path, diagnostics, remarks)
