"""Read an automaton document in any of its dialects into the model.

All dialects share two roots, so that only the content distinguishes them: documents of 2013 are in Spanish,
later ones have ids as attributes, and VisualStates has nested states since 2017. The reader reports why a
file cannot be read; `codegen.hfsm._checks` finds whether a component can be generated from it.
"""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Final

from visualhfsm_old_documents._spanish import translate_spanish
from visualhfsm_old_documents._visualstates import translate_visualstates

from ...diagnostics import Diagnostics, Location
from ...files import read_regular
from ...messages import Message
from ..code.language import CPP, change_code, first_foreign, is_mostly_cpp
from ..code.text import parse_piece
from ..codes import Code
from ..document import Document, Text
from .native import NativeReader
from .xml_tree import XmlElement, parse_xml, read_bytes

_ROOT_TAGS: Final = ("VisualHFSM", "VisualStates")
_HEAD: Final = 4096
_ROOT: Final = re.compile(rb"<(VisualHFSM|VisualStates)\b")
_NAMES: Final = ("lt", "gt", "quot", "amp")
_ENTITY: Final = re.compile(f"&({'|'.join(_NAMES)});")
_ESCAPED: Final = (("&gt;", ">"), ("&lt;", "<"), ("&quot;", '"'), ("&amp;", "&"))
"""In the order in which they are replaced: `&amp;lt;` was escaped twice."""
_SPANISH: Final = frozenset(
    ("idSub", "idPadre", "Estado", "tiempoIteracion", "Librerias", "variables_aux", "funciones_aux")
)
_VISUALSTATES: Final = frozenset(("state", "global_namespace", "functions", "variables", "configs"))


class Dialect(StrEnum):
    """A format of documents."""

    NATIVE = "native"
    SPANISH = "Spanish (2013)"
    VISUALSTATES = "VisualStates (2017)"


_EDITORS: Final = {Dialect.SPANISH: "VisualHFSM", Dialect.VISUALSTATES: "VisualStates"}
"""The former editors that wrote the old formats."""


def dialect_of(root: XmlElement) -> Dialect:
    """Return the dialect of a document, by the elements below its root."""
    automata = list(root.elements("SubAutomata"))
    if automata:
        spanish = any("id" not in each.attributes and any(each.elements(*_SPANISH)) for each in automata)
        return Dialect.SPANISH if spanish else Dialect.NATIVE
    if any(root.elements(*_VISUALSTATES)):
        return Dialect.VISUALSTATES
    return Dialect.SPANISH if root.first("nombreEsquema") else Dialect.NATIVE


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
    content: bytes | str, path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None = None
) -> Document | None:
    """Return the document in `content`, or None after reporting errors; `path` is for the messages.

    A document in an old format gets the name of the editor that wrote it as its dialect. Old formats do not
    name their language: if the code looks like C++, the document is marked as C++, with a note. A document in
    the current format, which the editor of 2017 wrote, too, says itself what it is: nothing is added to it.
    """
    root = parse_xml(content.encode() if isinstance(content, str) else content, path, diagnostics)
    if root is None:
        return None
    if root.tag not in _ROOT_TAGS:
        message = Message("`{tag}` is not the root of a document: it must be `VisualHFSM`", tag=root.tag)
        place = Location(path, root.line, root.column, len(root.tag) + 1)
        diagnostics.error(Code.NOT_A_DOCUMENT, message, place)
        return None
    dialect, declared = dialect_of(root), root.first("dialect")
    says_so = declared is not None and bool(declared.text.strip())
    is_old = dialect in _EDITORS or says_so
    repairs = is_old or _is_one_line(root)
    reader = NativeReader(path, diagnostics, remarks, is_old=is_old, unique_ids=repairs)
    if dialect is not Dialect.NATIVE:
        translate = translate_spanish if dialect is Dialect.SPANISH else translate_visualstates
        root = translate(root, reader)
    document = reader.document(root)
    if reader.failed:
        return None
    document = replace(document, format=dialect.value)
    if repairs:
        document = _unescape_code(document, path, diagnostics)
    if dialect in _EDITORS and not document.is_old:
        document = replace(document, dialect=Text(_EDITORS[dialect]))
    if dialect is not Dialect.NATIVE and is_mostly_cpp(document):
        document = replace(document, language=Text(CPP))
        if (piece := first_foreign(document, path)) is not None:
            message = Message("most of the code looks like C++: it is kept as C++, but cannot run")
            diagnostics.note(Code.KEPT_LANGUAGE, message, piece.place)
    return document


def _is_one_line(root: XmlElement) -> bool:
    """Return whether a document may have been written by the editor of 2017, which ended no line.

    So may any document without white space: this allows to repair what only that editor did, with a warning.
    """
    automaton = root.first("SubAutomata")
    inside = None if automaton is None else next(automaton.elements(), None)
    return automaton is not None and inside is not None and root.line == automaton.line == inside.line


def _unescape_code(document: Document, path: Path, diagnostics: Diagnostics) -> Document:
    """Undo the repeated escaping of former editors, but not inside string literals."""

    def unescaped(text: Text) -> Text:
        code = text.text
        tree = parse_piece(code) if _ENTITY.search(code) is not None else None
        names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)} if tree else set()
        if _ENTITY.search(code) is None or (tree is not None and names.isdisjoint(_NAMES)):
            return text
        while _ENTITY.search(code) is not None:  # once for each time that it was saved
            for entity, character in _ESCAPED:
                code = code.replace(entity, character)
        if parse_piece(code) is None:
            return text
        message = Message("`<` and `>` were escaped twice when the document was saved: they are restored")
        diagnostics.warning(Code.OLD_CODE_CHANGED, message, Location(path, text.line, max(1, text.column)))
        return replace(text, text=code)

    return change_code(document, unescaped)
