"""Balls in pictures."""

import msgspec
import pytest

from naoserver.eyes._pictures import PictureEyes
from naoserver.eyes.looks import read_looks
from naoserver.fake import FakeRobot
from naoserver.fake.robot import RADIUS
from tests.support.local_camera import local_cameras
from tests.support.present import present


def of(reading, kind):
    return [thing for thing in reading.things if (thing.kind, thing.camera) == (kind, "Camera")]


def test_balls_in_the_air_are_where_they_are_by_their_size():
    robot = FakeRobot()
    assert robot.eyes is not None
    looks = msgspec.structs.replace(read_looks(), balls={"red": RADIUS, "green": RADIUS})
    seen = {ball.name: ball for ball in of(PictureEyes(local_cameras(robot), looks).look(), "ball")}
    there = {ball.name: ball for ball in of(present(robot.eyes).look(), "ball")}
    assert seen.keys() == there.keys() == {"red", "green"}
    for name, ball in there.items():
        assert (seen[name].pan, seen[name].tilt) == pytest.approx((ball.pan, ball.tilt), abs=0.01)
        assert seen[name].distance == pytest.approx(ball.distance, rel=0.1)
        assert (seen[name].x, seen[name].y) == pytest.approx((ball.x, ball.y), abs=0.12)


@pytest.mark.sim
@pytest.mark.gl
def test_a_ball_on_the_floor_is_where_it_lies(drawn):
    robot, reading = drawn()
    (seen,), (there,) = of(reading, "ball"), of(present(robot.eyes).look(), "ball")
    assert seen.name == "orange"
    assert (seen.left, seen.down) == pytest.approx((there.left, there.down), abs=0.005)
    assert seen.distance == pytest.approx(there.distance, rel=0.03)
    assert (seen.x, seen.y) == pytest.approx((there.x, there.y), abs=0.05)
