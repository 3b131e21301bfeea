"""Report diagnostics at tokens. The Slice compiler speaks to terminals alone, in English."""

from __future__ import annotations

from codegen.diagnostics import Diagnostics, Location, Note

from ..messages import Message
from .codes import Code
from .lexer import Token


class Report:
    """Reports to the diagnostics of a run."""

    def __init__(self, diagnostics: Diagnostics) -> None:
        self._diagnostics = diagnostics

    def error(self, code: Code, text: str, where: Token | Location, *notes: Note) -> None:
        """Report a problem that makes the sources unusable."""
        self._diagnostics.error(code, Message.verbatim(text), _place(where), notes)

    def warning(self, code: Code, text: str, where: Token | Location, *notes: Note) -> None:
        """Report a possible mistake."""
        self._diagnostics.warning(code, Message.verbatim(text), _place(where), notes)

    def note(self, code: Code, text: str, where: Token | Location) -> None:
        """Report a fact that needs no change."""
        self._diagnostics.note(code, Message.verbatim(text), _place(where))


def note_at(text: str, where: Token | Location | None = None) -> Note:
    """Return an explanation of a diagnostic, perhaps with another place."""
    return Note(Message.verbatim(text), None if where is None else _place(where))


def _place(where: Token | Location) -> Location:
    return where if isinstance(where, Location) else where.location
