"""Turn a document of any age into the text of one of today, and tell what becomes of it.

Formats go by the extension of a file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics, Location
from codegen.hfsm import read_document, write_document
from codegen.hfsm.code.pieces import is_foreign, pieces_of
from codegen.hfsm.document import Document
from codegen.hfsm.scxml import is_scxml, read_scxml, write_scxml

from .python2 import convert_python2

__all__ = ["READERS", "WRITERS", "Reader", "Writer", "convert_document"]

Reader = Callable[[Path, Diagnostics], Document | None]
"""Returns the document in a file, or None after it reported errors."""

_HEAD: Final = 1 << 16
"""Bytes of a file among which its root stands."""

Writer = Callable[[Document, Path, Diagnostics], str]
"""Returns the text of a document that was read from a path, and tells what it cannot carry."""


def convert_document(
    source: Path, read: Reader, write: Writer, diagnostics: Diagnostics, *, fixes_python2: bool
) -> str:
    """Return the text of the new document; worth nothing after errors were reported.

    Raises ModuleNotFoundError when it `fixes_python2` and the library for that is not there.
    """
    document = read(source, diagnostics)
    if document is None:
        return ""
    if is_foreign(document):
        if not any(each.code == "N502" for each in diagnostics):  # an old dialect: its reader has reported it
            _tell_of_language(document, source, diagnostics)
    else:
        document = convert_python2(document, source, diagnostics, fixes=fixes_python2)
    return write(document, source, diagnostics)


def _read_xml(path: Path, diagnostics: Diagnostics) -> Document | None:
    """Return the document in a file, which may be SCXML by its root."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError:
        head = b""  # told when all of it is read
    read = read_scxml if is_scxml(head) else read_document
    return read(path, diagnostics, remarks=diagnostics)


def _read_scxml(path: Path, diagnostics: Diagnostics) -> Document | None:
    return read_scxml(path, diagnostics, remarks=diagnostics)


def _write_xml(document: Document, source: Path, diagnostics: Diagnostics) -> str:
    del source, diagnostics  # this format holds all that any reader makes
    return write_document(document)


def _tell_of_language(document: Document, source: Path, diagnostics: Diagnostics) -> None:
    language = document.language.text.strip()
    first = next(pieces_of(document, source), None)
    place = Location(source) if first is None else first.place
    diagnostics.note("N502", f"the code is {language}: it is kept, and does not run here", place)


READERS: Final[Mapping[str, Reader]] = {".xml": _read_xml, ".scxml": _read_scxml}
WRITERS: Final[Mapping[str, Writer]] = {".xml": _write_xml, ".scxml": write_scxml}
