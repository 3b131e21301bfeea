"""Read documents of former editors, which have the same roots as ours.

Only the content distinguishes them: documents of 2013 are in Spanish, later ones have ids as attributes, and
VisualStates has nested states since 2017. The editor of 2017 also wrote the current format: such a document
says itself what it is, and nothing is added to it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics, Location
from codegen.hfsm.code.language import change_code, first_foreign
from codegen.hfsm.code.text import parse_piece
from codegen.hfsm.codes import Code
from codegen.hfsm.document import Document, Text
from codegen.hfsm.formats.native import NativeReader
from codegen.hfsm.formats.others import DOCUMENT_SUFFIX
from codegen.hfsm.formats.reader import ROOT_TAGS
from codegen.hfsm.formats.xml_tree import XmlElement
from codegen.messages import Message

from ._languages import CPP, is_mostly_cpp
from ._spanish import translate_spanish
from ._visualstates import translate_visualstates

GUIDE: Final = "docs/reference/documents.md"
_NAMES: Final = ("lt", "gt", "quot", "amp")
_ENTITY: Final = re.compile(f"&({'|'.join(_NAMES)});")
_ESCAPED: Final = (("&gt;", ">"), ("&lt;", "<"), ("&quot;", '"'), ("&amp;", "&"))
"""In the order in which they are replaced: `&amp;lt;` was escaped twice."""
_SPANISH: Final = frozenset(
    ("idSub", "idPadre", "Estado", "tiempoIteracion", "Librerias", "variables_aux", "funciones_aux")
)
_VISUALSTATES: Final = frozenset(("state", "global_namespace", "functions", "variables", "configs"))


@dataclass(frozen=True)
class Dialect:
    """A format of a former editor, whose name documents get that do not say it.

    Its documents do not name their language: if the code looks like C++, the document is marked as C++, with
    a note.
    """

    name: str
    editor: str
    recognizes: Callable[[XmlElement], bool]
    translate: Callable[[XmlElement, NativeReader], XmlElement]
    suffix: str = DOCUMENT_SUFFIX
    guide: str = GUIDE

    def read(
        self, root: XmlElement, path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None
    ) -> Document | None:
        """Return the document, or None after reporting errors."""
        reader = NativeReader(path, diagnostics, remarks, is_old=True, unique_ids=True)
        document = reader.document(self.translate(root, reader))
        if reader.failed:
            return None
        document = _unescape_code(replace(document, format=self.name), path, diagnostics)
        if not document.is_old:
            document = replace(document, dialect=Text(self.editor))
        if is_mostly_cpp(document):
            document = replace(document, language=Text(CPP))
            if (piece := first_foreign(document, path)) is not None:
                message = Message("most of the code looks like C++: it is kept as C++, but cannot run")
                diagnostics.note(Code.KEPT_LANGUAGE, message, piece.place)
        return document


class OurFormat:
    """Our own format as former editors wrote it: what they did wrong is repaired."""

    suffix: Final = DOCUMENT_SUFFIX
    guide: Final = GUIDE

    def recognizes(self, root: XmlElement) -> bool:
        """Return whether a former editor wrote a document, or may have: its root has to be ours."""
        is_ours = root.tag in ROOT_TAGS and not _is_spanish(root) and not _is_of_visualstates(root)
        return is_ours and (_names_its_editor(root) or _is_one_line(root))

    def read(
        self, root: XmlElement, path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None
    ) -> Document | None:
        """Return the document, or None after reporting errors."""
        reader = NativeReader(path, diagnostics, remarks, is_old=_names_its_editor(root), unique_ids=True)
        document = reader.document(root)
        return None if reader.failed else _unescape_code(document, path, diagnostics)


def _is_spanish(root: XmlElement) -> bool:
    if root.tag not in ROOT_TAGS:
        return False
    automata = list(root.elements("SubAutomata"))
    if automata:
        return any("id" not in each.attributes and any(each.elements(*_SPANISH)) for each in automata)
    return root.first("nombreEsquema") is not None and not _has_states(root)


def _is_of_visualstates(root: XmlElement) -> bool:
    return root.tag in ROOT_TAGS and root.first("SubAutomata") is None and _has_states(root)


def _has_states(root: XmlElement) -> bool:
    return any(root.elements(*_VISUALSTATES))


def _names_its_editor(root: XmlElement) -> bool:
    declared = root.first("dialect")
    return declared is not None and bool(declared.text.strip())


SPANISH: Final = Dialect("Spanish (2013)", "VisualHFSM", _is_spanish, translate_spanish)
VISUALSTATES: Final = Dialect(
    "VisualStates (2017)", "VisualStates", _is_of_visualstates, translate_visualstates
)
OURS: Final = OurFormat()


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
