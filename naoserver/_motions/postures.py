"""Recognition of the stance and the posture that a body is in.

The postures of a body are in its description, grouped into stances: within a stance it goes from one posture
to another without losing its hold; from stance to stance it needs a motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver.kinematics import kinematics_of
from naoserver.parts import Stance
from naoserver.robot import Robot

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
            raise RobotError("the robot has fallen, and has no inertial unit that measures how it lies")
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
