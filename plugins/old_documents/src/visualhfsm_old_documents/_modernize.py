"""Report Python 2 in a document, and convert it to Python 3."""

from __future__ import annotations

import io
import string
import tokenize
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics, Location, Note
from codegen.hfsm.code.language import change_code, code_of
from codegen.hfsm.code.text import library_today, parse_piece
from codegen.hfsm.codes import Code
from codegen.hfsm.document import Document, Library, Text
from codegen.messages import NO_MESSAGE, Message
from codegen.reasons import reason

from ._python2 import defined_names, fix_python2, python2_mark

_WORD: Final = string.ascii_letters + string.digits + "_"
_DIVISION: Final = Message("`/` rounds whole numbers down in Python 2, and does not in Python 3")


def modernize(document: Document, path: Path, diagnostics: Diagnostics, *, fixes: bool) -> Document:
    """Report each line of Python 2; return a document in which it is converted if `fixes` is set.

    A piece of code with other errors stays as it is. Raises ModuleNotFoundError, which names the command that
    installs fissix, when that is needed and missing.
    """
    return _Python2Converter(document, path, diagnostics, fixes=fixes).document()


class _Python2Converter:
    def __init__(self, document: Document, path: Path, diagnostics: Diagnostics, *, fixes: bool) -> None:
        self._document = document
        self._path = path
        self._diagnostics = diagnostics
        self._fixes = fixes
        self._missing = NO_MESSAGE
        """Why nothing can be fixed: the library is missing."""

    def document(self) -> Document:
        """Report the Python 2 in the document, and return it, fixed if requested."""
        pieces = [piece.text.text for piece in code_of(self._document, self._path)]
        trees = (parse_piece(self._fixed(code) or "") for code in pieces)
        self._bound = frozenset[str]().union(*(defined_names(tree) for tree in trees if tree is not None))
        document = change_code(self._document, self._code)
        return replace(document, libraries=tuple(self._library(each) for each in document.libraries))

    def _library(self, library: Library) -> Library:
        """Fix the name of a module, `queue as Queue` where that was `Queue`; replace JdeRobot's package."""
        name = library.name
        if library.kind != "module" or name.is_blank:
            return library
        if (today := library_today(name.text)) != name.text:
            message = Message("`{old}` is `{today}` now", old=name.text.strip(), today=today)
            self._diagnostics.note(Code.OLD_NAME, message, self._place(name, 1, 0))
            return replace(library, name=replace(name, text=today))
        if name.text.lstrip().startswith(("from ", "import ")):
            return replace(library, name=self._code(name))
        fixed = self._code(replace(name, text=f"import {name.text}", column=name.column - len("import ")))
        return replace(library, name=replace(name, text=fixed.text.removeprefix("import ")))

    def _code(self, text: Text) -> Text:
        """Report the Python 2 in a piece of code; return the code, fixed if possible and requested."""
        fixed = self._fixed(text.text, self._bound)
        if fixed is None:
            mark = python2_mark(text.text)
            if mark is not None:
                before = text.text[: mark.start()].split("\n")
                note = Note(self._missing or Message("more than this is wrong with the code: fix it by hand"))
                place = self._place(text, len(before), len(before[-1]))
                message = Message("Python 2: `{mark}`", mark=mark[0].strip())
                self._diagnostics.warning(Code.PYTHON2, message, place, [note])
            return text
        if fixed == text.text:
            return text
        notes = [Note(_DIVISION, self._place(text, *place)) for place in _divisions(fixed)]
        for line, (old, new) in enumerate(zip(text.text.split("\n"), fixed.split("\n"), strict=True), 1):
            if old != new:
                place = self._place(text, line, _first_difference(old, new))
                both = {"old": old.strip()[:60], "new": new.strip()[:60]}
                if self._fixes:
                    message = Message("fixed: `{old}` is `{new}` in Python 3", **both)
                    self._diagnostics.note(Code.PYTHON2_FIXED, message, place, notes)
                else:
                    how = Note(Message("`visualhfsm convert --fix-python2` fixes it"))
                    message = Message("Python 2: `{old}` is `{new}` in Python 3", **both)
                    self._diagnostics.warning(Code.PYTHON2, message, place, [how, *notes])
                notes = []
        return replace(text, text=fixed) if self._fixes else text

    def _fixed(self, code: str, bound: frozenset[str] = frozenset()) -> str | None:
        try:
            return fix_python2(code, bound)
        except ModuleNotFoundError as error:
            if self._fixes:
                raise
            self._missing = reason(error)
            return None

    def _place(self, text: Text, line: int, column: int) -> Location:
        """Return a place in a piece of code; `line` counts from 1 there, `column` from 0."""
        first = text.column if line == 1 else 1
        return Location(self._path, text.line + line - 1, max(1, first + column))


def _first_difference(old: str, new: str) -> int:
    """Return the beginning of the first word in which two lines differ."""
    ends = (place for place, pair in enumerate(zip(old, new, strict=False)) if pair[0] != pair[1])
    place = next(ends, min(len(old), len(new)))
    return len(old[:place].rstrip(_WORD))


def _divisions(code: str) -> Iterator[tuple[int, int]]:
    """Yield the positions of divisions with `/` in code: line from 1, column from 0."""
    try:
        for token in tokenize.generate_tokens(io.StringIO(code).readline):
            if token.string in ("/", "/="):
                yield token.start
    except (tokenize.TokenError, SyntaxError):
        return
