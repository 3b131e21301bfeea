"""Find out which part of a document stands at a line and column of its file."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from typing import NamedTuple

from codegen.hfsm.document import Document

from .places import Place, Spot, spots

__all__ = ["Located", "Locator"]


class Located(NamedTuple):
    """A place, with line and column in the text there, from 1; 0 for an element as a whole."""

    place: Place
    line: int
    column: int


class Locator:
    """The way back from the lines of a file to the parts of the document that was read from it."""

    def __init__(self, document: Document) -> None:
        self._spots: list[Spot] = []
        self._starts: list[tuple[int, int]] = []
        found = sorted(_owned(document), key=lambda item: (item[0].line, item[0].column))
        self._owners: list[Place] = []
        for spot, owner in found:
            self._spots.append(spot)
            self._starts.append((spot.line, spot.column))
            self._owners.append(owner)

    def find(self, line: int, column: int) -> Located | None:
        """Return what stands at a place of the file, or None before the first known thing."""
        index = bisect_right(self._starts, (line, column)) - 1
        if index < 0:
            return None
        spot = self._spots[index]
        if spot.text is None:
            return Located(spot.place, 0, 0)
        inside = line - spot.line
        if inside > spot.text.count("\n"):
            # Behind this text stands something that the document does not name.
            return Located(self._owners[index], 0, 0)
        return Located(spot.place, inside + 1, column - spot.column + 1 if inside == 0 else column)


def _owned(document: Document) -> Iterator[tuple[Spot, Place]]:
    """Yield the spots that have a place in the file, each with the element that it belongs to."""
    element = Place(kind="document")
    for spot in spots(document):
        if spot.text is None:
            element = spot.place
        is_about_automaton = spot.place.kind == "automaton" and spot.place.part != "inputs"
        owner = Place(kind="automaton", automaton=spot.place.automaton) if is_about_automaton else element
        if spot.line:
            yield spot, owner
