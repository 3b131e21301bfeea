"""The arcs of transitions. Points are complex numbers: x + y j, in pixels, y downwards."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Mapping
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
"""The name of an arc whose handle is nearer to the line between both states stands above it."""
_UPRIGHT: Final = 0.2
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

    def covered(self, other: Box) -> float:
        """Return how many square pixels of it another one covers."""
        wide = min(self.right, other.right) - max(self.left, other.left)
        high = min(self.bottom, other.bottom) - max(self.top, other.top)
        return max(0.0, wide) * max(0.0, high)

    def united(self, other: Box) -> Box:
        """Return the smallest rectangle with both."""
        return Box(
            min(self.left, other.left),
            min(self.top, other.top),
            max(self.right, other.right),
            max(self.bottom, other.bottom),
        )


class Arc(NamedTuple):
    """A line from rim to rim with its arrow: `path` and `head` are data of SVG paths.

    `handle` is the point on it where its sign is, `normal` the best side for its name, and `rank` the place
    of its number among the transitions out of its state.
    """

    path: str
    head: str
    handle: complex
    normal: complex
    rank: complex
    box: Box


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
    across = _unit(destination - origin) * 1j
    offset = ((handle - (origin + destination) / 2) * across.conjugate()).real
    if abs(offset) < _STRAIGHT:
        outside = 1 + 0j if abs(across.imag) < _UPRIGHT else across * -math.copysign(1.0, across.imag)
    else:
        outside = across * math.copysign(1.0, offset)
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
    )


def handles(transitions: Iterable[Transition], places: Mapping[int, complex]) -> list[complex]:
    """Return the handle of each transition, given the places of states.

    Each is where the file has it, or else halfway, but none where another one is: then in a fan between two
    states, around a state for loops.
    """
    found: dict[str, complex] = {}
    for number, transition in enumerate(transitions):
        origin = places.get(transition.origin, places.get(transition.destination, 0j))
        destination = places.get(transition.destination, origin)
        is_loop = abs(destination - origin) < 1
        usual = origin - LOOP * 1j if is_loop else (origin + destination) / 2
        wanted = place(transition) if transition.x or transition.y else usual
        across = _unit(destination - origin) * 1j * (-1 if transition.origin > transition.destination else 1)
        for turn in range(_TRIES):
            handle = wanted + across * FAN * math.ceil(turn / 2) * (1 if turn % 2 else -1)
            if is_loop:
                handle = origin + (wanted - origin) * cmath.rect(1 + turn // 6 / 2, turn * math.pi / 3)
            if _at(handle) not in found:
                break
        found[_at(handle) if _at(handle) not in found else str(number)] = handle
    return [*found.values()]


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


def _at(point: complex) -> str:
    return f"{pixels(point.real)},{pixels(point.imag)}"
