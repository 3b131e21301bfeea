"""Robots in pictures."""

import math

import pytest

from naoserver_sim.world import RobotPlace

HERE = RobotPlace(name="red", position=(-1.5, 0.0), shirt=(0.9, 0.1, 0.1))
OPPOSITE = RobotPlace(name="blue", position=(0.3, 0.4), heading=math.pi, shirt=(0.1, 0.1, 0.9))


def of(reading, kind):
    return [thing for thing in reading.things if (thing.kind, thing.camera) == (kind, "Camera")]


@pytest.mark.sim
@pytest.mark.gl
def test_a_robot_is_seen_with_its_shirt(drawn):
    robot, reading = drawn(HERE, OPPOSITE)
    (seen,), (there,) = of(reading, "robot"), of(robot.eyes.look(), "robot")
    assert (seen.name, there.name) == ("blue", "blue")
    assert (seen.x, seen.y) == pytest.approx((there.x, there.y), abs=0.2)
