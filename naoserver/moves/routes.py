"""Ways of the whole body, leg by leg: to a posture, or into a motion.

The postures of a body are in its description, grouped into stances: within a stance it goes from one posture
to another without losing its hold; from stance to stance it needs a motion. After each leg, a route is asked
for the next one, which depends on how the body lies, sits or stands then. A failed attempt to get up is thus
repeated, and the robot recovers from a fall on the way.
"""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from operator import itemgetter
from types import MappingProxyType
from typing import Final, Protocol

from naoserver.bodies.body import Body
from naoserver.bodies.kinematics import kinematics_of
from naoserver.bodies.parts import Stance
from naoserver.errors import InvalidCommand, RobotError
from naoserver.moves.motion_file import Interpolation, Key, Motion
from naoserver.protocol.robot import Robot
from zenoh_ice.data.text import sentence

UPRIGHT: Final = (Stance.STANDING, Stance.SITTING)
"""The stances of a body whose torso is upright."""
_NEAR: Final = 0.35
"""Largest distance of a joint from its angle in a posture, in rad, for the body to be in it."""
_SIDEWAYS: Final = 0.9
"""Least part of an axis that points to the side, for a joint of a leg to lift or bend it."""
_FREE: Final = ("Neck", "LeftWrist", "RightWrist", "LeftHand", "RightHand")
"""Hinges whose joints do not count: the body is in its posture however it looks around."""


@dataclass(frozen=True, slots=True)
class Situation:
    """State of the body: its joints, and the upward direction in the torso's frame."""

    joints: Mapping[str, float]
    """Angles in rad by name."""
    up: tuple[float, float, float]
    """Unit vector, as of `InertialReading`."""


def situation_of(robot: Robot) -> Situation:
    """Return the situation of a robot's body; upright if the robot has no inertial unit.

    Raises RobotError when such a robot lies, since its pose is unknown.
    """
    joints = dict(zip((joint.name for joint in robot.joints), robot.read().positions, strict=True))
    if robot.senses is None:
        if robot.state().fallen:
            raise RobotError(
                sentence("the robot has fallen, and has no inertial unit that measures how it lies")
            )
        return Situation(joints, (0.0, 0.0, 1.0))
    return Situation(joints, robot.senses.inertial().up)


def stance_of(body: Body, situation: Situation) -> Stance | None:
    """Return the stance, by the body's tilt and, if it is upright, by the joints that lift and bend its legs.

    A body without postures has none.
    """
    if not body.postures:
        return None
    x, y, z = situation.up
    if z < math.cos(body.lying_tilt):
        if abs(x) >= abs(y):
            return Stance.BELLY if x < 0 else Stance.BACK
        return Stance.LEFT_SIDE if y < 0 else Stance.RIGHT_SIDE
    legs = _bending(body)
    distances = {
        name: sum(abs(situation.joints[joint] - posture.angles[joint]) for joint in legs)
        for name, posture in body.postures.items()
        if posture.stance in UPRIGHT
    }
    if not distances:
        return Stance.STANDING
    return body.postures[min(distances, key=distances.__getitem__)].stance


def nearest_posture(body: Body, situation: Situation) -> str:
    """Return the posture that the body is in; empty when it is in none."""
    stance = stance_of(body, situation)
    counting = _counting(body)
    distances = [
        (max(abs(situation.joints[joint] - posture.angles[joint]) for joint in counting), name)
        for name, posture in body.postures.items()
        if posture.stance is stance
    ]
    distance, nearest = min(distances, default=(math.inf, ""))
    return nearest if distance <= _NEAR else ""


@lru_cache(16)
def _bending(body: Body) -> tuple[str, ...]:
    """Return the joints of the legs that turn about an axis to the side while all joints are at 0."""
    place = kinematics_of(body).place_of
    axes = {name: place(name, {})[:3, :3] @ body.joint[name].axis for name in body.groups.legs}
    return tuple(name for name, axis in axes.items() if abs(axis[1]) > _SIDEWAYS)


@lru_cache(16)
def _counting(body: Body) -> tuple[str, ...]:
    """Return the joints by which a posture is recognized."""
    hinges = (body.hinge(name) for name in _FREE)
    free = {joint for hinge in hinges if hinge for joint in hinge.joints}
    free.update(body.groups.head, body.groups.wheels)
    return tuple(joint.name for joint in body.joints if not joint.passive and joint.name not in free)


_FRACTION: Final = 0.3
"""Highest speed of a change of posture at full pace, as a fraction of the joints' full speed."""
SLOWEST_PACE: Final = 0.01
"""Smallest fraction of the full pace; smaller ones are raised to it, so that every way ends."""
_SHORTEST_CHANGE: Final = 0.4
"""Minimum duration of a change of posture in s."""
_SAME: Final = 0.02
"""Angle in rad within which a joint's setpoint needs no separate leg."""
_MOST_TRIES: Final = 3
"""Number of attempts at a motion out of a stance."""
_SIDES: Final = (Stance.LEFT_SIDE, Stance.RIGHT_SIDE)
_OFF_THE_SIDE: Final = ("LyingBack", "StandZero")
_SAFEST: Final = "Crouch"


class RouteError(InvalidCommand):
    """The route cannot be continued; the message says why."""

    def __init__(self, message: str) -> None:
        super().__init__("name", message)


class Route(Protocol):
    """The body's actions, leg by leg."""

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the next leg, None at the end; `commands` are the joints' setpoints. Raises RouteError."""

    def abandoned(self) -> Route | None:
        """Return the route to continue with when the client is lost; None to stop at once."""


class _BodyRoute:
    """A route of a body, which has motions, at a fraction of the full pace."""

    def __init__(self, body: Body, motions: Iterable[Motion], fraction: float = 1.0) -> None:
        self._body = body
        self._motions = tuple(motions)
        self._fraction = fraction

    def abandoned(self) -> Route | None:
        """Return the route to the safest posture: half way, the body may fall."""
        return SafestPostureRoute(self._body, self._motions)

    def _within_stance(self, posture: str, situation: Situation, commands: Mapping[str, float]) -> Motion:
        """Return the leg into a posture of the same stance: its own motion, or else the straight way."""
        begin = nearest_posture(self._body, situation)
        for motion in self._motions:
            if begin != posture and (motion.start, motion.end) == (begin, posture):
                return motion
        return self._straight_way(posture, commands)

    def _straight_way(self, posture: str, commands: Mapping[str, float]) -> Motion:
        """Return the motion from where the joints are into a posture."""
        body = self._body
        ways = {joint: angle for joint, angle in body.postures[posture].angles.items() if joint in commands}
        ways = {joint: angle for joint, angle in ways.items() if joint in body.motors}
        longest = max(
            abs(angle - commands[joint]) / body.joint[joint].max_velocity for joint, angle in ways.items()
        )
        pace = _FRACTION * max(self._fraction, SLOWEST_PACE)
        seconds = max(longest * Interpolation.SMOOTH.peak / pace, _SHORTEST_CHANGE)
        keys = {joint: (Key(seconds, angle),) for joint, angle in ways.items()}
        return Motion(f"to {posture}", MappingProxyType(keys), end=posture)

    def _is_near(self, posture: str, commands: Mapping[str, float]) -> bool:
        angles = self._body.postures[posture].angles
        motors = (joint for joint in self._body.motors if joint in commands)
        return all(abs(commands[joint] - angles[joint]) <= _SAME for joint in motors)


class PostureRoute(_BodyRoute):
    """The way to a posture: legs from stance to stance, and then within the posture's stance."""

    def __init__(self, body: Body, posture: str, motions: Iterable[Motion], fraction: float = 1.0) -> None:
        super().__init__(body, motions, fraction)
        self._posture = posture
        self._tries: Counter[Stance | None] = Counter()
        self._arrived = False

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the next leg; None once the body is in the posture. Raises RouteError."""
        stance, wanted = stance_of(self._body, situation), self._body.postures[self._posture].stance
        if stance is wanted:
            if self._arrived:
                return None
            self._arrived = True
            return self._within_stance(self._posture, situation, commands)
        self._arrived = False
        if self._tries[stance] == _MOST_TRIES:
            raise RouteError(f"it is still {stance} after {_MOST_TRIES} motions")
        if stance in _SIDES and self._body.postures.keys() >= set(_OFF_THE_SIDE):
            self._tries[stance] += 1
            # The arms in that posture tip the body onto its belly or its back: either will do.
            tip = _OFF_THE_SIDE[self._tries[stance] % 2]
            return dataclasses.replace(self._straight_way(tip, commands), end="")
        bridge = self._first_bridge(stance, wanted)
        if bridge is None:
            raise RouteError(f"it is {stance}, and no motions lead from there to {self._posture}")
        if stance in UPRIGHT and not self._is_near(bridge.start, commands):
            return self._within_stance(bridge.start, situation, commands)
        self._tries[stance] += 1
        return bridge

    def _first_bridge(self, begin: Stance | None, end: Stance) -> Motion | None:
        """Return the first of the motions that lead from a stance to another in the least time."""
        postures = self._body.postures
        paths: list[tuple[float, Stance | None, Motion | None]] = [(0.0, begin, None)]
        seen: set[Stance | None] = set()
        while paths:
            paths.sort(key=itemgetter(0), reverse=True)
            seconds, stance, first = paths.pop()
            if stance is end:
                return first
            if stance not in seen:
                seen.add(stance)
                paths += (
                    (seconds + motion.duration, postures[motion.end].stance, first or motion)
                    for motion in self._motions
                    if motion.start and motion.end and postures[motion.start].stance is stance
                )
        return None


class MotionRoute(_BodyRoute):
    """A motion, after the way into the posture in which it begins."""

    def __init__(self, body: Body, motion: Motion, motions: Iterable[Motion] = ()) -> None:
        super().__init__(body, motions)
        self._motion = motion
        self._legs = [motion]
        self._prepared = not motion.start

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the next leg. Raises RouteError when the motion cannot begin in the body's situation."""
        start = self._motion.start
        if not self._prepared:
            self._prepared = True
            stance, needed = stance_of(self._body, situation), self._body.postures[start].stance
            if stance is not needed:
                name = self._motion.name
                raise RouteError(f"{name} begins {needed}, in {start}, but the robot is {stance} now")
            if stance in UPRIGHT and not self._is_near(start, commands):
                return self._within_stance(start, situation, commands)
        return self._legs.pop() if self._legs else None

    def abandoned(self) -> Route | None:
        """Return the route to the safest posture while the motion changes the stance, None for a gesture."""
        return super().abandoned() if changes_stance(self._body, self._motion) else None


class SafestPostureRoute(_BodyRoute):
    """The way into the safest posture of the stance that the body is in: it crouches, or stays as it is."""

    _crouched = False

    def next_leg(self, situation: Situation, commands: Mapping[str, float]) -> Motion | None:
        """Return the leg into the crouch of a body that stands; None otherwise, and after it."""
        stands = stance_of(self._body, situation) is Stance.STANDING
        if self._crouched or not stands or _SAFEST not in self._body.postures:
            return None
        self._crouched = True
        return self._within_stance(_SAFEST, situation, commands)

    def abandoned(self) -> Route:
        """Return this route: nobody waits for its end."""
        return self


def changes_stance(body: Body, motion: Motion) -> bool:
    """Return whether a motion leads from one stance to another."""
    if not (motion.start and motion.end):
        return False
    return body.postures[motion.start].stance is not body.postures[motion.end].stance
