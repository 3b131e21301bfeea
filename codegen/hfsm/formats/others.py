"""Formats other than ours: plug-ins read them, and may write them.

They are found as entry points of the group `codegen.formats`.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Final, Protocol, runtime_checkable

from zenoh_ice import plugins

from ...diagnostics import Diagnostics
from ..document import Document
from .xml_tree import XmlElement, read_root

SEAM: Final = "codegen.formats"
DOCUMENT_SUFFIX: Final = ".xml"
_HEAD: Final = 4096  # bytes in which the root of a file must start


class Format(Protocol):
    """A format of documents in XML, as a module or an object.

    Files in formats of which the `suffix` is that of ours are documents wherever these are read. Others are
    imported: each becomes a new document, and what is lost is reported with one of the codes `LOST`.
    """

    @property
    def suffix(self) -> str:
        """The end of the names of its files, such as `.xml`."""

    @property
    def guide(self) -> str:
        """The page of the documentation that says what is understood."""

    def recognizes(self, root: XmlElement) -> bool:
        """Return whether a file is in this format: by its tree, or by the root alone if it is imported."""

    def read(
        self, root: XmlElement, path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None
    ) -> Document | None:
        """Return the document in a file, or None after reporting errors; `path` is for the messages.

        The `format` of the document is what people call the format, if saving would replace it by ours.
        `remarks` gets notes about what is kept but not used.
        """


@runtime_checkable
class WritableFormat(Format, Protocol):
    """A format that is written, too."""

    def write(self, document: Document, path: Path, diagnostics: Diagnostics) -> str:
        """Return the text of a file, and report what is lost; `path` is that of the document.

        Raises DocumentNotWritableError.
        """


@cache
def formats() -> tuple[Format, ...]:
    """Return what is installed."""
    return tuple(each for _, each in plugins.each(SEAM))


def writable_formats() -> dict[str, WritableFormat]:
    """Return the formats that are written, by their suffix."""
    return {each.suffix: each for each in formats() if isinstance(each, WritableFormat)}


def imported_suffixes() -> list[str]:
    """Return the suffixes of files that are imported."""
    return sorted({each.suffix for each in formats()} - {DOCUMENT_SUFFIX})


def imported_format(name: str, content: bytes) -> Format | None:
    """Return the format in which a file is imported, by its name or its root; None for a document."""
    imported = [each for each in formats() if each.suffix != DOCUMENT_SUFFIX]
    by_name = next((each for each in imported if name.lower().endswith(each.suffix)), None)
    root = read_root(content[:_HEAD]) if imported and by_name is None else None
    return by_name or next((each for each in imported if root is not None and each.recognizes(root)), None)


def format_of(root: XmlElement) -> Format | None:
    """Return the format of a document; None for ours."""
    documents = (each for each in formats() if each.suffix == DOCUMENT_SUFFIX)
    return next((each for each in documents if each.recognizes(root)), None)
