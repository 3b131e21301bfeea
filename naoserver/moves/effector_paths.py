"""Paths of effectors in space, such as hands, as curves of the joints that bring them there.

Places are homogeneous transforms in a frame of the caller's, in which the root is at `base`. A mask says
which axes of a place count: 1, 2 and 4 for x, y and z, 8, 16 and 32 for the rotations about them.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from naoserver.bodies.kinematics import Kinematics, Matrix, between
from naoserver.errors import InvalidCommand
from naoserver.moves.joint_paths import Curve, smooth_curve

EVERY_AXIS: Final = 63
POSITION: Final = 7
"""The mask of the axes x, y and z."""
LEGS: Final = ("LLeg", "RLeg")
FIXED: Final = (1.0,) * 6
"""How much x, y, z and the turns about them count of a foot that stays where it is."""
PLANE: Final = (0.1, 0.1, 1.0, 1.0, 1.0, 0.1)
"""The same of a foot that may slide on the floor."""
_TURNING: Final = (*PLANE[:5], 0.0)
"""The same of one whose hip turns."""
_TORSO: Final = (0.1, 0.1, 0.02, 0.1, 0.1, 0.01)
"""The same of the torso, which balances while it sinks, rises and turns with the legs."""
_ASKED: Final = 0.1
"""How much a place of the torso counts that a program asks for: less than the feet."""
_LEAST: Final = 0.03
"""How much the angle of a leg's joint counts, or a place of a hand while legs move: less than balance."""
_BALANCE: Final = 0b011011
"""The mask of a torso that sinks, rises and turns as the legs do."""
_LEAN: Final = 0.8
"""Part of the way from the middle between the feet to one of them by which the torso leans over it."""
_OFF: Final = 0.025
"""Height in m of a sole's corner above the floor from which a foot carries nothing."""
_BOTH: Final = dict.fromkeys(LEGS, FIXED)
_NOTHING: Final[dict[str, Any]] = {}
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
    feet: Mapping[str, Sequence[float]] = _BOTH,
    asked: Mapping[str, Curve] = _NOTHING,
) -> dict[str, Curve]:
    """Return the curves of joints, from their angles at the start, that lead effectors along their waypoints.

    They go straight from place to place, as near to them as the joints can bring them; angles are computed
    at `most` moments at most, some 5 ms each. `feet` and `asked` are as of `reach_places`, over time.
    """
    begins = {name: base @ kinematics.place_of(name, start) for name in waypoints}
    end = max((way.times[-1] for way in waypoints.values()), default=0.0)
    count = min(max(1, round(end / _SPACING)), most)
    moments = [end * (i + 1) / count for i in range(count)]
    found, keys = start, []
    for moment in moments:
        wanted = {name: (_at(way, begins[name], moment), way.mask) for name, way in waypoints.items()}
        joint_angles = {joint: curve.at(moment) for joint, curve in asked.items()}
        found = reach_places(kinematics, wanted, base, start, near=found, feet=feet, asked=joint_angles)
        keys.append(found)
    angles = {joint: [key[joint] for key in keys] for joint in joints}
    return {joint: smooth_curve(joint, start[joint], moments, own) for joint, own in angles.items()}


def curves_on_feet(
    kinematics: Kinematics,
    feet: Mapping[str, Sequence[float]],
    asked: Mapping[str, Curve],
    base: Matrix,
    start: Mapping[str, float],
) -> dict[str, Curve]:
    """Return the curves of the joints of legs whose feet are on the floor, near to those that are asked for.

    The torso balances where it is, but for feet that turn: under even loads both soles would stick, so that
    it leans over the nearer foot, and the other one slides.
    """
    end, torso = max(curve.duration for curve in asked.values()), base.copy()
    if any("HipYaw" in joint for joint in asked):
        feet = {leg: _TURNING if counts is PLANE else counts for leg, counts in feet.items()}
    if [*feet.values()] == [_TURNING, _TURNING]:
        left, right = ((base @ kinematics.place_of(leg, start))[:2, 3] for leg in LEGS)
        here, half = base[:2, 3] - (left + right) / 2.0, (left - right) / 2.0
        share = here @ half / (half @ half)
        torso[:2, 3] += (math.copysign(_LEAN, share) - share) * half
    way = Waypoints([0.2 * end, 0.8 * end, end], [torso, torso, base], _BALANCE)
    joints = [joint for leg in feet for joint in kinematics.joints_of(leg)]
    return curves_along(kinematics, {"Torso": way}, base, start, joints, feet=feet, asked=asked)


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
    feet: Mapping[str, Sequence[float]] = _BOTH,
    asked: Mapping[str, float] = _NOTHING,
) -> dict[str, float]:
    """Return angles near `near` that bring effectors to places, in the frame in which the torso is at `base`.

    When legs or the torso move, the `feet` stay where they were at the angles `start`, as much as is said of
    each, unless they are to move themselves. They come first, then the torso, which balances; hands come
    last, and angles of legs that are `asked` for. Raises InvalidCommand if a robot that stands on both feet,
    which are to stay, would not do so any more.
    """
    shares = dict.fromkeys(wanted, 1.0)
    goals: dict[str, tuple[Matrix, Sequence[float]]] = {}
    legs = not wanted.keys().isdisjoint(("Torso", *LEGS))
    if legs:
        shares = dict.fromkeys(wanted, _LEAST) | {"Torso": _ASKED} | dict.fromkeys(LEGS, 1.0)
        goals = {leg: (base @ kinematics.place_of(leg, start), counts) for leg, counts in feet.items()}
        goals["Torso"] = base, _TORSO
    for name, (goal, mask) in wanted.items():
        goals[name] = goal, [shares[name] * (mask >> i & 1) for i in range(6)]
    angles = {joint: (angle, _LEAST) for joint, angle in asked.items()}
    found = kinematics.reach(goals, near, base, angles if legs else None)
    stays = legs and len(feet) == len(LEGS) and wanted.keys().isdisjoint(LEGS)
    if stays and not _stands(kinematics, found) and _stands(kinematics, start):
        raise InvalidCommand(
            "place",
            "the robot would fall: its center of mass would leave its soles, or they the floor",
        )
    return found


def _stands(kinematics: Kinematics, angles: Mapping[str, float]) -> bool:
    """Return whether both soles are on one floor, and the center of mass is over them."""
    soles, (_, center) = kinematics.soles(angles), kinematics.center_of_mass("Body", angles)
    outlines = [sole.outline for sole in kinematics.body.soles]
    points = [place @ (x, y, 0.0, 1.0) for place, own in zip(soles, outlines, strict=True) for x, y in own]
    x, y, height = (np.linalg.inv(soles[0]) @ np.array([*points, (*center, 1.0)]).T)[:3]
    # From a place within a convex outline, some corner is in each half of all directions.
    directions = np.sort(np.arctan2(y[:-1] - y[-1], x[:-1] - x[-1]))
    widest = np.diff(directions, append=directions[0] + math.tau).max()
    return bool(widest < math.pi and np.abs(height[:-1]).max() < _OFF)
