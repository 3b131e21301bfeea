"""The search for a robot's pose on a soccer field, from pictures of all sides and without a guess.

All poses of a grid are compared with the points of lines that the pictures show. The best are fitted, and
compared in both ways: lines that are seen must be lines of the field, and those of the field must be seen.

A field looks the same after half a turn, so each pose has a twin that explains the pictures as well.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from naoserver.soccer_field import Array, Field, FieldLines

Mask = NDArray[np.bool_]

_FARTHEST_POINT: Final = 3.0
"""Distance in m up to which points are used: the lean of the camera shifts others by more than a step."""
HEIGHT: Final = 0.5
"""Approximate height of the camera in m, from which the effect of a lean is computed."""
_CELL: Final = 0.1
"""Side in m of a square on the floor from which one point is used."""
_STEP: Final = 0.15, math.tau / 60
"""From one pose of the grid to the next: m, rad."""
_OUTSIDE: Final = 0.5
"""Distance in m from the field to which the robot is searched."""
_PIXEL: Final = 0.05
"""Side in m of a pixel of the map of the lines."""
_NEAR: Final = 0.12
"""Distance in m from a line at which a point counts half."""
_AGREES: Final = 0.12
"""Distance in m from a line up to which a point is explained, 1 m from the camera; it grows as its square."""
_FITTED: Final = 60
"""Number of the best poses of the grid that are fitted."""
_ROUNDS: Final = 8
_KEPT: Final = 60
"""Maximum number of pictures; later ones replace the first."""
_ENOUGH: Final = 40
"""Minimum number of squares with a point, for a pose to be found."""

# -- lines that a picture should show
_EXPECTED: Final = 2.5
"""Distance in m up to which a line is expected in the picture."""
_MARGIN: Final = 8
"""Pixels at the edge of a picture where no line is expected."""
_AROUND: Final = 13
"""Side in pixels of the square around its expected place in which a line counts as found."""


class Pose(NamedTuple):
    """A place on the floor in m, and a heading in rad within (-pi, pi]."""

    x: float
    y: float
    heading: float


class View(NamedTuple):
    """What one picture shows: points of lines in the robot's frame in m, pixels that are white or hidden.

    `odometry` is the pose at its time; `to_image` leads from x, y, 1 on the floor to pixels.
    """

    odometry: Pose
    points: Array
    white: Mask
    hidden: Mask
    to_image: Array


class Found(NamedTuple):
    """A pose, and the share of the seen and the expected lines that agrees with it, from 0 to 1."""

    pose: Pose
    share: float


class Panorama:
    """Pictures from about one place, and the poses that explain them."""

    def __init__(self, field: Field, lines: FieldLines) -> None:
        self._lines = lines
        self._half = np.array((field.length, field.width)) / 2
        self._map = _map_of(lines, self._half + _OUTSIDE + 2 * _STEP[0] + _FARTHEST_POINT)
        self.views: Final[deque[View]] = deque(maxlen=_KEPT)
        """What the newest pictures show."""

    def poses(self, odometry: Pose) -> list[Found]:
        """Return the poses of a robot that is at this odometry now; those that explain most come first."""
        moves = [_between(odometry, view.odometry) for view in self.views]
        points = [
            view.points @ turn(move.heading).T + (move.x, move.y)
            for view, move in zip(self.views, moves, strict=True)
        ]
        spread = _thinned(np.concatenate([np.empty((0, 2)), *points]))
        if len(spread) < _ENOUGH:
            return []
        found: list[Found] = []
        for guess in self._best_of_grid(spread):
            pose, explained = self._fitted(guess, spread)
            if any(_alike(pose, other.pose) for other in found):
                continue
            shown = [
                expected_lines(self._lines, _moved(pose, move), view)
                for view, move in zip(self.views, moves, strict=True)
            ]
            expected = np.concatenate(shown)
            found.append(Found(pose, min(explained, float(expected.mean()) if len(expected) else 0.0)))
        twins = [Found(Pose(-x, -y, wrapped(heading + math.pi)), share) for (x, y, heading), share in found]
        return sorted([*found, *twins], key=lambda each: -each.share)

    def _best_of_grid(self, points: Array) -> list[Pose]:
        """Return the poses of half a turn near whose lines most points lie."""
        step, angle = _STEP
        x, y = (np.arange(-half - _OUTSIDE, half + _OUTSIDE + step, step) for half in self._half)
        headings = np.arange(0.0, math.pi, angle)
        scores = np.empty((len(headings), len(x), len(y)), np.float32)
        middle = np.array(self._map.shape) // 2
        along, across = (np.rint(each / _PIXEL).astype(np.int32) for each in (x, y))
        for number, heading in enumerate(headings):
            row, column = (np.rint(points @ turn(heading).T / _PIXEL).astype(np.int32) + middle).T
            at = self._map[along[:, None, None] + row, across[None, :, None] + column]
            scores[number] = at.mean(axis=2)
        best = np.argsort(scores, axis=None)[: -_FITTED - 1 : -1]
        which = np.unravel_index(best, scores.shape)
        return [Pose(float(x[j]), float(y[k]), float(headings[i])) for i, j, k in zip(*which, strict=True)]

    def _fitted(self, guess: Pose, points: Array) -> tuple[Pose, float]:
        """Return the pose near a guess that explains the points best, and the share that it explains."""
        x = np.array(guess)
        reach = _AGREES * np.maximum(1.0, np.sum(np.square(points), axis=1))
        for _ in range(_ROUNDS):
            there = points @ turn(float(x[2])).T
            off, normal = self._lines.offsets(there + x[:2])
            turning = normal[:, 1] * there[:, 0] - normal[:, 0] * there[:, 1]
            jacobian = np.column_stack((normal, turning))
            weighted = jacobian.T * (np.clip(1.0 - np.square(off / (2.0 * reach)), 0.0, 1.0) / reach) ** 2
            x -= np.linalg.solve(weighted @ jacobian + 1e-6 * np.eye(3), weighted @ off)
        off, _ = self._lines.offsets(points @ turn(float(x[2])).T + x[:2])
        pose = Pose(float(x[0]), float(x[1]), wrapped(float(x[2])))
        return pose, float(np.mean(np.abs(off) < reach))


def expected_lines(lines: FieldLines, pose: Pose, view: View, lean: Array | None = None) -> Mask:
    """Return, for each place where a picture should show a line, as nothing hides it, whether it does.

    `lean` is that of the camera in excess of the measured one in rad, back and to the left.
    """
    there = (lines.samples - pose[:2]) @ turn(pose.heading)
    there = there[np.hypot(there[:, 0], there[:, 1]) < _EXPECTED]
    if lean is not None:
        there = there - leans(there) @ lean
    u, v, front = view.to_image @ np.column_stack((there, np.ones(len(there)))).T
    u, v = u / np.where(front > 0, front, np.nan), v / np.where(front > 0, front, np.nan)
    height, width = view.white.shape
    inside = (u >= _MARGIN) & (u < width - _MARGIN) & (v >= _MARGIN) & (v < height - _MARGIN)
    near = cv2.dilate(view.white.astype(np.uint8), np.ones((_AROUND, _AROUND), np.uint8)) > 0
    at = v[inside].astype(int), u[inside].astype(int)
    shown: Mask = near[at][~view.hidden[at]]
    return shown


def leans(points: Array) -> Array:
    """Return how points on the floor move with a lean of the camera: most along their rays.

    Each is a matrix in m/rad, (I h^2 + p p^T) / h.
    """
    return np.asarray((np.eye(2) * HEIGHT**2 + points[:, :, None] * points[:, None, :]) / HEIGHT)


def turn(angle: float) -> Array:
    """Return the matrix of a turn to the left."""
    return np.array(((math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))))


def wrapped(angle: float) -> float:
    """Return an angle within (-pi, pi]."""
    return math.pi - (math.pi - angle) % math.tau


def _map_of(lines: FieldLines, half: Array) -> NDArray[np.float32]:
    """Return how near a line each place is, from 0 to 1: rows along x, columns along y, round the center."""
    count = np.ceil(half / _PIXEL).astype(int)
    far = np.ones(2 * count + 1, np.uint8)
    row, column = (np.rint(lines.samples / _PIXEL).astype(int) + count).T
    far[row, column] = 0
    away = cv2.distanceTransform(far, cv2.DIST_L2, 5) * _PIXEL
    return np.asarray(1.0 / (1.0 + np.square(away / _NEAR) ** 2), np.float32)


def _thinned(points: Array) -> Array:
    """Return one of the points in each square, since near lines have many."""
    near = points[np.hypot(points[:, 0], points[:, 1]) < _FARTHEST_POINT]
    _, first = np.unique(np.floor(near / _CELL), axis=0, return_index=True)
    return near[np.sort(first)]


def _between(origin: Pose, other: Pose) -> Pose:
    """Return a pose of the odometry as seen from another."""
    x, y = turn(-origin.heading) @ (other.x - origin.x, other.y - origin.y)
    return Pose(float(x), float(y), wrapped(other.heading - origin.heading))


def _moved(pose: Pose, move: Pose) -> Pose:
    """Return the pose on the field after a move as seen from a pose there."""
    x, y = turn(pose.heading) @ move[:2]
    return Pose(pose.x + float(x), pose.y + float(y), wrapped(pose.heading + move.heading))


def _alike(one: Pose, other: Pose) -> bool:
    return (
        math.dist(one[:2], other[:2]) < _STEP[0] and abs(wrapped(one.heading - other.heading)) < 2 * _STEP[1]
    )
