"""Where something stands on the field and hides it, such as a robot or a ball, as one picture shows it."""

from __future__ import annotations

from typing import Final, NamedTuple

import cv2
import numpy as np

from naoserver.bodies.sight import Array, Mask
from naoserver.eyes._shot import Numbers, horizon_of, on_floor, runs_of

_STEP: Final = 4
"""Pixels from one searched column to the next."""
_LONGEST: Final = 0.25
"""Length in m on the floor along a column from which what is no grass is no line that is crossed."""
_PATCH: Final = 4
"""Width in pixels of the least patch of another color: the edge of a line blurs."""
_COLORED: Final = 0.08
"""Share of other colors from which it is no line that is seen along."""
_TALL: Final = 0.2
"""Height in m from which something has feet: a ball seems lower."""
_AROUND: Final = 3
"""Searched columns to both sides that what stands hides as well: its edges blur."""


class Standing(NamedTuple):
    """What stands on the field in one picture."""

    hidden: Mask
    """Which pixels it hides, as far as they would show the floor, and some above it."""
    feet: Array
    """Where what is taller than a ball stands, x and y in m in the robot's frame, a row for each column."""


def find_standing(grass: Mask, white: Mask, to_floor: Array, eye: float) -> Standing:
    """Return what stands on the field, given which pixels are of grass or white.

    `to_floor` leads from pixels to x, y, 1 on the floor, `eye` is the height of the camera in m.
    """
    height, width = grass.shape
    columns = np.arange(_STEP // 2, width, _STEP)
    at, begin, end = runs_of(~grass[:, columns].T)
    begin = np.maximum(begin, np.ceil(horizon_of(to_floor, columns)[at]).astype(int) + 1)
    below = end > begin
    at, begin, end = at[below], begin[below], end[below]
    top, foot = (on_floor(to_floor, columns[at], rows) for rows in (begin, end))
    own = end == height  # the robot's own body; what the picture cuts off may be as long as it likes
    long = own | (begin == 0) | (np.hypot(*(top - foot).T) > _LONGEST)
    stands = long & _is_colored(~(grass | white), at, begin, end)
    own, other = stands & own, stands & ~own
    body, lowest = np.zeros(len(columns), np.int64), np.zeros(len(columns), np.int64)
    np.maximum.at(body, at[own], height - begin[own])
    np.maximum.at(lowest, at[other], end[other])
    rows = np.arange(height)[:, None]
    hidden = (rows < _spread(lowest, width)) | (rows >= height - _spread(body, width))
    tall = eye * (1.0 - np.hypot(*foot.T) / np.hypot(*top.T)) > _TALL
    return Standing(hidden, foot[other & tall & (end == lowest[at])])


def _is_colored(colored: Mask, at: Numbers, begin: Numbers, end: Numbers) -> Mask:
    """Return which runs have enough of other colors, in patches wider than the edge of a line."""
    square = np.ones((_PATCH, _PATCH), np.uint8)
    patches = cv2.morphologyEx(colored.view(np.uint8), cv2.MORPH_OPEN, square)[:, _STEP // 2 :: _STEP]
    counts = np.zeros((len(patches) + 1, patches.shape[1]), np.int64)
    np.cumsum(patches, axis=0, out=counts[1:])
    return np.asarray(counts[end, at] - counts[begin, at] > _COLORED * (end - begin))


def _spread(rows: Numbers, width: int) -> Numbers:
    """Return numbers for all columns from those of the searched ones: the largest near by."""
    wide = np.pad(rows, _AROUND)
    spread = np.max([wide[each : each + len(rows)] for each in range(2 * _AROUND + 1)], axis=0)
    return np.asarray(np.repeat(spread, _STEP)[:width])
