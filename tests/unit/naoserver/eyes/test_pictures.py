"""What eyes see in pictures, compared with where things are."""

import math

import msgspec
import pytest

from naoserver.errors import HardwareFailure
from naoserver.eyes.looks import read_looks
from naoserver.eyes.pictures import PictureEyes
from naoserver.fake import FakeRobot
from naoserver.fake.robot import RADIUS
from naoserver_sim.arena import Arena
from naoserver_sim.world import RobotPlace, Sign, load_world
from tests.support.local_camera import local_cameras
from zenoh_ice import VirtualClock

SOCCER = load_world("soccer")
HERE = RobotPlace(name="red", position=(-1.5, 0.0), shirt=(0.9, 0.1, 0.1))
OPPOSITE = RobotPlace(name="blue", position=(0.3, 0.4), heading=math.pi, shirt=(0.1, 0.1, 0.9))


def of(reading, kind, camera="Camera"):
    return [thing for thing in reading.things if (thing.kind, thing.camera) == (kind, camera)]


def eyes_of(robot):
    looks = read_looks()
    if isinstance(robot, FakeRobot):
        looks = msgspec.structs.replace(looks, balls={"red": RADIUS, "green": RADIUS})
    return PictureEyes(local_cameras(robot), looks)


@pytest.fixture
def drawn():
    """Return a function that returns the first robot of a world, and what it sees in pictures."""
    made = []

    def see(*places, world=SOCCER):
        clock = VirtualClock()
        arena = Arena(msgspec.structs.replace(world, robots=places or (HERE,)), clock=clock, skin=False)
        made.append(arena)
        arena.start()
        clock.advance(0.5)
        return arena.robots[0], eyes_of(arena.robots[0]).look()

    yield see
    for arena in made:
        arena.close()


def test_balls_in_the_air_are_where_they_are_by_their_size():
    robot = FakeRobot()
    seen = {ball.name: ball for ball in of(eyes_of(robot).look(), "ball")}
    there = {ball.name: ball for ball in of(robot.eyes.look(), "ball")}
    assert seen.keys() == there.keys() == {"red", "green"}
    for name, ball in there.items():
        assert (seen[name].pan, seen[name].tilt) == pytest.approx((ball.pan, ball.tilt), abs=0.01)
        assert seen[name].distance == pytest.approx(ball.distance, rel=0.1)
        assert (seen[name].x, seen[name].y) == pytest.approx((ball.x, ball.y), abs=0.12)


def test_a_picture_is_looked_at_once():
    robot = FakeRobot()
    eyes = eyes_of(robot)
    assert eyes.look() is eyes.look()


def test_a_camera_that_fails_shows_nothing_until_it_works(caplog):
    class Fails(FakeRobot):
        failing = False

        def capture(self, camera, width, height):
            if self.failing and camera == "Camera":
                raise HardwareFailure("its cable is loose")
            return super().capture(camera, width, height)

    robot = Fails()
    eyes = eyes_of(robot)
    assert of(eyes.look(), "ball")
    robot.failing = True
    deadline = robot.clock.now() + 0.2
    while robot.clock.now() < deadline:
        reading = eyes.look()
    assert not of(reading, "ball")
    assert [record.message for record in caplog.records].count(
        "Camera shows nothing: its cable is loose"
    ) == 1


@pytest.mark.sim
@pytest.mark.gl
def test_a_ball_on_the_floor_is_where_it_lies(drawn):
    robot, reading = drawn()
    (seen,), (there,) = of(reading, "ball"), of(robot.eyes.look(), "ball")
    assert seen.name == "orange"
    assert (seen.left, seen.down) == pytest.approx((there.left, there.down), abs=0.005)
    assert seen.distance == pytest.approx(there.distance, rel=0.03)
    assert (seen.x, seen.y) == pytest.approx((there.x, there.y), abs=0.05)


@pytest.mark.sim
@pytest.mark.gl
def test_a_robot_is_seen_with_its_shirt(drawn):
    robot, reading = drawn(HERE, OPPOSITE)
    (seen,), (there,) = of(reading, "robot"), of(robot.eyes.look(), "robot")
    assert (seen.name, there.name) == ("blue", "blue")
    assert (seen.x, seen.y) == pytest.approx((there.x, there.y), abs=0.2)


@pytest.mark.sim
@pytest.mark.gl
def test_places_on_lines_are_on_lines(drawn):
    robot, reading = drawn()
    lines, there = of(reading, "line"), of(robot.eyes.look(), "line")
    assert 5 <= len(lines) <= 30
    for line in lines:
        if line.distance < 2.5:
            assert min(math.hypot(line.x - each.x, line.y - each.y) for each in there) < 0.3


@pytest.mark.sim
@pytest.mark.gl
def test_a_tag_is_seen_by_its_number(drawn):
    world = msgspec.structs.replace(
        SOCCER, field=None, balls=(), signs=(Sign(position=(0.0, 0.2), landmark=7),)
    )
    robot, reading = drawn(world=world)
    (seen,), (there,) = of(reading, "tag"), of(robot.eyes.look(), "tag")
    assert (seen.name, there.name) == ("7", "7")
    assert (seen.pan, seen.tilt) == pytest.approx((there.pan, there.tilt), abs=0.01)
    assert seen.distance == pytest.approx(there.distance, rel=0.06)
