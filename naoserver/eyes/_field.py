"""What a picture shows of a soccer field: places on lines, where lines cross, and posts of goals."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations
from typing import Final, NamedTuple

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

# -- crossings
_CELL: Final = 0.03
"""Distance in m from a line up to which points are on it."""
_TURNS: Final = 60
"""Directions of lines that are tried."""
_ENOUGH: Final = 6
"""Fewest points on a line."""
_MOST_STRAIGHT: Final = 6
"""Most lines in a picture."""
_CROSSES: Final = 3.0
"""Distance in m up to which lines are seen to cross."""
_SHORTEST: Final = 0.2
"""Length in m of the shortest line."""
_SQUARE: Final = math.radians(75.0)
"""Least angle between lines that cross."""
_REACH: Final = 0.3
"""Distance in m from its ends up to which a line may cross another."""
_ARMS: Final = 0.1, 0.14, 0.18
"""Distances in m from a crossing at which a line that goes on is white."""
_SAME: Final = 0.3
"""Distance in m within which two crossings are one."""
_NAMES: Final = {4: "X", 3: "T", 2: "L"}

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


class _Line(NamedTuple):
    begin: Array
    end: Array

    @property
    def way(self) -> Array:
        return np.asarray((self.end - self.begin) / np.linalg.norm(self.end - self.begin))


def find_lines(shot: Shot, grass: Grass, width: float) -> tuple[Array, Iterator[Found]]:
    """Return places on lines `width` m wide, x and y in m in the robot's frame, and some of them as found."""
    points = _line_points(grass.green, grass.white, shot.to_floor, width)
    some = points[:: 1 + len(points) // _MOST_LINES]
    return points, (_on_floor(shot, "line", "", 0.8, point) for point in some)


def _on_floor(shot: Shot, kind: str, name: str, certainty: float, point: Array) -> Found:
    place = np.array((*point, 0.0))
    return Found(Thing(kind, name, certainty, error=shot.error_on_floor(place)), place, place)


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


def find_crossings(shot: Shot, grass: Grass, points: Array) -> Iterator[Found]:
    """Yield where straight lines through points cross, if the picture shows how."""
    found: list[Array] = []
    for first, second in combinations(_straight(points), 2):
        if abs(float(first.way @ second.way)) > math.cos(_SQUARE):
            continue
        along = np.linalg.solve(np.column_stack((first.way, -second.way)), second.begin - first.begin)
        lengths = [np.linalg.norm(line.end - line.begin) for line in (first, second)]
        if not all(-_REACH < at < length + _REACH for at, length in zip(along, lengths, strict=True)):
            continue
        place = first.begin + along[0] * first.way
        if any(np.linalg.norm(place - other) < _SAME for other in found):
            continue
        name = _kind_of(shot, grass, place, first.way, second.way)
        if name:
            found.append(place)
            yield _on_floor(shot, "crossing", name, 0.8, place)


def _straight(points: Array) -> list[_Line]:
    """Return straight lines through points on the floor, those with the most points first."""
    left = points[np.hypot(*points.T) < _CROSSES]
    angles = np.arange(_TURNS) * math.pi / _TURNS
    normals = np.stack((np.cos(angles), np.sin(angles)))
    found: list[_Line] = []
    while len(left) >= _ENOUGH and len(found) < _MOST_STRAIGHT:
        cells = np.rint(left @ normals / _CELL).astype(int)
        cells -= cells.min()
        votes = np.zeros((cells.max() + 1, _TURNS), int)
        np.add.at(votes, (cells, np.arange(_TURNS)), 1)
        offset, turn = np.unravel_index(votes.argmax(), votes.shape)
        on = np.abs(cells[:, turn] - offset) <= 1
        if np.count_nonzero(on) < _ENOUGH:
            break
        middle = left[on].mean(axis=0)
        _, _, (way, _) = np.linalg.svd(left[on] - middle)
        along = (left - middle) @ way
        on |= np.abs((left - middle) @ (-way[1], way[0])) < _CELL
        begin, end = (middle + each * way for each in (along[on].min(), along[on].max()))
        if np.linalg.norm(end - begin) > _SHORTEST:
            found.append(_Line(begin, end))
        left = left[~on]
    return found


def _kind_of(shot: Shot, grass: Grass, place: Array, first: Array, second: Array) -> str:
    """Return how lines cross at a place, L, T or X, by which of four arms are white; empty if unknown."""
    arms = []
    bright = cv2.dilate(grass.white.view(np.uint8), np.ones((3, 3), np.uint8))
    for way in (first, -first, second, -second):
        pixels = shot.pixels_of(np.array([(*(place + far * way), 0.0) for far in _ARMS]))
        if np.isnan(pixels).any():
            return ""
        u, v = np.rint(pixels).astype(int).T
        height, width = grass.white.shape
        if u.min() < 0 or v.min() < 0 or u.max() >= width or v.max() >= height:
            return ""
        white, green = np.count_nonzero(bright[v, u]), np.count_nonzero(grass.green[v, u])
        if max(white, green) < len(_ARMS) - 1:
            return ""
        arms.append(bool(white >= green))
    if not (arms[0] or arms[1]) or not (arms[2] or arms[3]):
        return ""
    return _NAMES[sum(arms)]


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
    gray = cv2.cvtColor(shot.pixels, cv2.COLOR_RGB2GRAY).astype(np.float64)
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
