"""Put names beside their handles, apart from other names, handles, states, arcs, notes and titles of frames.

Each name tries some places around its handle, the best first, and takes the first that is free and nearer to
no other handle: at its full length, or else shortened.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from .arcs import RADIUS, Arc, Box

HANDLE: Final = 9.0
"""Radius of the sign of a transition."""

_CELL: Final = 96.0
_MOST_CELLS: Final = 1024
"""A box that touches more is looked at each time."""
_GAP: Final = 5.0
_CIRCLE: Final = ((2 * RADIUS + 4, RADIUS), (RADIUS, 2 * RADIUS + 4), (1.6 * RADIUS, 1.6 * RADIUS))
"""Width and height of boxes that together are about a state's circle."""
_STEP: Final = 12.0
"""Pixels between two points of an arc."""
_CROSSED: Final = 72.0
"""A point of an arc in a label, or a handle nearer to it, is as bad as so many covered square pixels."""
_MANY: Final = 400
"""Of more arcs, none is avoided."""
_LANDSCAPE: Final = 1.5
"""Width to height of the room of long labels, unless the states take a wider one."""
_BESIDE: Final = 40.0
"""Pixels beside the outermost states where long labels may stand."""
_STEEP: Final = 1e-6
_DIAGONALS: Final = (0.7 - 0.7j, -0.7 - 0.7j, 0.7 + 0.7j, -0.7 + 0.7j)


class Size(NamedTuple):
    """The size of a label in pixels."""

    width: float
    height: float


class Placed(NamedTuple):
    """Where a label stands: its middle, and the index of its size."""

    middle: complex
    size: int


@dataclass(frozen=True, slots=True)
class Label:
    """A name that belongs to a handle, with the sizes that it may have, the largest first.

    `normal` points to the best side for it. A name without a text has no sizes.
    """

    handle: complex
    normal: complex
    sizes: tuple[Size, ...]

    def places(self, size: Size) -> Iterator[complex]:
        """Yield the middles it may have, the best first: beside its handle, across corners, then further."""
        directions = _directions(self.normal)
        for direction in directions:
            yield self._beside(direction, size, 0.0)
        across, down = size.width / 2 + HANDLE + _GAP, size.height / 2 + _GAP
        for corner in (
            complex(across, -down),
            complex(across, down),
            complex(-across, -down),
            complex(-across, down),
        ):
            yield self.handle + corner
        for direction in directions:
            yield self._beside(direction, size, size.height)

    def last_places(self, size: Size) -> Iterator[complex]:
        """Yield the middles that it may have where all others are taken."""
        for direction in _directions(self.normal):
            yield self._beside(direction, size, 2 * size.height)

    def _beside(self, direction: complex, size: Size, far: float) -> complex:
        """Return its middle when it stands in some direction of its handle, and just does not touch it."""
        across, down = abs(direction.real), abs(direction.imag)
        room = HANDLE + _GAP
        reach = min(
            (size.width / 2 + room) / across if across > _STEEP else math.inf,
            (size.height / 2 + room) / down if down > _STEEP else math.inf,
        )
        return self.handle + direction * (reach + far)


class _Boxes:
    """A set of boxes that knows quickly whether another one overlaps any of them."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], list[Box]] = {}
        self._large: list[Box] = []

    def add(self, box: Box) -> None:
        columns, rows = (box.right - box.left) / _CELL + 1, (box.bottom - box.top) / _CELL + 1
        if columns * rows > _MOST_CELLS:
            self._large.append(box)
            return
        for cell in _cells(box):
            self._cells.setdefault(cell, []).append(box)

    def covered(self, box: Box) -> float:
        """Return the area of a box that others cover, in square pixels; overlaps count twice."""
        near = {id(each): each for cell in _cells(box) for each in self._cells.get(cell, ())}
        area = 0.0
        for other in (*self._large, *near.values()):
            width = min(box.right, other.right) - max(box.left, other.left)
            height = min(box.bottom, other.bottom) - max(box.top, other.top)
            area += max(0.0, width) * max(0.0, height)
        return area


class _Points:
    """A set of points that knows quickly how many of them are in a box."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], list[complex]] = {}

    def add(self, point: complex) -> None:
        cell = (math.floor(point.real / _CELL), math.floor(point.imag / _CELL))
        self._cells.setdefault(cell, []).append(point)

    def within(self, box: Box) -> int:
        return sum(
            box.left < point.real < box.right and box.top < point.imag < box.bottom
            for cell in _cells(box)
            for point in self._cells.get(cell, ())
        )


class _Around(NamedTuple):
    """What a label may cover, what may cross it, and the handles of all."""

    taken: _Boxes
    crossed: _Points
    handles: _Points

    def cover(self, label: Label, box: Box, most: float = math.inf) -> float:
        """Return how bad a place is: how much it covers and, unless that is too much, what else is wrong.

        That are the arcs that cross it, and the other handles that are nearer, which would seem to have it.
        """
        cover = self.taken.covered(box)
        if cover >= most:
            return cover
        x, y = label.handle.real, label.handle.imag
        far = max(box.left - x, x - box.right, box.top - y, y - box.bottom) - 1
        nearer = Box(box.left - far, box.top - far, box.right + far, box.bottom + far)
        return cover + _CROSSED * (self.crossed.within(box) + self.handles.within(nearer))


def place_labels(
    labels: Sequence[Label],
    states: Sequence[complex],
    arcs: Sequence[Arc] = (),
    *,
    occupied: Iterable[Box] = (),
) -> list[Placed | None]:
    """Return where each label stands, given the middles of the states; None for one without sizes.

    `occupied` are boxes with other words.
    """
    taken, crossed, handles = _Boxes(), _Points(), _Points()
    for label in labels:
        handles.add(label.handle)
    for box in occupied:
        taken.add(box)
    for state in states:
        for width, height in _CIRCLE:
            taken.add(Box.around(state, width, height))
    for label in labels:
        taken.add(Box.around(label.handle, HANDLE * 2, HANDLE * 2))
    if len(arcs) <= _MANY:
        for arc in arcs:
            for point in arc.points(_STEP):
                crossed.add(point)
    room = _room(states)
    found: list[Placed | None] = []
    for label in labels:
        placed = _best_place(label, _Around(taken, crossed, handles), room) if label.sizes else None
        if placed is not None:
            taken.add(Box.around(placed.middle, *label.sizes[placed.size]))
        found.append(placed)
    return found


def _best_place(label: Label, around: _Around, room: Box) -> Placed:
    """Return a place that nothing else takes, or else the one of the smallest size that covers the least."""
    last = len(label.sizes) - 1
    best, least = Placed(label.handle, last), math.inf
    for index, size in enumerate(label.sizes):
        for middle in label.places(size):
            box = Box.around(middle, *size)
            if index < last and (box.left < room.left or box.right > room.right):
                continue
            cover = around.cover(label, box, least)
            if cover == 0.0:
                return Placed(middle, index)
            if index == last and cover < least:
                best, least = Placed(middle, index), cover
    size = label.sizes[last]
    places = label.last_places(size)
    free = (each for each in places if not around.cover(label, Box.around(each, *size)))
    return next((Placed(middle, last) for middle in free), best)


def _room(states: Sequence[complex]) -> Box:
    """Return where long labels may stand, so that a picture is not much larger than one without them."""
    box = Box.of(states or (0j,))
    far = RADIUS + _BESIDE
    high, wide = box.bottom - box.top + 2 * far, box.right - box.left + 2 * far
    missing = max(0.0, high * _LANDSCAPE - wide) / 2
    return Box(box.left - far - missing, -math.inf, box.right + far + missing, math.inf)


def _directions(normal: complex) -> tuple[complex, ...]:
    """Return where a label may stand, the best first."""
    down = 1j if normal.imag > 0 else -1j
    right = -1.0 + 0j if normal.real < 0 else 1.0 + 0j
    return (normal, down, right, -down, -right, *_DIAGONALS, -normal)


def _cells(box: Box) -> Iterator[tuple[int, int]]:
    columns = range(math.floor(box.left / _CELL), math.floor(box.right / _CELL) + 1)
    rows = range(math.floor(box.top / _CELL), math.floor(box.bottom / _CELL) + 1)
    return ((column, row) for column in columns for row in rows)
