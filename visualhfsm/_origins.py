"""The code of a document to which lines of a component's output refer."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, Literal, NamedTuple

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document, resolve
from codegen.hfsm.document import Document
from codegen.hfsm.source_map import SourceMap, SourceRow
from visualhfsm._editing.places import Locator, Place, spots, texts_at

_FRAME: Final = re.compile(r'\s*File "(.+)", line (\d+)')
_STATE: Final = frozenset({"entry", "code", "exit", "argument"})
_TRANSITION: Final = frozenset({"trigger", "guard", "fired"})


class Origin(NamedTuple):
    """A line, from 1, of a piece of code; 0 for an element as a whole.

    Code of an imported automaton is at the state that owns it; `file` and `file_line` are where it stands.
    """

    place: Place
    line: int
    file: str = ""
    file_line: int = 0


class Origins:
    """The origins of the lines of one generated component."""

    def __init__(
        self,
        document: Document,
        name: str,
        component: Path,
        source_map: SourceMap,
        whole: Document | None = None,
    ) -> None:
        self._document = document
        self._whole = whole or document
        """The document with all that it imports."""
        self._locator = Locator(document)
        self._name = name
        self._component = component
        self._source_map = source_map
        self._logged = re.compile(rf"\({re.escape(name)}:(\d{{1,9}})\)")
        """The pattern of a place in the component's own log: `follow_ball.py:57 (follow_ball.xml:31)`."""
        self._elsewhere = re.compile(rf"{re.escape(component.name)}:(\d{{1,9}}) \([^()]+:\d{{1,9}}\)")
        """The same, of a line of the component whose code comes from another file."""
        self._unloaded = re.compile(rf"[^ :]+: error: {re.escape(name)}:(\d{{1,9}}): ")
        """The pattern of a library that fails: `follow_ball.py: error: follow_ball.xml:9: `."""

    def find(self, line: str, *, automaton: int = 0, state: int = 0) -> Origin | None:
        """Return the piece of code that a line of output refers to, None if it refers to none.

        If pieces share a line of the document, that of the `automaton` and `state`, ids of a report of
        the component, is preferred.
        """
        frame = _FRAME.match(line)
        if frame is not None:
            number = int(frame[2])
            row = self._source_map.find(number) if Path(frame[1]).name == self._component.name else None
            return self._of_row(row, number)
        unloaded = self._unloaded.match(line)
        if unloaded is not None:
            return self._library(int(unloaded[1]))
        logged = self._logged.search(line)
        if logged is None:
            elsewhere = self._elsewhere.search(line)
            number = int(elsewhere[1]) if elsewhere else 0
            return self._of_row(self._source_map.find(number), number)
        found = self._locator.find_code(int(logged[1]), automaton=automaton, state=state)
        return Origin(found.place, found.line) if found else self._library(int(logged[1]))

    def element(self, automaton: int, state: int, transition: int) -> Origin | None:
        """Return a state, or a transition unless its id is 0, as a whole; None for another document's."""
        source = self._document.automaton(automaton)
        if source is None:
            return None
        kind: Literal["state", "transition"] = "transition" if transition else "state"
        elements = source.transitions if transition else source.states
        if all(each.id != (transition or state) for each in elements):
            return None
        return Origin(Place(kind=kind, automaton=automaton, id=transition or state), 0)

    def state_name(self, automaton: int, state: int) -> str:
        """Return the name of a state; empty for another document's."""
        source = self._document.automaton(automaton)
        states = () if source is None else source.states
        return next((each.name for each in states if each.id == state), "")

    def texts(self, place: Place) -> tuple[str, ...]:
        """Return the texts at a place, as the component runs them."""
        return texts_at(self._document, place)

    def _of_row(self, row: SourceRow | None, number: int) -> Origin | None:
        """Return the place of a line of the component, in a row of its source map."""
        if row is None:
            return None
        line = row.line_of(number)
        return self._written(row, line) if row.file == self._name else self._imported(row, line)

    def _imported(self, row: SourceRow, line: int) -> Origin | None:
        """Return the state of this document below which imported code runs; `line` is that of its file."""
        own = {each.id for each in self._document.automata if each.imported is None}
        automaton = self._whole.automaton(row.automaton)
        for _ in self._whole.automata:
            if automaton is None:
                return None
            owner = self._whole.owner(automaton)
            if owner is None:
                return None
            if automaton.father in own:
                place = Place(kind="state", automaton=automaton.father, id=owner.id)
                return Origin(place, 0, row.file, line)
            automaton = self._whole.automaton(automaton.father)
        return None

    def _library(self, line: int) -> Origin | None:
        """Return the library in a line of the document."""
        for place, text, first, _ in spots(self._document):
            if place.part == "libraries" and text and first <= line <= first + text.count("\n"):
                return Origin(place, 1)
        return None

    def _written(self, row: SourceRow, line: int) -> Origin | None:
        """Return the place of a row of the source map; `line` is a line of the document."""
        if row.part == "library":
            return self._library(line)
        kind: Literal["automaton", "state", "transition"] = "automaton"
        if row.part in _STATE:
            kind = "state"
        elif row.part in _TRANSITION:
            kind = "transition"
        for spot in spots(self._document):
            place = spot.place
            if (place.kind, place.automaton, place.id, place.part) != (kind, *row[4:], row.part):
                continue
            if spot.text is not None and 0 <= line - spot.line <= spot.text.count("\n"):
                return Origin(place, line - spot.line + 1)
        return None


def read_origins(document: Path, component: Path) -> Origins | None:
    """Return the source map of a component, or None without its document.

    Without its file, only lines that name the document are found.
    """
    read = read_document(document, Diagnostics())
    if read is None:
        return None
    try:
        text = component.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        text = ""
    whole = resolve(read, document, Diagnostics())
    return Origins(read, document.name, component, SourceMap.read(text), whole)
