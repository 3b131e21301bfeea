"""Lead what a component writes back to the code of its document: log lines and tracebacks name its lines."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, NamedTuple

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Document
from visualhfsm.editing.locate import Locator
from visualhfsm.editing.places import Place

__all__ = ["Origin", "Origins", "read_origins"]

_MARKER: Final = re.compile(r"\s*# (.+\.xml):(\d+)\s*", re.IGNORECASE)
"""What the generator writes above each piece of code."""
_END_OF_LINE: Final = 1 << 30
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

    def find(self, line: str) -> Origin | None:
        """Return the piece of code of which a line of output speaks; None for other documents'."""
        frame = _FRAME.match(line)
        if frame is not None:
            return self._generated(int(frame[2])) if Path(frame[1]).name == self._component.name else None
        told = _TOLD.search(line)
        return self._written(told[1], int(told[2])) if told else None

    def _generated(self, line: int) -> Origin | None:
        """Return where a line of the component comes from; None when it is none of a person's code."""
        for number in range(min(line, len(self._lines)), 0, -1):
            marker = _MARKER.fullmatch(self._lines[number - 1])
            if marker:
                return self._written(marker[1], int(marker[2]) + line - number - 1)
        return None

    def _written(self, file: str, line: int) -> Origin | None:
        located = self._locator.find(line, _END_OF_LINE) if file == self._name else None
        return Origin(located.place, located.line) if located and located.line else None


def read_origins(document: Path, component: Path) -> Origins | None:
    """Return where the lines of a component that was just generated come from, or None."""
    read = read_document(document, Diagnostics())
    if read is None:
        return None
    try:
        text = component.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None
    return Origins(read, document.name, component, text)
