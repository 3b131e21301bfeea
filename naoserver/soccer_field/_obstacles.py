"""Where something stands on the field and hides it, such as a robot or a ball, as one picture shows it."""

from __future__ import annotations

from typing import Final, NamedTuple

import cv2
import numpy as np

from naoserver.soccer_field._panorama import HEIGHT, Mask
from naoserver.soccer_field.model import Array

_STEP: Final = 4
"""Pixels from one searched column to the next."""
_LONGEST: Final = 0.25
"""Length in m on the floor along a column from which what is no grass is no line that is crossed."""
_PATCH: Final = 4
"""Width in pixels of the least patch of another color: the edge of a line blurs."""
_COLORED: Final = 0.08
"""Share of other colors from which it is no line that is seen along."""
_TALL: Final = 0.15
"""Height in m from which something has feet, for a camera at the usual height: a ball is lower."""
_AROUND: Final = 3
"""Searched columns to both sides that what stands hides as well: its edges blur."""


class Standing(NamedTuple):
    """What stands on the field in one picture."""

    hidden: Mask
    """Which pixels it hides, as far as they would show the floor; those above the horizon may count as such."""
    feet: Array
    """Where what is taller than a ball stands, x and y in m in the robot's frame, a row for each column that shows some of it."""


def find_standing(grass: Mask, white: Mask, to_floor: Array) -> Standing:
    """Return what stands on the field, given which pixels are of grass or white.

    `to_floor` leads from pixels to x, y, 1 on the floor.
    """
    height, width = grass.shape
    columns = np.arange(_STEP // 2, width, _STEP)
    other = ~grass[:, columns].T
    patches = cv2.morphologyEx((~grass & ~white).astype(np.uint8), cv2.MORPH_OPEN, np.ones((_PATCH, _PATCH), np.uint8))
    colored = np.cumsum(np.pad(patches[:, columns].T.astype(np.int64), ((0, 0), (1, 0))), axis=1)
    edges = np.diff(other.astype(np.int8), axis=1, prepend=np.int8(0), append=np.int8(0))
    (at, begin), (_, end) = np.nonzero(edges == 1), np.nonzero(edges == -1)
    horizon = -(to_floor[2, 0] * columns + to_floor[2, 2]) / to_floor[2, 1]  # there the third number is 0
    begin = np.maximum(begin, np.ceil(horizon[at]).astype(int) + 1)
    low = end > begin
    at, begin, end = at[low], begin[low], end[low]
    own = end == height
    colored = colored[at, end] - colored[at, begin] > _COLORED * (end - begin)
    far, near = (_floor(to_floor, columns[at], rows) for rows in (begin, end))
    # What the picture cuts off may be as long as it likes.
    stands = colored & (own | (begin == 0) | (np.hypot(*(far - near).T) > _LONGEST))
    first, last = np.full(len(columns), height), np.zeros(len(columns), np.int64)
    np.minimum.at(first, at[stands & own], begin[stands & own])
    np.maximum.at(last, at[stands & ~own], end[stands & ~own])
    rows = np.arange(height)[:, None]
    hidden = (rows < _spread(last, width)) | (rows >= height - _spread(height - first, width))
    tall = HEIGHT * (1.0 - np.hypot(*near.T) / np.hypot(*far.T)) > _TALL
    return Standing(hidden, near[stands & tall & (end == last[at])])


def _spread(rows: Array, width: int) -> Array:
    """Return numbers for all columns from those of the searched ones: the largest near by."""
    wide = np.pad(rows, _AROUND)
    spread = np.max([wide[each : each + len(rows)] for each in range(2 * _AROUND + 1)], axis=0)
    return np.repeat(spread, _STEP)[:width]


def _floor(to_floor: Array, columns: Array, rows: Array) -> Array:
    x, y, front = to_floor @ (columns, rows, np.ones(len(rows)))
    return np.asarray(np.column_stack((x, y)) / front[:, None])
