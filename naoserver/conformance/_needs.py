"""What a test needs of a robot, by the words with which it is skipped, and the joints that it may move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import pytest

from naoserver.body import Body
from naoserver.parts import Joint
from naoserver.robot import Robot

STEP: Final = 0.15
"""How far a test moves a joint, at most: in rad, or in m."""


@dataclass(frozen=True)
class Need:
    """A part of a robot without which a test means nothing."""

    lacking: str
    """How a robot without it is described, such as `no walk`."""
    has: Callable[[Robot], object]


def needs(*parts: Need) -> pytest.MarkDecorator:
    """Skip a test, by the name of what is missing, for a robot that lacks one of the parts."""
    return pytest.mark.needs(*parts)


def free_joints(body: Body) -> list[Joint]:
    """Return the joints that may move alone, those first that carry least: no legs, wheels, couplings."""
    bound = {name for pair in body.couplings for name in (pair.leader, pair.follower)}
    bound |= {*body.groups.wheels}
    if not body.mounted:
        bound |= {*body.groups.legs}
    free = (joint for joint in body.joints if joint.name not in bound)
    able = (joint for joint in free if joint.max_torque > 0.0 and step_of(joint) > 0.01)
    return sorted(able, key=lambda joint: _mass_on(body, joint))


def _mass_on(body: Body, joint: Joint) -> float:
    """Return the mass in kg that a joint moves."""
    carried = {joint.child}
    for link in body.links:  # each after the one that carries it
        if (by := body.moved_by.get(link.name)) is not None and by.parent in carried:
            carried.add(link.name)
    return sum(link.mass for link in body.links if link.name in carried)


def step_of(joint: Joint) -> float:
    """Return how far a test moves a joint: in rad, or in m."""
    return min(STEP, 0.2 * (joint.upper - joint.lower))


def tolerance_of(joint: Joint) -> float:
    """Return how far a joint may be from its setpoint: one that carries a load, or has some play."""
    return step_of(joint) / 3.0


def speed_of(joint: Joint) -> float:
    """Return how fast a test moves a joint, in half a second or more: in rad/s, or in m/s."""
    return min(2.0 * step_of(joint), 0.25 * joint.max_velocity)


def slowly(robot: Robot, joint: Joint) -> float:
    """Return the fraction of full speed at which a step takes 4 s of the wall: time to stop it."""
    return step_of(joint) / joint.max_velocity / (4.0 * max(1.0, robot.clock.rate))


def target_of(joint: Joint, position: float) -> float:
    """Return the place a step away from a position, to where there is more room."""
    return position + (
        step_of(joint) if joint.upper - position >= position - joint.lower else -step_of(joint)
    )


def _stands(robot: Robot) -> bool:
    """Return whether a robot is upright, with its weight on the pressure sensors of its soles."""
    if robot.senses is None or robot.state().torso_tilt > 0.2:
        return False
    reading = robot.senses.read()
    return reading.left_foot.total + reading.right_foot.total > 2.0 * robot.body.mass


JOINT: Final = Need("no joint that may move alone", lambda robot: free_joints(robot.body))
COUPLING: Final = Need("no couplings", lambda robot: robot.body.couplings)
CAMERA: Final = Need("no camera", lambda robot: robot.cameras)
INERTIAL_UNIT: Final = Need("no inertial unit", lambda robot: robot.body.inertial_unit)
PRESSURE: Final = Need("no pressure sensors", lambda robot: any(sole.pressure for sole in robot.body.soles))
STANDING: Final = Need("it does not stand on its feet", _stands)
SONAR: Final = Need("no sonar", lambda robot: robot.body.sonar)
TOUCH: Final = Need("no touch sensors", lambda robot: robot.body.touch)
BATTERY: Final = Need("no battery", lambda robot: robot.body.battery)
LIGHTS: Final = Need("no lights", lambda robot: robot.body.lights)
VOICE: Final = Need("no voice", lambda robot: robot.voice)
LOUDSPEAKER: Final = Need("no loudspeaker", lambda robot: robot.loudspeaker)
WALK: Final = Need("no walk", lambda robot: robot.walker)
ROOM: Final = Need("no --room", lambda _: True)
"""The word of who runs the suite that there is free floor around the robot."""
