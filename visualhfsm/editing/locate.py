"""Find out which part of a document stands at a line and column of its file, or in a line that failed."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from typing import Final, NamedTuple

from codegen.hfsm.document import Document

from .places import Place, Spot, spots

__all__ = ["Located", "Locator"]

_CODE: Final = frozenset(
    ("argument", "code", "entry", "exit", "fired", "functions", "guard", "trigger", "variables")
)
"""The parts that hold code."""


class Located(NamedTuple):
    """A place, with line and column in the text there, from 1; 0 for an element as a whole."""

    place: Place
    line: int
    column: int


class Locator:
    """The way back from the lines of a file to the parts of the document that was read from it."""

    def __init__(self, document: Document) -> None:
        self._document = document
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

    def find_code(
        self, line: int, *, code: str = "", part: str = "", automaton: int = 0, state: int = 0
    ) -> Located | None:
        """Return the piece of code that has a line of the file, or None when there is none in it.

        Several pieces may share a line. Then the one counts that holds the text `code` there, is the `part`,
        and belongs to the `automaton` and to its `state`, or to a transition at that one, as far as those are
        known; what comes first decides.
        """
        found = [spot for spot in self._spots if _has_code(spot, line)]
        if not found:
            return None
        wanted = " ".join(code.split())
        near = self._near(automaton, state) if len(found) > 1 else frozenset()

        def likeness(spot: Spot) -> tuple[bool, ...]:
            assert spot.text is not None
            place = spot.place
            written = " ".join(spot.text.split("\n")[line - spot.line].split())
            return (
                bool(wanted) and wanted == written,
                bool(written) and written in wanted,
                place.part == part,
                place.automaton == automaton,
                (place.kind, place.id) in near,
                bool(written),
            )

        best = max(found, key=likeness)  # the first of those that are alike
        return Located(best.place, line - best.line + 1, 0)

    def _near(self, automaton: int, state: int) -> frozenset[tuple[str, int]]:
        """Return a state and the transitions that leave or enter it, as kinds and ids of places."""
        source = self._document.automaton(automaton)
        transitions = () if source is None else source.transitions
        ends = (("transition", each.id) for each in transitions if state in (each.origin, each.destination))
        return frozenset((("state", state), *ends))


def _has_code(spot: Spot, line: int) -> bool:
    if spot.text is None or spot.place.part not in _CODE or not spot.text:
        return False
    return spot.line <= line <= spot.line + spot.text.count("\n")


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
