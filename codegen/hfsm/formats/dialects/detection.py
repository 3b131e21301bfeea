"""Tell the dialects of automaton documents apart.

All share two roots, so that only what stands below it tells: automata of 2013 are written in Spanish, later
ones have ids as attributes, and VisualStates has had nested states since 2017.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Final

from ..xml_tree import XmlElement

__all__ = ["ROOT_TAGS", "Dialect", "dialect_of", "editor_of"]

ROOT_TAGS: Final = ("VisualHFSM", "VisualStates")

_SPANISH: Final = frozenset(
    ("idSub", "idPadre", "Estado", "tiempoIteracion", "Librerias", "variables_aux", "funciones_aux")
)
_VISUALSTATES: Final = frozenset(("state", "global_namespace", "functions", "variables", "configs"))


class Dialect(StrEnum):
    """In which way a document is written."""

    NATIVE = "native"
    SPANISH = "Spanish (2013)"
    VISUALSTATES = "VisualStates (2017)"


def dialect_of(root: XmlElement) -> Dialect:
    """Return the dialect of a document by what stands below its root."""
    automata = [element for element in root.elements() if element.tag == "SubAutomata"]
    if automata:
        spanish = any(
            "id" not in automaton.attributes
            and any(element.tag in _SPANISH for element in automaton.elements())
            for automaton in automata
        )
        return Dialect.SPANISH if spanish else Dialect.NATIVE
    if any(element.tag in _VISUALSTATES for element in root.elements()):
        return Dialect.VISUALSTATES
    if any(element.tag == "nombreEsquema" for element in root.elements()):
        return Dialect.SPANISH
    return Dialect.NATIVE


def editor_of(root: XmlElement) -> str:
    """Return which editor of old wrote a document that does not say it, or an empty text for none.

    The format of today is VisualHFSM's of 2017. Its editor wrote everything on one line; ours never does.
    """
    match dialect_of(root):
        case Dialect.VISUALSTATES:
            return "VisualStates"
        case Dialect.SPANISH:
            return "VisualHFSM"
    automaton = next((element for element in root.elements() if element.tag == "SubAutomata"), None)
    inside = None if automaton is None else next(automaton.elements(), None)
    is_one_line = automaton and inside and root.line == automaton.line == inside.line
    return "VisualHFSM" if is_one_line else ""
