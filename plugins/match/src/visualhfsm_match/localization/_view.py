"""What one look shows of a soccer field, in the robot's frame in m, and the geometry of poses."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, NamedTuple, Protocol

import numpy as np

from naoserver.soccer_field import Array, Field

HEIGHT: Final = 0.5
"""Approximate height of the camera in m, from which the effect of a lean is computed."""
_KINDS: Final = "line", "crossing", "goalpost"


class Seen(Protocol):
    """A thing of `Sight.getSight`."""

    @property
    def kind(self) -> str:
        """What it is."""

    @property
    def name(self) -> str:
        """Which of them."""

    @property
    def camera(self) -> str:
        """Which camera shows it."""

    @property
    def x(self) -> float:
        """Where it stands in m, ahead of the robot."""

    @property
    def y(self) -> float:
        """The same to the left."""


class Pose(NamedTuple):
    """A place on the floor in m, and a heading in rad within (-pi, pi]."""

    x: float
    y: float
    heading: float


class View(NamedTuple):
    """What one camera shows, a row of x and y for each; `odometry` is the pose at its time."""

    odometry: Pose
    points: Array
    """Places on lines."""
    crossings: Array
    names: tuple[str, ...]
    """Of the crossings."""
    posts: Array


def views_of(things: Iterable[Seen], odometry: Pose, then: Pose, farthest: float) -> list[View]:
    """Return what things show of the field, as far as lines are near enough: a view for each camera.

    They were seen at the odometry `then`, and are where the robot sees them from its odometry now.
    """
    turned, moved = (
        turn(then.heading - odometry.heading),
        turn(-odometry.heading) @ np.subtract(then, odometry)[:2],
    )
    views: dict[str, dict[str, list[tuple[float, float, str]]]] = {}
    for thing in things:
        if thing.kind not in _KINDS or not math.isfinite(thing.x):
            continue
        if thing.kind == "goalpost" or math.hypot(thing.x, thing.y) < farthest:
            found = views.setdefault(thing.camera, {kind: [] for kind in _KINDS})
            found[thing.kind].append((thing.x, thing.y, thing.name))

    def placed(found: list[tuple[float, float, str]]) -> Array:
        places = np.array([(x, y) for x, y, _ in found], np.float64).reshape(-1, 2)
        return np.asarray(places @ turned.T + moved)

    found_of = [found.values() for found in views.values()]
    return [
        View(odometry, placed(lines), placed(crossings), tuple(each[2] for each in crossings), placed(posts))
        for lines, crossings, posts in found_of
    ]


class Crossings:
    """The crossings of a field's lines by their names."""

    def __init__(self, field: Field) -> None:
        self.places: Final[Array] = np.array([(x, y) for x, y, _ in field.crossings])
        """All of them, a row for each."""
        named: dict[str, list[tuple[float, float]]] = {}
        for x, y, name in field.crossings:
            named.setdefault(name, []).append((x, y))
        self._named = {name: np.array(places) for name, places in named.items()}

    def near(self, view: View, pose: Array, within: float) -> tuple[Array, Array]:
        """Return the crossings of a view that may be one of the field, and where that is, for a pose.

        One of an unknown name may be any.
        """
        seen, known = [], []
        there = view.crossings @ turn(float(pose[2])).T + pose[:2]
        for name, own, at in zip(view.names, view.crossings, there, strict=True):
            places = self._named.get(name, self.places)
            away = np.hypot(*(places - at).T)
            nearest = int(away.argmin())
            if away[nearest] < within:
                seen.append(own)
                known.append(places[nearest])
        return np.array(seen).reshape(-1, 2), np.array(known).reshape(-1, 2)


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
