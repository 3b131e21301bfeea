"""What a fake robot sees, by the servant that says so."""

import math

import pytest

from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from zenoh_ice import VirtualClock


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def robot(clock):
    return FakeRobot(clock)


@pytest.fixture
def sight(robot, clock):
    return Assembly(robot, ServerOptions(), clock).servants["Sight"]


def balls(sight):
    found = [thing for thing in sight.getSight(None).things if thing.camera == "Camera"]
    assert {thing.kind for thing in found} <= {"ball"}
    return {thing.name: thing for thing in found}


def test_both_balls_are_where_they_are(robot, sight):
    found = balls(sight)
    for ball in robot.mechanisms:
        pan, distance, _ = ball.read().positions
        seen = found[ball.name.removeprefix("Ball").lower()]
        place = distance * math.cos(pan), distance * math.sin(pan)
        assert (seen.x, seen.y) == pytest.approx(place, abs=1e-6)
        assert seen.pan == pytest.approx(math.atan2(place[1], place[0]), abs=0.05)


def test_a_head_that_turns_sees_them_elsewhere_in_the_picture_but_not_beside_the_torso(robot, sight, clock):
    before = balls(sight)["red"]
    robot.command_positions({"HeadYaw": 0.3}, {"HeadYaw": 3.0})
    clock.advance(1.0)
    after = balls(sight)["red"]
    assert after.left == pytest.approx(before.left - 0.3, abs=0.05)
    assert after.pan == pytest.approx(before.pan, abs=0.05)
    assert after.time > before.time


def test_what_is_out_of_the_picture_is_not_seen(robot, sight):
    robot.place({"HeadYaw": 2.0})
    assert balls(sight) == {}
