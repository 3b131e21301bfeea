"""ALMotion's Cartesian control, which moves hands, feet, head and torso along paths, and its foot steps."""

from __future__ import annotations

import cmath
import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Final

import numpy as np

from naoserver.errors import InvalidCommand
from naoserver.kinematics import Kinematics, Matrix, between, matrix_of
from naoserver.qi._access import Access, Service
from naoserver.qi._arguments import (
    Check,
    JointNames,
    Operation,
    chosen,
    fraction,
    listed,
    number,
    number_lists,
    number_within,
    texts,
    vector,
)
from naoserver.qi._clients import Activity, Call, begins
from naoserver.qi._motion import ALMotion
from naoserver.qi._trajectory import Trajectory, check_times, smooth_trajectory

_EFFECTORS: Final = ("Head", "LArm", "RArm", "LLeg", "RLeg", "Torso")
LEGS: Final = ("LLeg", "RLeg")
EVERY_AXIS: Final = 63
"""The mask of all axes: 1, 2 and 4 for x, y and z, 8, 16 and 32 for the rotations about them."""
_SPACING: Final = 0.1
"""Robot seconds between the places of a path whose angles are computed; more on a path of more places."""
_MOST_PLACES: Final = 300
_HALF: Final = 0.05
"""Half of the distance in m between the feet of NAOqi's stance."""

_Read = Callable[[object], Matrix]
"""Makes a place from an argument of a client."""


def _position(value: object) -> Matrix:
    """Return the place of x, y and z in m and the angles about them in rad."""
    return matrix_of(vector(value, "a position", 6))


def _transform(value: object) -> Matrix:
    """Return the place of a transform's first three rows, or of all four."""
    parts = vector(value, "a transform")
    if len(parts) not in (12, 16):
        raise InvalidCommand("transform", f"a transform has 12 or 16 numbers, not {len(parts)}")
    place = np.eye(4)
    place[:3] = np.array(parts[:12]).reshape(3, 4)
    turn = place[:3, :3]
    if np.abs(turn @ turn.T - np.eye(3)).max() > 0.01:
        raise InvalidCommand("transform", "the first three columns of a transform must be a rotation")
    return place


def _interpolation(read: _Read) -> Operation:
    """Return the operation that moves effectors along paths."""

    @begins(Activity.JOINTS)
    def follow(  # noqa: PLR0917 - the order is NAOqi's
        self: EffectorMotion,
        call: Call,
        effectorNames: object,
        frame: object,
        paths: object,
        axisMasks: object,
        times: object,
        isAbsolute: object = True,
    ) -> None:
        """Move an effector, or several together, through places at times in s; returns at the end."""
        names = _names(effectorNames)
        masks = axisMasks if isinstance(axisMasks, (list, tuple)) else [axisMasks] * len(names)
        if isinstance(effectorNames, str):
            paths = [paths]
            masks = [axisMasks]
            times = [times]
        moved: dict[str, tuple[list[Matrix], int, list[float]]] = {}
        lists = listed(paths, "paths", len(names)), listed(masks, "axisMasks", len(names))
        for name, path, mask, own in zip(
            names, *lists, number_lists(times, "times", len(names)), strict=True
        ):
            moved[name] = [read(each) for each in _places(path)], _mask(mask), own
            check_times(name, own, len(moved[name][0]))
        end = max((own[-1] for _, _, own in moved.values()), default=0.0)
        count = min(max(1, round(end / _SPACING)), _MOST_PLACES)
        joints = _moving(moved, self._access.joints)

        def angles(start: dict[str, float]) -> dict[str, Trajectory]:
            base = self._access.place("Torso", frame, measured=False)
            ways, kinematics = {}, self._access.kinematics
            for name, (places, mask, own) in moved.items():
                here = base @ kinematics.place_of(name, start)
                goals = places if isAbsolute else [_moved(here, place) for place in places]
                ways[name] = partial(_at, [0.0, *own], [here, *goals]), mask
            moments = [end * (i + 1) / count for i in range(count)]
            found, keys = start, []
            for moment in moments:
                wanted = {name: (way(moment), mask) for name, (way, mask) in ways.items()}
                found = reach_places(kinematics, wanted, base, start, near=found)
                keys.append(found)
            return {
                joint: smooth_trajectory(joint, start[joint], moments, [key[joint] for key in keys])
                for joint in joints
            }

        self._motion._follow(call, "positionInterpolation", joints, angles)

    return follow


def _targets(read: _Read, *, absolute: bool) -> Operation:
    """Return the operation that sends effectors to places, relative to their present ones unless absolute."""

    @begins(Activity.JOINTS)
    def send(  # noqa: PLR0917 - the order is NAOqi's
        self: EffectorMotion,
        effectorNames: object,
        frame: object,
        places: object,
        fractionMaxSpeed: object,
        axisMask: object = EVERY_AXIS,
    ) -> None:
        """Send effectors to places at a fraction of full speed; returns at once."""
        names = _names(effectorNames)
        goals = listed([places] if isinstance(effectorNames, str) else _places(places), "places", len(names))
        start, mask = self._access.angles(measured=False), _mask(axisMask)
        base = self._access.place("Torso", frame, measured=False)
        wanted, kinematics = {}, self._access.kinematics
        for name, goal in zip(names, map(read, goals), strict=True):
            wanted[name] = (goal if absolute else _moved(base @ kinematics.place_of(name, start), goal), mask)
        found = reach_places(kinematics, wanted, base, start, near=start)
        joints = _moving(names, self._access.joints)
        self._motion._send(joints, [found[joint] for joint in joints], fractionMaxSpeed)

    return send


def _steps(entries: str, read: Check) -> Operation:
    """Return the operation that takes steps; `read` checks the entries of a further list, one for each."""

    @begins(Activity.WALK)
    def walk(  # noqa: PLR0917 - the order is NAOqi's
        self: EffectorMotion,
        call: Call,
        legName: object,
        footSteps: object,
        entriesOfSteps: object,
        clearExisting: object,
    ) -> bool:
        """Walk to where steps lead, not step by step; returns at the end whether it arrived."""
        legs, steps = _legs_and_steps(legName, footSteps)
        for entry in listed(entriesOfSteps, entries, len(legs)):
            read(entry, f"an entry of {entries}")
        if clearExisting:
            self._access.walking.stop()
        # In the plane, x + iy, and headings in rad.
        feet, headings = {"LLeg": 1j * _HALF, "RLeg": -1j * _HALF}, dict.fromkeys(LEGS, 0.0)
        for leg, (x, y, turn) in zip(legs, steps, strict=True):
            support = LEGS[leg == "LLeg"]
            feet[leg] = feet[support] + cmath.rect(1.0, headings[support]) * complex(x, y)
            headings[leg] = headings[support] + turn
        middle = sum(feet.values()) / 2
        return self._motion.moveTo(call, middle.real, middle.imag, sum(headings.values()) / 2)

    return walk


class EffectorMotion(Service):
    """Move effectors as near to places as the joints can; `Torso` moves over the feet, which stay."""

    positionInterpolation = positionInterpolations = _interpolation(_position)
    transformInterpolation = transformInterpolations = _interpolation(_transform)
    setPosition = setPositions = _targets(_position, absolute=True)
    setTransform = setTransforms = _targets(_transform, absolute=True)
    setFootSteps, setFootStepsWithSpeed = _steps("timeList", number), _steps("fractionMaxSpeed", fraction)
    changePosition = _targets(_position, absolute=False)
    changeTransform = _targets(_transform, absolute=False)

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._motion = access.service(ALMotion)


def _names(effectors: object) -> list[str]:
    return [chosen(name, "effector", _EFFECTORS) for name in texts(effectors, "effectors")]


def _places(path: object) -> list[object]:
    """Return the places of a path; a single place need not be in a list."""
    places = listed(path, "a path")
    return places if places and isinstance(places[0], (list, tuple)) else [places]


def _mask(value: object) -> int:
    """Return a mask of axes, which NAOqi accepts alone or in a list with one for each place of a path."""
    one = listed(value, "axisMask")[-1] if isinstance(value, (list, tuple)) and value else value
    return int(number_within(one, "axisMask", 0, EVERY_AXIS))


def _moving(effectors: Iterable[str], joints: JointNames) -> list[str]:
    """Return the joints that move effectors."""
    chains = (joints.chains["Legs" if name == "Torso" else name] for name in effectors)
    return [joint for chain in chains for joint in chain if joint not in joints.hands]


def _moved(place: Matrix, change: Matrix) -> Matrix:
    """Return a place after a shift and a turn along the axes of its frame."""
    moved = place.copy()
    moved[:3, 3] += change[:3, 3]
    moved[:3, :3] = change[:3, :3] @ place[:3, :3]
    return moved


def _at(times: Sequence[float], places: Sequence[Matrix], moment: float) -> Matrix:
    """Return the place on a path at a time; straight from place to place."""
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


def _legs_and_steps(legs: object, steps: object) -> tuple[list[str], list[list[float]]]:
    """Return the leg of each step, and x and y in m and the heading in rad relative to the other foot."""
    names = [chosen(leg, "leg", LEGS) for leg in texts(legs, "legs")]
    found = [vector(step, "a step", 3) for step in listed(steps, "steps")]
    if len(names) != len(found) or not names:
        raise InvalidCommand("steps", f"there are {len(found)} steps for {len(names)} legs")
    if any(math.hypot(x, y) > 1.0 for x, y, _ in found):
        raise InvalidCommand("steps", "a step is longer than 1 m")
    return names, found
