"""Runs of pixels in a picture, and where its pixels are on the floor.

`to_floor` leads from pixels to x, y, 1 on the floor, times a number that is positive below the horizon.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from naoserver.soccer_field import Array
from visualhfsm_match.localization._panorama import Mask

Numbers = NDArray[np.int64]


def runs_of(mask: Mask) -> tuple[Numbers, Numbers, Numbers]:
    """Return the row of each run along the rows of a mask, its first pixel, and the one after its last."""
    edges = np.diff(mask.astype(np.int8), axis=1, prepend=np.int8(0), append=np.int8(0))
    (at, begin), (_, end) = np.nonzero(edges == 1), np.nonzero(edges == -1)
    return at, begin, end


def on_floor(to_floor: Array, u: Array | Numbers, v: Array | Numbers) -> Array:
    """Return x and y of pixels on the floor, a row for each; NaN above the horizon."""
    x, y, front = to_floor @ (u, v, np.ones(len(u)))
    return np.asarray(np.column_stack((x, y)) / np.where(front > 0, front, np.nan)[:, None])


def horizon_of(to_floor: Array, columns: Numbers) -> Array:
    """Return the row of the horizon in columns."""
    return np.asarray(-(to_floor[2, 0] * columns + to_floor[2, 2]) / to_floor[2, 1])
