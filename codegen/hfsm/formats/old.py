"""Change in documents of old what their generators read otherwise than it is read today."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Final

from ...diagnostics import Diagnostics, Location, Note
from ..code.pieces import change_code
from ..code.trees import parse_piece
from ..document import Automaton, Document, Text, Transition

__all__ = ["adapt_old_document"]

_ENTITIES: Final = {"&lt;": "<", "&gt;": ">", "&quot;": '"', "&amp;": "&"}
_NAMES: Final = frozenset(name.strip("&;") for name in _ENTITIES)
_ENTITY: Final = re.compile("|".join(_ENTITIES))


def adapt_old_document(document: Document, path: Path, diagnostics: Diagnostics) -> Document:
    """Return a document of old as one that runs here, after a warning about each change."""
    document = _number_transitions(document, path, diagnostics)
    return _unescape_code(document, path, diagnostics)


def _number_transitions(document: Document, path: Path, diagnostics: Diagnostics) -> Document:
    """Give the transitions of an automaton different ids: the generators of old never read them."""

    def renumbered(automaton: Automaton) -> Automaton:
        free = (number for number in count(1) if all(each.id != number for each in automaton.transitions))
        first: dict[int, Transition] = {}
        found: list[Transition] = []
        for transition in automaton.transitions:
            known = first.setdefault(transition.id, transition)
            number = transition.id
            if known is not transition or number == 0:
                number = next(free)
                reason = "is not at least 1" if known is transition else "is that of another"
                message = f"the id {transition.id} of a transition {reason}: it is given {number}"
                place = Location(path, transition.line, max(1, transition.column))
                note = Note("the other is here", Location(path, known.line, max(1, known.column)))
                diagnostics.warning("W508", message, place, [] if known is transition else [note])
            found.append(replace(transition, id=number))
        return replace(automaton, transitions=tuple(found))

    return replace(document, automata=tuple(map(renumbered, document.automata)))


def _unescape_code(document: Document, path: Path, diagnostics: Diagnostics) -> Document:
    """Undo what VisualStates escaped twice on saving, where it is not part of the code's texts."""

    def unescaped(text: Text) -> Text:
        code = text.text
        tree = parse_piece(code) if _ENTITY.search(code) is not None else None
        names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)} if tree else set()
        if _ENTITY.search(code) is None or (tree is not None and names.isdisjoint(_NAMES)):
            return text
        while _ENTITY.search(code) is not None:  # each time that it was opened and saved
            code = _ENTITY.sub(lambda found: _ENTITIES[found[0]], code)
        if parse_piece(code) is None:
            return text
        message = "`<` and `>` were escaped twice when the document was saved: that is undone"
        diagnostics.warning("W509", message, Location(path, text.line, max(1, text.column)))
        return replace(text, text=code)

    return change_code(document, unescaped)
