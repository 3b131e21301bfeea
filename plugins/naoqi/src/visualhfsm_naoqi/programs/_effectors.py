"""ALMotion's Cartesian control, which moves hands, feet, head and torso along paths, and its foot steps."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterable
from typing import Final

import numpy as np

from naoserver.bodies.kinematics import Kinematics, Matrix, matrix_of
from naoserver.errors import InvalidCommand
from naoserver.moves.effector_paths import EVERY_AXIS, LEGS, Waypoints, curves_along, reach_places
from naoserver.moves.joint_paths import Curve, check_times
from visualhfsm_naoqi.programs._access import Access, Service
from visualhfsm_naoqi.programs._arguments import (
    Check,
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
from visualhfsm_naoqi.programs._clients import Activity, Call, begins
from visualhfsm_naoqi.programs._motion import ALMotion

_EFFECTORS: Final = ("Head", "LArm", "RArm", "LLeg", "RLeg", "Torso")
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
        moved: dict[str, Waypoints] = {}
        lists = listed(paths, "paths", len(names)), listed(masks, "axisMasks", len(names))
        for name, path, mask, own in zip(
            names, *lists, number_lists(times, "times", len(names)), strict=True
        ):
            moved[name] = Waypoints(own, [read(each) for each in _places(path)], _mask(mask))
            check_times(name, own, len(moved[name].places))
        joints = _moving(moved, self._access.kinematics)

        def angles(start: dict[str, float]) -> dict[str, Curve]:
            base = self._access.place("Torso", frame, measured=False)
            ways, kinematics = dict(moved), self._access.kinematics
            if not isAbsolute:
                for name, way in moved.items():
                    here = base @ kinematics.place_of(name, start)
                    ways[name] = way._replace(places=[_moved(here, place) for place in way.places])
            return curves_along(kinematics, ways, base, start, joints)

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
        joints = _moving(names, kinematics)
        self._motion._send(joints, [found[joint] for joint in joints], fractionMaxSpeed, together=True)

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


def _moving(effectors: Iterable[str], kinematics: Kinematics) -> list[str]:
    """Return the joints that move effectors, or keep a foot where it is."""
    moved = dict.fromkeys(
        leg for name in effectors for leg in (LEGS if name in {"Torso", *LEGS} else (name,))
    )
    return [joint for name in moved for joint in kinematics.joints_of(name)]


def _moved(place: Matrix, change: Matrix) -> Matrix:
    """Return a place after a shift and a turn along the axes of its frame."""
    moved = place.copy()
    moved[:3, 3] += change[:3, 3]
    moved[:3, :3] = change[:3, :3] @ place[:3, :3]
    return moved


def _legs_and_steps(legs: object, steps: object) -> tuple[list[str], list[list[float]]]:
    """Return the leg of each step, and x and y in m and the heading in rad relative to the other foot."""
    names = [chosen(leg, "leg", LEGS) for leg in texts(legs, "legs")]
    found = [vector(step, "a step", 3) for step in listed(steps, "steps")]
    if len(names) != len(found) or not names:
        raise InvalidCommand("steps", f"there are {len(found)} steps for {len(names)} legs")
    if any(math.hypot(x, y) > 1.0 for x, y, _ in found):
        raise InvalidCommand("steps", "a step is longer than 1 m")
    return names, found
