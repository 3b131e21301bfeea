"""Lead what a component writes back to the code of its document: log lines and tracebacks name its lines."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, NamedTuple

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Document
from visualhfsm.editing.places import Locator, Place

__all__ = ["Origin", "Origins", "read_origins"]

_MARKER: Final = re.compile(r"\s*# (.+):(\d{1,9})(?:-(\d{1,9}))?\s*")
"""What the generator writes above each piece of code: file, first line, and the last of several."""
_FUNCTION: Final = re.compile(r"        def (entry|state|exit|guard|fired)_\w+\(.*")
_AUTOMATON: Final = re.compile(r'        """Return automaton (\d{1,10}), .*')
_PARTS: Final = {"entry": "entry", "state": "code", "exit": "exit", "fired": "fired"}
"""What the functions of the pieces of code are called after, by the parts; a guard may be one of two."""
_FRAME: Final = re.compile(r'\s*File "(.+)", line (\d+)')
_TOLD: Final = re.compile(r"\((.{1,200}?\.xml):(\d{1,9})\)", re.IGNORECASE)
"""How the component's own log names a place: `follow_ball.py:57 (follow_ball.xml:31)`."""


class Origin(NamedTuple):
    """A line, from 1, of a piece of code."""

    place: Place
    line: int


class Origins:
    """Where the lines of one generated component come from."""

    def __init__(self, document: Document, name: str, component: Path, text: str) -> None:
        self._locator = Locator(document)
        self._name = name
        self._component = component
        self._lines = text.split("\n")

    def find(self, line: str, *, automaton: int = 0, state: int = 0) -> Origin | None:
        """Return the piece of code of which a line of output speaks; None for other documents'.

        Of pieces that share a line of the document that of the `automaton` and the `state` is preferred, the
        ids in a report of the component.
        """
        frame = _FRAME.match(line)
        if frame is not None:
            return self._generated(int(frame[2])) if Path(frame[1]).name == self._component.name else None
        told = _TOLD.search(line)
        return self._written(told[1], int(told[2]), automaton=automaton, state=state) if told else None

    def _generated(self, line: int) -> Origin | None:
        """Return where a line of the component comes from; None when it is none of a person's code.

        The lines below a comment of the generator are skipped: a person's comment there may look the same.
        """
        number = 1
        while number < min(line, len(self._lines)):
            marker = _MARKER.fullmatch(self._lines[number - 1])
            number += 1
            if marker:
                first = int(marker[2])
                count = max(0, int(marker[3] or first) - first + 1)
                if line < number + count:
                    part, automaton = self._around(number - 1)
                    written, code = first + line - number, self._lines[line - 1]
                    return self._written(marker[1], written, code=code, part=part, automaton=automaton)
                number += count
        return None

    def _around(self, line: int) -> tuple[str, int]:
        """Return in which part of which automaton a line of the component stands, as far as it tells."""
        part = ""
        for number in range(line - 1, -1, -1):
            function = _FUNCTION.fullmatch(self._lines[number])
            if function and not part:
                part = _PARTS.get(function[1], "")
            method = _AUTOMATON.fullmatch(self._lines[number])
            if method:
                return part, int(method[1])
        return "", 0

    def _written(
        self, file: str, line: int, *, code: str = "", part: str = "", automaton: int = 0, state: int = 0
    ) -> Origin | None:
        if file != self._name:
            return None
        found = self._locator.find_code(line, code=code, part=part, automaton=automaton, state=state)
        return Origin(found.place, found.line) if found else None


def read_origins(document: Path, component: Path) -> Origins | None:
    """Return where the lines of a component come from, or None without its document.

    Without its file only what names the document is found.
    """
    read = read_document(document, Diagnostics())
    if read is None:
        return None
    try:
        text = component.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        text = ""
    return Origins(read, document.name, component, text)
