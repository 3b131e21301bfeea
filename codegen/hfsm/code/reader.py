"""Read the code of a document, and tell what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from ...diagnostics import Diagnostics, Location, Note
from ..codes import Code
from ..document import Document, Text
from .language import looks_like_cpp
from .pieces import Piece, is_foreign, pieces_of
from .python2 import fix_python2, python2_mark
from .text import CodeError, parse_piece

__all__ = ["CodeReader", "first_foreign", "report_foreign"]

_T = TypeVar("_T")
_PYTHON2 = Note("this is Python 2: `visualhfsm convert --fix-python2` fixes it")
_CPP = Note("if the document is in C++, let it say so: `<language>C++</language>`")


def first_foreign(document: Document, path: Path) -> Piece | None:
    """Return the first piece of another language in a document that says to be in one, or None without code.

    `path` is where the document lies.
    """
    pieces = list(pieces_of(document, path)) if is_foreign(document) else []
    return next((piece for piece in pieces if looks_like_cpp(piece.text.text)), pieces[0] if pieces else None)


def report_foreign(piece: Piece, language: str, diagnostics: Diagnostics, *notes: Note) -> None:
    """Report that a document is in another language, by the first piece of it."""
    message = f"{language} in {piece.what}: it is kept, but only Python runs here"
    diagnostics.error(Code.FOREIGN_LANGUAGE, message, piece.place, notes)


class CodeReader:
    """Analyze pieces of code; `report` then returns what is wrong with them."""

    def __init__(self, path: Path, diagnostics: Diagnostics) -> None:
        self._path = path
        self._diagnostics = diagnostics
        self._errors: list[tuple[Piece, CodeError]] = []

    def read(self, analyze: Callable[[Text], _T], what: str, text: Text, source: Path | None) -> _T | None:
        """Return what `analyze` makes of a piece, or None after an error; `source` is an imported file."""
        try:
            return analyze(text)
        except CodeError as error:
            self._errors.append((Piece(what, text, source or self._path), error))
            return None

    def report(self) -> None:
        """Report the errors that were found."""
        for piece, error in self._errors:
            place = Location(piece.path, error.line, max(1, error.column))
            code = piece.text.text
            notes = _notes_about(code) if parse_piece(code) is None else []
            self._diagnostics.error(Code.BAD_CODE, str(error), place, notes)


def _notes_about(code: str) -> list[Note]:
    """Return which language code may be in that is not Python 3."""
    try:
        if fix_python2(code) is not None:
            return [_PYTHON2]
    except ModuleNotFoundError as error:
        if python2_mark(code) is not None:
            return [Note(f"this may be Python 2: `visualhfsm convert --fix-python2` fixes it; {error}")]
    return [_CPP] if looks_like_cpp(code) else []
