"""Put names beside their handles so that none covers another name, a handle or a state.

Each name tries some places around its handle, the best first, and takes the first that is free.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from .arcs import RADIUS, Box

HANDLE: Final = 9.0
"""Radius of the sign of a transition."""

_CELL: Final = 96.0
_GAP: Final = 5.0
_STATE: Final = RADIUS * 1.76
"""Side of the square of a state that names leave free."""
_STEEP: Final = 1e-6
_DIAGONALS: Final = (0.7 - 0.7j, -0.7 - 0.7j, 0.7 + 0.7j, -0.7 + 0.7j)


@dataclass(frozen=True, slots=True)
class Label:
    """A name of some size in pixels, which belongs to a handle; `normal` points to the best side for it."""

    handle: complex
    normal: complex
    width: float
    height: float

    def beside(self, direction: complex, far: float = 0.0) -> complex:
        """Return its middle when it stands in some direction of its handle, and just does not touch it."""
        across, down = abs(direction.real), abs(direction.imag)
        room = HANDLE + _GAP
        reach = min(
            (self.width / 2 + room) / across if across > _STEEP else math.inf,
            (self.height / 2 + room) / down if down > _STEEP else math.inf,
        )
        return self.handle + direction * (reach + far)


class _Boxes:
    """A set of boxes that knows quickly whether another one overlaps any of them."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], list[Box]] = {}

    def add(self, box: Box) -> None:
        for cell in _cells(box):
            self._cells.setdefault(cell, []).append(box)

    def covered(self, box: Box) -> float:
        """Return the area of a box that others cover, in square pixels; overlaps count twice."""
        near = {id(each): each for cell in _cells(box) for each in self._cells.get(cell, ())}
        area = 0.0
        for other in near.values():
            width = min(box.right, other.right) - max(box.left, other.left)
            height = min(box.bottom, other.bottom) - max(box.top, other.top)
            area += max(0.0, width) * max(0.0, height)
        return area


def place_labels(labels: Sequence[Label], states: Iterable[complex]) -> list[complex]:
    """Return the middle of each label, given the middles of the states; labels without a size stay away."""
    taken = _Boxes()
    for state in states:
        taken.add(Box.around(state, _STATE, _STATE))
    for label in labels:
        taken.add(Box.around(label.handle, HANDLE * 2, HANDLE * 2))
    found: list[complex] = []
    for label in labels:
        place = _best_place(label, taken)
        if label.width:
            taken.add(Box.around(place, label.width, label.height))
        found.append(place)
    return found


def _best_place(label: Label, taken: _Boxes) -> complex:
    best, least = label.handle, math.inf
    for direction in _directions(label.normal):
        for far in (0.0, label.height):
            place = label.beside(direction, far)
            cover = taken.covered(Box.around(place, label.width, label.height))
            if cover == 0.0:
                return place
            if cover < least:
                best, least = place, cover
    return best


def _directions(normal: complex) -> tuple[complex, ...]:
    """Return where a label may stand, the best first."""
    down = 1j if normal.imag > 0 else -1j
    right = -1.0 + 0j if normal.real < 0 else 1.0 + 0j
    return (normal, down, right, -down, -right, *_DIAGONALS, -normal)


def _cells(box: Box) -> Iterator[tuple[int, int]]:
    columns = range(math.floor(box.left / _CELL), math.floor(box.right / _CELL) + 1)
    rows = range(math.floor(box.top / _CELL), math.floor(box.bottom / _CELL) + 1)
    return ((column, row) for column in columns for row in rows)
