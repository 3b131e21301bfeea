"""Read an automaton document into the model.

The reader reports why a file cannot be read; `codegen.hfsm._checks` finds whether a component can be
generated from it. Plug-ins read documents of other editors, which `others` finds.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from ...diagnostics import Diagnostics, Location, Note
from ...files import read_regular
from ...messages import Message
from ..codes import Code
from ..document import Document
from .native import NativeReader
from .others import format_of, formats
from .schema import AUTOMATON, DOCUMENT
from .xml_tree import XmlElement, parse_xml, read_bytes

ROOT_TAGS: Final = ("VisualHFSM", "VisualStates")
"""The roots of documents, of ours and of other editors."""
_HEAD: Final = 4096
_ROOT: Final = re.compile(rb"<(VisualHFSM|VisualStates)\b")


def looks_like_document(file: Path) -> bool:
    """Return whether a file seems to be a document, or is unreadable, which its reader reports."""
    try:
        return _ROOT.search(read_regular(file, _HEAD)) is not None
    except OSError:
        return True


def read_document(
    path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None = None
) -> Document | None:
    """Return the document in a file, or None after reporting errors.

    `remarks` gets notes about what is kept but not used.
    """
    content = read_bytes(path, diagnostics)
    return None if content is None else parse_document(content, path, diagnostics, remarks)


def parse_document(
    content: bytes | str,
    path: Path,
    diagnostics: Diagnostics,
    remarks: Diagnostics | None = None,
    *,
    above: int = 0,
) -> Document | None:
    """Return the document in `content`, or None after reporting errors; `path` is for the messages.

    It begins below as many lines as are `above` it.
    """
    root = parse_xml(content.encode() if isinstance(content, str) else content, path, diagnostics, above)
    if root is None:
        return None
    if (other := format_of(root)) is not None:
        return other.read(root, path, diagnostics, remarks)
    if root.tag not in ROOT_TAGS:
        message = Message("`{tag}` is not the root of a document: it must be `VisualHFSM`", tag=root.tag)
        place = Location(path, root.line, root.column, len(root.tag) + 1)
        diagnostics.error(Code.NOT_A_DOCUMENT, message, place, _how_to_read_others())
        return None
    if not formats() and (strange := _strange(root)) is not None:
        message = Message("`{element}` is not in the format of VisualHFSM", element=strange.tag)
        place = Location(path, strange.line, strange.column, len(strange.tag) + 1)
        diagnostics.error(Code.NOT_A_DOCUMENT, message, place, _how_to_read_others())
        return None
    reader = NativeReader(path, diagnostics, remarks)
    document = reader.document(root)
    return None if reader.failed else document


def _how_to_read_others() -> list[Note]:
    """Return a note about documents of other editors, if no plug-in reads any."""
    if formats():
        return []
    return [Note(Message("what reads documents of other editors is not installed: pip install visualhfsm"))]


def _strange(root: XmlElement) -> XmlElement | None:
    """Return an element that shows that another editor wrote a document, of which nothing can be read."""
    automata = list(root.elements(AUTOMATON.tag))
    if any("id" in each.attributes or any(each.elements(*AUTOMATON.children)) for each in automata):
        return None
    unknown = (each for each in root.elements() if each.tag not in DOCUMENT.children)
    return next(iter((*unknown, *(child for each in automata for child in each.elements()))), None)
