"""Paths of effectors in space, such as hands, as curves of the joints that bring them there.

Places are homogeneous transforms in a frame of the caller's, in which the root is at `base`. A mask says
which axes of a place count: 1, 2 and 4 for x, y and z, 8, 16 and 32 for the rotations about them.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from naoserver._joint_paths import Curve, smooth_curve
from naoserver.kinematics import Kinematics, Matrix, between

EVERY_AXIS: Final = 63
POSITION: Final = 7
"""The mask of the axes x, y and z."""
LEGS: Final = ("LLeg", "RLeg")
_SPACING: Final = 0.1
"""Seconds between the places of a path whose angles are computed; more on a path of more places."""
_MOST_PLACES: Final = 300


class Waypoints(NamedTuple):
    """Places of an effector at increasing times in s, and the mask of the axes that count."""

    times: Sequence[float]
    places: Sequence[Matrix]
    mask: int


def curves_along(
    kinematics: Kinematics,
    waypoints: Mapping[str, Waypoints],
    base: Matrix,
    start: Mapping[str, float],
    joints: Iterable[str],
    *,
    most: int = _MOST_PLACES,
) -> dict[str, Curve]:
    """Return the curves of joints, from their angles at the start, that lead effectors along their waypoints.

    They go straight from place to place, as near to them as the joints can bring them; angles are computed
    at `most` moments at most, some 3 ms each.
    """
    begins = {name: base @ kinematics.place_of(name, start) for name in waypoints}
    end = max((way.times[-1] for way in waypoints.values()), default=0.0)
    count = min(max(1, round(end / _SPACING)), most)
    moments = [end * (i + 1) / count for i in range(count)]
    found, keys = start, []
    for moment in moments:
        wanted = {name: (_at(way, begins[name], moment), way.mask) for name, way in waypoints.items()}
        found = reach_places(kinematics, wanted, base, start, near=found)
        keys.append(found)
    angles = {joint: [key[joint] for key in keys] for joint in joints}
    return {joint: smooth_curve(joint, start[joint], moments, own) for joint, own in angles.items()}


def _at(way: Waypoints, begin: Matrix, moment: float) -> Matrix:
    """Return the place on a way at a time; straight from place to place."""
    times, places = (0.0, *way.times), (begin, *way.places)
    later = min(bisect_left(times, moment), len(times) - 1)
    before = max(later - 1, 0)
    span = times[later] - times[before]
    share = min(1.0, (moment - times[before]) / span) if span > 0.0 else 1.0
    return between(places[before], places[later], share)


def reach_places(
    kinematics: Kinematics,
    wanted: Mapping[str, tuple[Matrix, int]],
    base: Matrix,
    start: Mapping[str, float],
    *,
    near: Mapping[str, float],
) -> dict[str, float]:
    """Return angles near `near` that bring effectors to places, in the frame in which the torso is at `base`.

    `start` are the angles at the beginning: when the torso moves, the feet stay where they were then.
    """
    torso = base
    if (moved := wanted.get("Torso")) is not None:
        goal, mask = moved
        torso = base.copy()
        if mask & 56:
            torso[:3, :3] = goal[:3, :3]
        for axis in range(3):
            if mask >> axis & 1:
                torso[axis, 3] = goal[axis, 3]
        feet = {leg: (base @ kinematics.place_of(leg, start), EVERY_AXIS) for leg in LEGS}
        wanted = {**feet, **{name: goal for name, goal in wanted.items() if name != "Torso"}}
    inverse, bits = np.linalg.inv(torso), range(6)
    goals = {
        name: (inverse @ place, [bool(mask >> i & 1) for i in bits]) for name, (place, mask) in wanted.items()
    }
    return kinematics.reach(goals, near)
