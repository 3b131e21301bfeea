"""The search for a robot's pose on a soccer field, from looks to all sides and without a guess.

All poses of a grid are compared with the places on lines that were seen. The best are fitted, and compared in
both ways: what is seen must be of the field, and the crossings of the field must be seen.

A field looks the same after half a turn, so each pose has a twin that explains the looks as well.
"""

from __future__ import annotations

import math
from collections import deque
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from naoserver.soccer_field import Array, Field, FieldLines
from visualhfsm_match.localization._view import HEIGHT, Crossings, Pose, View, turn, wrapped

Mask = NDArray[np.bool_]

_FARTHEST_POINT: Final = 3.0
"""Distance in m up to which places on lines are used: the lean of the camera shifts others by over a step."""
_CELL: Final = 0.1
"""Side in m of a square on the floor from which one place is used."""
_STEP: Final = 0.15, math.tau / 60
"""From one pose of the grid to the next: m, rad."""
_OUTSIDE: Final = 0.5
"""Distance in m from the field to which the robot is searched."""
_PIXEL: Final = 0.05
"""Side in m of a pixel of the map of the lines."""
_NEAR: Final = 0.12
"""Distance in m from a line at which a place counts half."""
_AGREES: Final = 0.12
"""Distance in m from a line up to which a place is explained, 1 m from the camera; it grows as its square."""
_SAME: Final = 0.15
"""The same of a crossing; it grows as the distance."""
_LEAN: Final = 0.02
"""Standard deviation of the camera's pitch in rad, in excess of the measured one."""
_FITTED: Final = 60
"""Number of the best poses of the grid that are fitted."""
_ROUNDS: Final = 8
_KEPT: Final = 60
"""Maximum number of looks; later ones replace the first."""
_ENOUGH: Final = 40
"""Minimum number of squares with a place on a line, for a pose to be found."""
_EXPECTED: Final = 2.2
"""Distance in m up to which a crossing is expected to be seen."""
_BEHIND: Final = 2.2
"""Bearing in rad beyond which it is not: a head looks to all sides but the back."""
_MATCHED: Final = 0.6
"""Largest distance in m between a crossing that is seen and the one that a fitted pose takes it for."""


class Found(NamedTuple):
    """A pose, and the share of what is seen and expected that agrees with it, from 0 to 1."""

    pose: Pose
    share: float


class Panorama:
    """Looks from about one place, and the poses that explain them."""

    def __init__(self, field: Field, lines: FieldLines, crossings: Crossings) -> None:
        self._lines = lines
        self._crossings = crossings
        self._half = np.array((field.length, field.width)) / 2
        self.views: Final[deque[View]] = deque(maxlen=_KEPT)
        """The newest looks."""

    def poses(self, odometry: Pose) -> list[Found]:
        """Return the poses of a robot that is at this odometry now; those that explain most come first."""
        moves = [_between(odometry, view.odometry) for view in self.views]
        points, crossings = (
            [
                places @ turn(move.heading).T + (move.x, move.y)
                for places, move in zip(each, moves, strict=True)
            ]
            for each in ([view.points for view in self.views], [view.crossings for view in self.views])
        )
        spread = _thinned(np.concatenate([np.empty((0, 2)), *points]))
        if len(spread) < _ENOUGH:
            return []
        names = tuple(name for view in self.views for name in view.names)
        whole = View(
            odometry, spread, np.concatenate([np.empty((0, 2)), *crossings]), names, np.empty((0, 2))
        )
        found: list[Found] = []
        for guess in self._best_of_grid(spread):
            pose, explained = self._fitted(guess, whole)
            if any(_alike(pose, other.pose) for other in found):
                continue
            found.append(Found(pose, min(explained, self._agreement(pose, whole))))
        twins = [Found(Pose(-x, -y, wrapped(heading + math.pi)), share) for (x, y, heading), share in found]
        return sorted([*found, *twins], key=lambda each: -each.share)

    @cached_property
    def _map(self) -> NDArray[np.float32]:
        return _map_of(self._lines, self._half + _OUTSIDE + 2 * _STEP[0] + _FARTHEST_POINT)

    def _agreement(self, pose: Pose, view: View) -> float:
        """Return which share of the crossings agrees with a pose: of those that are seen, and expected."""
        own, known = self._crossings.near(view, np.array(pose), math.inf)
        if not len(own):
            return 0.0
        off = np.hypot(*(own @ turn(pose.heading).T + pose[:2] - known).T)
        seen = float(np.mean(off < _SAME * np.maximum(1.0, np.hypot(*own.T))))
        around = (self._crossings.places - pose[:2]) @ turn(pose.heading)
        ahead = np.abs(np.arctan2(around[:, 1], around[:, 0])) < _BEHIND
        expected = around[(np.hypot(*around.T) < _EXPECTED) & ahead]
        if not len(expected):
            return seen
        nearest = np.hypot(*np.moveaxis(expected[:, None] - own, -1, 0)).min(axis=1)
        shown = float(np.mean(nearest < _SAME * np.maximum(1.0, np.hypot(*expected.T))))
        return min(seen, (1.0 + shown) / 2)  # some are missed, or hidden

    def _best_of_grid(self, points: Array) -> list[Pose]:
        """Return the poses of half a turn near whose lines most places lie."""
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

    def _fitted(self, guess: Pose, view: View) -> tuple[Pose, float]:
        """Return the pose near a guess that explains lines and crossings best, and the share of the lines."""
        x, points = (
            np.array((*guess, 0.0)),
            view.points,
        )  # and the lean of the camera, which shifts all along their rays
        lawful = np.diag((1e-6, 1e-6, 1e-6, _LEAN**-2))
        for step in range(_ROUNDS):
            own, known = self._crossings.near(view, x, _MATCHED)
            own, known = (own, known) if step else (own[:0], known[:0])  # by the lines first
            places = np.concatenate((points, own, own))
            rays = places * (HEIGHT / np.hypot(*places.T) + np.hypot(*places.T) / HEIGHT)[:, None]
            bent = rays @ turn(float(x[2])).T
            there = places @ turn(float(x[2])).T + x[3] * bent
            off, normal = self._lines.offsets(there[: len(points)] + x[:2])
            aside = there[len(points) : len(points) + len(own)] + x[:2] - known
            off = np.concatenate((off, aside[:, 0], aside[:, 1]))
            normal = np.concatenate((normal, np.repeat(np.eye(2), len(own), axis=0)))
            turning = normal[:, 1] * there[:, 0] - normal[:, 0] * there[:, 1]
            jacobian, reach = (
                np.column_stack((normal, turning, np.sum(normal * bent, axis=1))),
                _reach(places),
            )
            weighted = jacobian.T * (np.clip(1.0 - np.square(off / (2.0 * reach)), 0.0, 1.0) / reach) ** 2
            x -= np.linalg.solve(
                weighted @ jacobian + lawful, weighted @ off + lawful @ (0.0, 0.0, 0.0, x[3])
            )
        off, _ = self._lines.offsets(points @ turn(float(x[2])).T + x[:2])
        pose = Pose(float(x[0]), float(x[1]), wrapped(float(x[2])))
        return pose, float(np.mean(np.abs(off) < _reach(points)))


def _reach(places: Array) -> Array:
    """Return how far off places may seem, in m."""
    return np.asarray(_AGREES * np.maximum(1.0, np.sum(np.square(places), axis=1)))


def _map_of(lines: FieldLines, half: Array) -> NDArray[np.float32]:
    """Return how near a line each place is, from 0 to 1: rows along x, columns along y, round the center.

    A field is its own mirror image, along and across.
    """
    rows, columns = (np.arange(each + 1) * _PIXEL for each in np.ceil(half / _PIXEL).astype(int).tolist())
    places = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)
    off, _ = lines.offsets(places)
    quarter = (1.0 / (1.0 + np.square(off / _NEAR) ** 2)).reshape(len(rows), len(columns)).astype(np.float32)
    ahead = np.concatenate((quarter[:, :0:-1], quarter), axis=1)
    return np.concatenate((ahead[:0:-1], ahead))


def _thinned(points: Array) -> Array:
    """Return one of the places in each square, since near lines have many."""
    near = points[np.hypot(points[:, 0], points[:, 1]) < _FARTHEST_POINT]
    _, first = np.unique(np.floor(near / _CELL), axis=0, return_index=True)
    return near[np.sort(first)]


def _between(origin: Pose, other: Pose) -> Pose:
    """Return a pose of the odometry as seen from another."""
    x, y = turn(-origin.heading) @ (other.x - origin.x, other.y - origin.y)
    return Pose(float(x), float(y), wrapped(other.heading - origin.heading))


def _alike(one: Pose, other: Pose) -> bool:
    return (
        math.dist(one[:2], other[:2]) < _STEP[0] and abs(wrapped(one.heading - other.heading)) < 2 * _STEP[1]
    )
