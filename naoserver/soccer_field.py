"""The model of a soccer field: its lengths, lines and goals.

The simulated world is built from it, and the localization compares pictures with it. Its frame has the origin
at the center of the field; x points to a goal, y to the left of that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Final

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

Array = NDArray[np.float64]

Size = Annotated[float, Meta(ge=0.005, le=50.0)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]

POST_RADIUS: Final = 0.05
_MARK: Final = 0.10
"""Length in m of each bar of the center mark and the penalty marks."""
_SAMPLE: Final = 0.05
"""Distance in m from one place on a line to the next."""


class Field(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A soccer field round the origin, goals at -x and +x; by default that of the Standard Platform League.

    Lengths in m. Penalty area and goal area are given as depth along x and width along y.
    """

    length: Size = 9.0
    width: Size = 6.0
    border: Size = 0.7
    line: Annotated[float, Meta(ge=0.01, le=0.2)] = 0.05
    circle_diameter: Size = 1.5
    penalty_area: tuple[Size, Size] = (1.65, 4.0)
    goal_area: tuple[Size, Size] = (0.6, 2.2)
    penalty_mark: Size = 1.3
    """Distance of the mark from the goal line."""
    goal_width: Size = 1.5
    goal_height: Size = 0.8
    goal_depth: Size = 0.5
    grass: tuple[Share, Share, Share] = (0.18, 0.45, 0.20)
    walled: bool = False
    """Whether walls stand along the outline, so that the ball leaves it through a goal alone."""
    corner: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.0
    """How much of each outer line a wall across the corner cuts off."""
    ball_radius: Size = 0.05
    """Of the ball that is played with; the file of a world says it with its first ball."""

    def lines(self) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
        """Yield the center and the half sides of each straight line in the quarter x >= 0, y >= 0.

        Mirroring them at both axes gives all lines; lines that cross an axis extend equally beyond it.
        """
        half, end = self.line / 2, self.length / 2
        # The halfway line and the outline, then both areas in front of the goal.
        yield (0.0, 0.0), (half, self.width / 2)
        yield (0.0, self.width / 2), (end + half, half)
        yield (end, 0.0), (half, self.width / 2 + half)
        for depth, breadth in (self.penalty_area, self.goal_area):
            yield (end - depth / 2, breadth / 2), (depth / 2 + half, half)
            yield (end - depth, 0.0), (half, breadth / 2 + half)
        for mark in (0.0, end - self.penalty_mark):
            yield (mark, 0.0), (_MARK / 2, half)
            yield (mark, 0.0), (half, _MARK / 2)

    @property
    def posts(self) -> tuple[tuple[float, float], ...]:
        """The middles of the four goal posts on the floor."""
        x, y = self.length / 2, self.goal_width / 2 + POST_RADIUS
        return (x, y), (x, -y), (-x, y), (-x, -y)

    @property
    def crossings(self) -> tuple[tuple[float, float, str], ...]:
        """The places where lines meet or cross: x and y in m, and L, T or X; and the penalty marks: mark."""
        end, side, circle = self.length / 2, self.width / 2, self.circle_diameter / 2
        quarter = [(end, side, "L"), (0.0, side, "T"), (0.0, circle, "X"), (0.0, 0.0, "X")]
        quarter.append((end - self.penalty_mark, 0.0, "mark"))
        for depth, breadth in (self.penalty_area, self.goal_area):
            quarter += [(end, breadth / 2, "T"), (end - depth, breadth / 2, "L")]
        all_four = [
            (i * x + 0.0, j * y + 0.0, kind) for x, y, kind in quarter for i in (1, -1) for j in (1, -1)
        ]
        return tuple(dict.fromkeys(all_four))


class FieldLines:
    """The middles of a field's lines: straight ones, and a circle round the origin."""

    def __init__(self, field: Field) -> None:
        self.width = field.line
        self._radius = field.circle_diameter / 2
        begins, ends = [], []
        for middle, half in field.lines():
            along = np.maximum(np.subtract(half, field.line / 2), 0.0)
            for place in {(x * middle[0], y * middle[1]) for x in (1, -1) for y in (1, -1)}:
                begins.append(place - along)
                ends.append(place + along)
        self.segments: list[tuple[float, float, float, float]] = np.hstack((begins, ends)).tolist()
        """The straight ones: x and y in m of one end, and of the other."""
        self._begin, way = np.array(begins), np.subtract(ends, begins)
        self._length = np.hypot(way[:, 0], way[:, 1])
        self._direction = way / self._length[:, None]
        straight = [
            begin + np.arange(0.0, length, _SAMPLE)[:, None] * direction
            for begin, length, direction in zip(self._begin, self._length, self._direction, strict=True)
        ]
        angles = np.arange(0.0, math.tau, _SAMPLE / self._radius)
        circle = self._radius * np.column_stack((np.cos(angles), np.sin(angles)))
        self.samples: Array = np.concatenate((*straight, circle))
        """Places on the lines in m, one in each row."""

    def offsets(self, points: Array) -> tuple[Array, Array]:
        """Return signed distances in m of points from the nearest line, and unit vectors along these."""
        each = np.arange(len(points))
        from_x = points[:, :1] - self._begin[:, 0]
        from_y = points[:, 1:] - self._begin[:, 1]
        ahead, left = self._direction.T
        along = np.clip(from_x * ahead + from_y * left, 0.0, self._length)
        away_x, away_y = from_x - along * ahead, from_y - along * left
        squares = away_x * away_x + away_y * away_y
        nearest = squares.argmin(axis=1)
        direction = self._direction[nearest]
        away = np.column_stack((away_x[each, nearest], away_y[each, nearest]))
        # Next to a line its normal counts, because `away` is zero on the line; beyond its end, `away`.
        normal = np.column_stack((-direction[:, 1], direction[:, 0]))
        off, distance = np.sum(away * normal, axis=1), np.sqrt(squares[each, nearest])
        beyond = distance > np.abs(off) + 1e-6
        off[beyond], normal[beyond] = distance[beyond], away[beyond] / distance[beyond, None]
        center = np.hypot(points[:, 0], points[:, 1])
        circle = np.abs(center - self._radius) < np.abs(off)
        normal[circle] = points[circle] / np.maximum(center[circle, None], 1e-9)
        return np.where(circle, center - self._radius, off), normal
