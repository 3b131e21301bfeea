"""The arcs of transitions. Points are complex numbers: x + y j, in pixels, y downwards."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from codegen.hfsm.document import State, Transition
from visualhfsm._document.geometry import FAN, LOOP
from visualhfsm._document.nodes import FARTHEST_PLACE

from .elements import pixels

RADIUS: Final = 40.0
"""Radius of a state's circle."""
_TRIES: Final = 9
"""Places that a handle may have where others are."""

_HEAD_LENGTH: Final = 10.0
_HEAD_WIDTH: Final = 4.5
_GAP: Final = 2.0
"""Pixels between the tip of an arrow and the circle to which it points."""
_STRAIGHT: Final = 3.0
"""An arc whose handle is nearer to the line between both states is straight."""
_FAR_FROM_RIM: Final = 20.0
_BESIDE_ARC: Final = 9.0
_LOOP_OPENING: Final = 0.34
"""Radians between each end of a loop and its axis."""
_LOOP_WIDTH: Final = RADIUS * 0.62
_UP: Final = -1j


class Box(NamedTuple):
    """A rectangle of the picture."""

    left: float
    top: float
    right: float
    bottom: float

    @classmethod
    def around(cls, middle: complex, width: float, height: float) -> Box:
        """Return the rectangle of a size with its middle at a point."""
        return cls(
            middle.real - width / 2,
            middle.imag - height / 2,
            middle.real + width / 2,
            middle.imag + height / 2,
        )

    @classmethod
    def of(cls, points: Iterable[complex]) -> Box:
        """Return the smallest rectangle with all points, of which there is at least one."""
        known = list(points)
        xs = [point.real for point in known]
        ys = [point.imag for point in known]
        return cls(min(xs), min(ys), max(xs), max(ys))

    def united(self, other: Box) -> Box:
        """Return the smallest rectangle with both."""
        return Box(
            min(self.left, other.left),
            min(self.top, other.top),
            max(self.right, other.right),
            max(self.bottom, other.bottom),
        )


@dataclass(frozen=True, slots=True)
class Arc:
    """A line from rim to rim with its arrow: `path` and `head` are data of SVG paths.

    `handle` is the point on it where its sign is, `normal` the best side for its name, and `rank` the place
    of its number among the transitions out of its state. `start` and `end` are its ends at two rims.
    """

    path: str
    head: str
    handle: complex
    normal: complex
    rank: complex
    box: Box
    start: complex | None = None
    end: complex | None = None

    def points(self, step: float) -> Iterator[complex]:
        """Yield points of it, at most so many pixels apart; none where it has only one end."""
        if self.start is None or self.end is None:
            return
        control = 2 * self.handle - (self.start + self.end) / 2
        count = math.ceil((abs(self.handle - self.start) + abs(self.end - self.handle)) / step)
        for index in range(count + 1):
            part = index / count if count else 0.0
            yield (1 - part) ** 2 * self.start + 2 * part * (1 - part) * control + part**2 * self.end


def place(node: State | Transition) -> complex:
    """Return the place of a state's middle or a transition's handle, no farther away than the canvas goes."""
    return complex(*(max(-FARTHEST_PLACE, min(FARTHEST_PLACE, value)) for value in (node.x, node.y)))


def arc(origin: complex | None, destination: complex | None, handle: complex, *, is_loop: bool) -> Arc:
    """Return the arc through a handle, between the middles of two states.

    A state is None where an invalid document has none.
    """
    if origin is None or destination is None:
        return _stub(origin, destination, handle)
    if is_loop or abs(destination - origin) < 1:
        return _loop(origin, handle)
    middle = (origin + destination) / 2
    along = destination - origin
    across = _unit(along) * 1j
    offset = _dot(handle - middle, across)
    beside = abs(_dot(handle - middle, _unit(along)))
    if abs(offset) < _STRAIGHT and beside < abs(along) / 2 - RADIUS:
        return _straight(origin, destination, handle)
    return _bent(origin, destination, handle, across * (math.copysign(1.0, offset) if offset else 1.0))


def handles(transitions: Iterable[Transition], places: Mapping[int, complex]) -> list[complex]:
    """Return the handle of each transition, given the places of states.

    Each is where the file has it, or else halfway, but none where another one is: then in a fan between two
    states, around a state for loops.
    """
    found: list[complex] = []
    taken: set[str] = set()
    following: dict[str, int] = {}
    for transition in transitions:
        origin = places.get(transition.origin, places.get(transition.destination, 0j))
        destination = places.get(transition.destination, origin)
        is_loop = abs(destination - origin) < 1
        usual = origin - LOOP * 1j if is_loop else (origin + destination) / 2
        wanted = place(transition) if transition.x or transition.y else usual
        across = _unit(destination - origin) * 1j * (-1 if transition.origin > transition.destination else 1)
        first = following.get(_at(wanted), 0)
        for number in range(first, first + _TRIES):
            handle = wanted + across * FAN * math.ceil(number / 2) * (1 if number % 2 else -1)
            if is_loop:
                handle = origin + (wanted - origin) * cmath.rect(1 + number // 6 / 2, number * math.pi / 3)
            following[_at(wanted)] = number + 1
            if _at(handle) not in taken:
                break
        taken.add(_at(handle))
        found.append(handle)
    return found


def _straight(origin: complex, destination: complex, handle: complex) -> Arc:
    along = _unit(destination - origin)
    across = along * 1j
    start = origin + along * RADIUS
    tip = destination - along * (RADIUS + _GAP)
    end = destination - along * (RADIUS + _HEAD_LENGTH)
    is_upright = abs(across.imag) < 0.2
    return Arc(
        path=f"M{_at(start)}L{_at(end)}",
        head=_head(tip, along),
        handle=handle,
        normal=1 + 0j if is_upright else across * -math.copysign(1.0, across.imag),
        rank=start + along * _FAR_FROM_RIM + across * _BESIDE_ARC,
        box=Box.of((start, tip, handle)),
        start=start,
        end=tip,
    )


def _bent(origin: complex, destination: complex, handle: complex, outside: complex) -> Arc:
    # The control point that would make a curve between the middles pass through the handle gives the rims.
    bend = 2 * handle - (origin + destination) / 2
    start = origin + _unit(bend - origin) * RADIUS
    toward = _unit(bend - destination)
    tip = destination + toward * (RADIUS + _GAP)
    end = destination + toward * (RADIUS + _HEAD_LENGTH - 1)
    control = 2 * handle - (start + end) / 2
    return Arc(
        path=f"M{_at(start)}Q{_at(control)} {_at(end)}",
        head=_head(tip, _unit(tip - end)),
        handle=handle,
        normal=outside,
        rank=start + _unit(control - start) * _FAR_FROM_RIM - outside * _BESIDE_ARC,
        box=Box.of((start, tip, handle, (handle + control) / 2)),
        start=start,
        end=tip,
    )


def _loop(state: complex, handle: complex) -> Arc:
    axis = handle - state
    normal = _UP if abs(axis) < 2 else _unit(axis)
    left, right = (normal * cmath.rect(1.0, angle) for angle in (-_LOOP_OPENING, _LOOP_OPENING))
    start = state + left * RADIUS
    tip = state + right * (RADIUS + _GAP)
    end = state + right * (RADIUS + _HEAD_LENGTH - 1)
    # The middle of a cubic is 1/8, 3/8, 3/8, 1/8 of its points; it must be the handle.
    middle = (8 * handle - start - end) / 6
    first = middle - normal * 1j * _LOOP_WIDTH
    second = middle + normal * 1j * _LOOP_WIDTH
    return Arc(
        path=f"M{_at(start)}C{_at(first)} {_at(second)} {_at(end)}",
        head=_head(tip, -right),
        handle=handle,
        normal=normal,
        rank=state + normal * (RADIUS + _FAR_FROM_RIM),
        box=Box.of((start, tip, handle, first, second)),
        start=start,
        end=tip,
    )


def _stub(origin: complex | None, destination: complex | None, handle: complex) -> Arc:
    """Return the arc of a transition that lacks an end."""
    if origin is not None:
        start = origin + _unit(handle - origin) * RADIUS
        path = f"M{_at(start)}L{_at(handle)}"
        return Arc(path, "", handle, _UP, start, Box.of((start, handle)))
    if destination is not None:
        tip = destination + _unit(handle - destination) * (RADIUS + _GAP)
        path = f"M{_at(handle)}L{_at(tip)}"
        head = _head(tip, _unit(tip - handle))
        return Arc(path, head, handle, _UP, handle, Box.of((handle, tip)))
    return Arc("", "", handle, _UP, handle, Box.of((handle,)))


def _head(tip: complex, along: complex) -> str:
    """Return the head of an arrow that flies along a direction."""
    back = tip - along * _HEAD_LENGTH
    side = along * 1j * _HEAD_WIDTH
    return f"M{_at(tip)}L{_at(back + side)}L{_at(back - side)}Z"


def _unit(vector: complex) -> complex:
    return vector / (abs(vector) or 1.0)


def _dot(one: complex, other: complex) -> float:
    return (one * other.conjugate()).real


def _at(point: complex) -> str:
    return f"{pixels(point.real)},{pixels(point.imag)}"
