"""What a picture shows of a soccer field: places on lines, and posts of goals."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import cv2
import numpy as np

from naoserver.bodies.sight import Array, Mask, Thing
from naoserver.eyes._shot import Found, Grass, Shot, horizon_of, on_floor, runs_of

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

# -- posts
_BEYOND: Final = 30.0
"""Distance in m where a column shows no grass."""
_WIDEST: Final = 61
"""Columns within which there is grass beside a post."""
_NEARER: Final = 0.95
"""Distance at which the grass begins at a post, as a share of that beside it."""
_POST_WIDTHS: Final = 0.6, 1.7
"""Range of the width of a post as a share of the expected one."""
_HEIGHTS: Final = 0.3, 0.5, 0.7, 0.9
"""Shares of the height of the camera at which a post is looked at."""
_COLORLESS: Final = 90
"""Most saturation of a post, of 255."""
_CONTRAST: Final = 8.0
"""Least difference in brightness, of 255, at an edge of a post."""
_POST_MIDDLE: Final = 0.4
"""Height in m of the middle of a post."""


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


def find_posts(shot: Shot, grass: Grass, radius: float) -> Iterator[Found]:
    """Yield goalposts: narrow and upright, as wide as posts are where they stand on grass.

    A post hides the grass behind it, so the grass begins nearer in its columns than beside them.
    """
    height, width = grass.green.shape
    columns = np.arange(width)
    below = np.arange(height)[:, None] > horizon_of(shot.to_floor, columns)
    begins = (grass.green & below).argmax(axis=0)
    places = on_floor(shot.to_floor, columns, begins - 0.5)
    away = np.hypot(*(places - shot.eye[:2]).T)
    away[np.isnan(away) | (begins == 0)] = _BEYOND
    beside = cv2.morphologyEx(away[None].astype(np.float32), cv2.MORPH_CLOSE, np.ones((1, _WIDEST), np.uint8))
    _, starts, ends = runs_of(away[None] < _NEARER * beside)
    gray = cv2.cvtColor(cv2.blur(shot.pixels, (1, 3)), cv2.COLOR_RGB2GRAY).astype(np.float64)
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        foot = np.array((*np.median(places[start:end], axis=0), 0.0))
        far = float(np.median(away[start:end]))
        low, high = _POST_WIDTHS
        if not low < (end - start) * far / (2.0 * radius * shot.focal) < high or start == 0 or end == width:
            continue
        if _is_upright(shot, gray, foot, (end - start) / 2):
            thing = Thing("goalpost", "", 0.8, error=shot.error_on_floor(foot))
            yield Found(thing, np.array((*foot[:2], _POST_MIDDLE)), foot)


def _is_upright(shot: Shot, gray: Array, foot: Array, half: float) -> bool:
    """Return whether what stands at a place has edges and no color up to the height of the camera."""
    height, width = gray.shape
    heights = shot.eye[2] * np.array(_HEIGHTS)
    u, v = shot.pixels_of(foot + np.outer(heights, (0.0, 0.0, 1.0))).T
    rows = np.rint(v).astype(int)
    reach = half + 2.0
    if rows.min() < 0 or rows.max() >= height or u.min() < reach or u.max() > width - 1 - reach:
        return False
    middles = np.rint(u).astype(int)
    if shot.hsv[rows, middles, 1].max() > _COLORLESS:
        return False
    inner, outer = max(half - 1.0, 0.0), half + 1.5

    def at(aside: float) -> Array:
        return np.asarray(gray[rows, np.rint(u + aside).astype(int)])

    edges = [np.abs(at(side * outer) - at(side * inner)) for side in (-1, 1)]
    return bool(np.median(np.maximum(*edges)) > _CONTRAST)
