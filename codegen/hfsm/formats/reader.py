"""Read an automaton document in any of its dialects into the model.

The reader reports what keeps the file from being understood; whether a component can be generated from it is
for `codegen.hfsm.checks` to say.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Final

from ...diagnostics import Diagnostics, Location
from ..code.language import CPP, language_of
from ..code.reader import first_foreign
from ..document import Comment, Document, Text
from .dialects import ROOT_TAGS, Dialect, dialect_of, editor_of, reader_of
from .old import adapt_old_document
from .xml_tree import parse_xml, read_bytes

__all__ = ["looks_like_document", "parse_document", "read_document"]

_HEAD: Final = 4096
_ROOT: Final = re.compile(rb"<(VisualHFSM|VisualStates)\b")


def looks_like_document(file: Path) -> bool:
    """Return whether a file seems to be a document; one that cannot be read is for its reader."""
    try:
        with file.open("rb") as stream:
            return _ROOT.search(stream.read(_HEAD)) is not None
    except OSError:
        return True


def read_document(
    path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None = None
) -> Document | None:
    """Return the document in a file, or None after errors were reported.

    `remarks` gets notes about what is kept without being used.
    """
    content = read_bytes(path, diagnostics)
    return None if content is None else parse_document(content, path, diagnostics, remarks)


def parse_document(
    content: bytes | str, path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None = None
) -> Document | None:
    """Return the document in `content`, or None after errors were reported; `path` is for the messages.

    A document that an editor of old wrote is marked so. Documents of old dialects never say their language:
    one whose code looks like C++ is marked so, with a note. A document in the format of today is in Python
    unless it says otherwise.
    """
    if isinstance(content, str):
        content = content.encode()
    tree = parse_xml(content, path, diagnostics)
    if tree is None:
        return None
    root, comments = tree
    if root.tag not in ROOT_TAGS:
        place = Location(path, root.line, root.column, len(root.tag) + 1)
        message = f"`{root.tag}` is not the root of a document: it is `VisualHFSM`"
        diagnostics.error("E504", message, place)
        return None
    reader = reader_of(root, path, diagnostics, remarks)
    document = reader.document(root)
    if reader.failed:
        return None
    reader.tell_remarks()
    document = replace(document, comments=tuple(Comment(text) for text in comments))
    if not document.is_old and (editor := editor_of(root)):
        document = replace(document, dialect=Text(editor))
    if document.is_old:
        document = adapt_old_document(document, path, diagnostics)
    if dialect_of(root) is not Dialect.NATIVE and language_of(document) == CPP:
        document = replace(document, language=Text(CPP))
        if (piece := first_foreign(document, path)) is not None:
            message = "most of the code looks like C++: it is kept as C++, and does not run here"
            diagnostics.note("N502", message, piece.place)
    return document
