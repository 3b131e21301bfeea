"""The fake robot keeps the contract of `naoserver.robot`, in virtual time."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.bodies.kinematics import matrix_of
from naoserver.bodies.parts import Axis
from naoserver.errors import HardwareFailure
from naoserver.fake import FakeRobot
from naoserver.fake.robot import LAG, Ball, project
from tests.support.bodies import ARM, CART
from tests.support.linkage import LINKAGE
from zenoh_ice.threads.clock import VirtualClock


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def robot(clock):
    return FakeRobot(clock, posture={})


def head(robot):
    reading = robot.read()
    return reading.commands[0], reading.positions[0], reading.velocities[0]


def test_a_position_command_moves_the_setpoint_at_its_speed(robot, clock):
    robot.command_positions({"HeadYaw": 1.0}, {"HeadYaw": 0.5})
    clock.advance(1.0)
    setpoint, position, velocity = head(robot)
    assert setpoint == pytest.approx(0.5)
    assert position == pytest.approx(0.5 - 0.5 * LAG, abs=1e-6)
    assert velocity == pytest.approx(0.5)
    clock.advance(2.0)
    assert head(robot) == pytest.approx((1.0, 1.0, 0.0))


def test_a_velocity_command_goes_on_until_the_limit(robot, clock):
    robot.command_velocities({"HeadYaw": -1.0})
    clock.advance(1.5)
    assert head(robot)[0] == pytest.approx(-1.5)
    clock.advance(1.5)
    assert head(robot)[0] == robot.joints[0].lower


@pytest.mark.parametrize("target", [{"grip": 0.4}, {"pinch": -0.7}, {"grip": 0.4, "pinch": 0.0}])
def test_a_follower_is_where_its_leader_takes_it_whoever_is_commanded(clock, target):
    robot = FakeRobot(clock, body=LINKAGE)
    assert robot.read().positions[-1] == pytest.approx(0.1)
    robot.command_positions(target, dict.fromkeys(target, 1.0))
    for _ in range(20):
        clock.advance(0.1)
        grip, pinch = robot.read().positions[-2:]
        assert pinch == pytest.approx(0.1 - 2.0 * grip)
    assert grip == pytest.approx(0.4)


def test_a_passive_joint_stays_where_it_is_without_a_motor(clock):
    robot = FakeRobot(clock, body=LINKAGE)
    robot.command_stiffnesses({"swing": 1.0}, 0.0)
    robot.command_positions({"swing": 1.0}, {"swing": 1.0})
    clock.advance(1.0)
    reading, place = robot.read(), LINKAGE.joint_names.index("swing")
    assert (reading.positions[place], reading.commands[place], reading.stiffnesses[place]) == (0.0, 0.0, 0.0)


@given(st.lists(st.floats(0.001, 0.4), max_size=8))
def test_its_answers_do_not_depend_on_how_often_it_is_asked(steps):
    clocks = [VirtualClock(), VirtualClock()]
    asked, left_alone = (FakeRobot(clock) for clock in clocks)
    for robot in (asked, left_alone):
        robot.command_positions({"HeadYaw": 1.0}, {"HeadYaw": 0.7})
    for step in steps:
        clocks[0].advance(step)
        asked.read()
    clocks[1].advance(clocks[0].now())
    assert asked.read().positions == pytest.approx(left_alone.read().positions, abs=1e-6)


def test_after_close_it_stands_still(robot, clock):
    robot.command_velocities({"HeadYaw": 1.0})
    robot.close()
    robot.close()
    robot.command_velocities({"HeadYaw": 1.0})
    before = robot.read()
    clock.advance(1.0)
    assert robot.read() == before
    with pytest.raises(HardwareFailure, match="closed"):
        robot.capture("Camera", 320, 240)


def test_the_camera_sees_a_ball_where_the_head_does_not_look(robot, clock):
    frame = robot.capture("Camera", 320, 240)
    assert frame.pixels.shape == (240, 320, 3)
    assert not np.array_equal(frame.pixels[0, 0], (220, 30, 30))
    reds = np.argwhere((frame.pixels == (220, 30, 30)).all(axis=2))
    assert len(reds) > 100
    assert reds[:, 1].mean() > 160, "a ball to the right is right of the centre"
    robot.command_positions({"HeadYaw": -0.15}, {"HeadYaw": 5.0})
    clock.advance(1.0)
    reds = np.argwhere((robot.capture("Camera", 320, 240).pixels == (220, 30, 30)).all(axis=2))
    assert reds[:, 1].mean() + 0.5 == pytest.approx(160, abs=1.0)


def test_the_camera_of_any_body_sees_from_the_link_that_carries_it(clock):
    robot = FakeRobot(clock, body=CART)
    next(ball for ball in robot.mechanisms if ball.name == "BallRed").place(
        {"BallRedPan": -0.3, "BallRedDistance": 1.0, "BallRedHeight": 0.6}
    )
    bearing = math.atan2(math.sin(-0.3), math.cos(-0.3) - 0.1)  # the mast is 0.1 m ahead
    pan = CART.hinges["Neck"][Axis.PAN]
    robot.place({pan.joint: pan.joint_angle(bearing), "gimbal_tilt": 0.25})
    reds = np.argwhere((robot.capture("Camera", 320, 240).pixels == (220, 30, 30)).all(axis=2))
    assert reds.mean(axis=0) + 0.5 == pytest.approx((120.0, 160.0), abs=1.0)


def test_a_robot_has_no_more_than_its_body(clock):
    robot = FakeRobot(clock, body=ARM)
    assert (robot.lights, robot.voice, robot.walker, robot.cameras) == (None, None, None, ())
    assert (robot.senses.touch_names, robot.senses.sonar_range) == ((), None)
    reading = robot.senses.read()
    assert reading.left_foot.total == 0.0
    assert math.isnan(reading.battery.charge)


def test_looking_down_raises_the_ball_in_the_image():
    ball = Ball(0.0, 1.0, 0.5)
    ahead, down = (matrix_of((0.0, 0.0, 0.5, 0.0, pitch, 0.0)) for pitch in (0.0, 0.3))
    assert project(down, ball)[2] > project(ahead, ball)[2] == 0.0


def test_the_focal_length_gives_the_field_of_view(robot):
    camera = robot.cameras[0]
    assert 2 * math.atan(160 / camera.focal_length(320)) == pytest.approx(camera.horizontal_fov)


def test_a_camera_that_fails_says_why(clock):
    with pytest.raises(HardwareFailure, match="libegl1"):
        FakeRobot(clock, camera_failure="install libegl1").capture("Camera", 320, 240)


def test_an_unknown_camera_is_named(robot):
    with pytest.raises(HardwareFailure, match="'CameraBack'"):
        robot.capture("CameraBack", 320, 240)


def test_a_joint_that_is_placed_is_there_at_once_and_stays(robot, clock):
    robot.command_velocities({"HeadYaw": 1.0})
    clock.advance(0.5)
    robot.place({"HeadYaw": -0.7})
    assert head(robot) == pytest.approx((-0.7, -0.7, 0.0))
    clock.advance(1.0)
    assert head(robot) == pytest.approx((-0.7, -0.7, 0.0))


def test_a_joint_that_becomes_limp_on_its_way_stays_where_it_is(robot, clock):
    robot.command_positions({"HeadYaw": 1.0}, {"HeadYaw": 1.0})
    robot.command_stiffnesses({"HeadYaw": 0.0}, 0.5)
    clock.advance(2.0)
    reading = robot.read()
    yaw = reading.positions[0]
    assert yaw == pytest.approx(0.5, abs=0.03), "it moved until then"
    assert reading.commands[0] == yaw
    robot.command_stiffnesses({"HeadYaw": 1.0}, 0.0)
    clock.advance(1.0)
    assert robot.read().positions[0] == yaw
