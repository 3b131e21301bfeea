"""Support polygons: the convex outline of the soles that carry a robot, and the points within it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_MOST_STEPS: Final = 8
_CLOSE_ENOUGH: Final = 1e-6  # m


def convex_hull(points: Array) -> Array:
    """Return the corners of the convex hull of at least three points, shape (n, 2), counter-clockwise.

    Andrew's monotone chain: Inf. Process. Lett. 9 (1979).
    """
    ordered = sorted(map(tuple, points.tolist()))
    return np.array(_chain(ordered) + _chain(ordered[::-1]))


def _chain(points: Sequence[tuple[float, ...]]) -> list[tuple[float, ...]]:
    """Return one side of a hull, without its last corner."""
    side: list[tuple[float, ...]] = []
    for point in points:
        while len(side) > 1 and _turn(side[-2], side[-1], point) <= 0.0:
            side.pop()
        side.append(point)
    return side[:-1]


def _turn(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> float:
    """Return twice the area of a triangle, above 0 when its corners are counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def nearest_within(hull: Array, point: Array, margin: float) -> Array:
    """Return the point of a convex hull near `point` that is `margin` m from the edges, if it has room."""
    inwards = _inwards(hull)
    found: Array = point.copy()
    for _ in range(_MOST_STEPS):
        distances = ((found - hull) * inwards).sum(axis=1) - margin
        worst = int(distances.argmin())
        if distances[worst] >= -_CLOSE_ENOUGH:
            break
        found -= distances[worst] * inwards[worst]
    return found


def room_within(hull: Array, point: Array) -> float:
    """Return the distance in m of a point in a convex hull from its nearest edge; below 0 outside."""
    return float(((point - hull) * _inwards(hull)).sum(axis=1).min())


def _inwards(hull: Array) -> Array:
    """Return the unit vector from each edge of a convex hull to its inside, shape (n, 2)."""
    edges = np.roll(hull, -1, axis=0) - hull
    inwards = np.stack([-edges[:, 1], edges[:, 0]], axis=1)
    found: Array = inwards / np.linalg.norm(inwards, axis=1)[:, None]
    return found
