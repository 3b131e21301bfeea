"""What a picture shows of a soccer field: places on its lines."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from naoserver.bodies.sight import Array, Mask, Thing
from naoserver.eyes._shot import Found, Grass, Shot, on_floor, runs_of

_STEP: Final = 4
"""Pixels from one searched row or column to the next."""
_BESIDE: Final = 3
"""Pixels from the edge of a line to the place where grass is expected."""
_WIDTHS: Final = 0.4, 2.2
"""Range of a line's width across a row or column, as shares of its true width."""
_FARTHEST: Final = 4.0
"""Distance in m up to which places on lines are used."""
_MOST_LINES: Final = 30
"""Most places on lines in a picture."""


def find_lines(shot: Shot, grass: Grass, width: float) -> Iterator[Found]:
    """Yield places on the middle of lines `width` m wide."""
    points = _line_points(grass.green, grass.white, shot.to_floor, width)
    for x, y in points[:: 1 + len(points) // _MOST_LINES].tolist():
        place = np.array((x, y, 0.0))
        yield Found(Thing("line", "", 0.8, error=shot.error_on_floor(place)), place, place)


def _line_points(grass: Mask, white: Mask, to_floor: Array, width: float) -> Array:
    """Return points on the floor where a row or column of the picture crosses a line `width` m wide."""
    found = []
    for columns in (False, True):
        lawn, bright = (mask.T[::_STEP] if columns else mask[::_STEP] for mask in (grass, white))
        at, begin, end = runs_of(bright)
        after = np.minimum(end - 1 + _BESIDE, lawn.shape[1] - 1)
        crossed = lawn[at, np.maximum(begin - _BESIDE, 0)] & lawn[at, after]
        at = _STEP * at[crossed]
        first, last = begin[crossed] - 0.5, end[crossed] - 0.5
        floor = [
            on_floor(to_floor, *((at, along) if columns else (along, at)))
            for along in (first, last, (first + last) / 2)
        ]
        wide = np.hypot(*(floor[1] - floor[0]).T) / width
        near = np.hypot(*floor[2].T) < _FARTHEST
        found.append(floor[2][near & (wide > _WIDTHS[0]) & (wide < _WIDTHS[1])])
    return np.concatenate(found)
