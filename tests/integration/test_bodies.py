"""Robots that are no Naos, served as every robot: what they announce, and how it moves them."""

import json
import math

import pytest

from interfaces.jderobot import (
    CameraPrx,
    Pose3DEncodersPrx,
    Pose3DMotorsPrx,
)
from interfaces.nao import DescriptionPrx, HealthPrx, JointsPrx, PoseHeadPrx
from naoserver.body import LARGEST_DESCRIPTION
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from tests.support.bodies import ARM, CART, GIANT
from tests.support.conformance import motors
from tests.support.limits import FOREVER
from tests.support.robot_server import clock_at, eventually, served_to_client, wait_for

ALWAYS = {"Body", "Clock", "Description", "Faults", "Health", "Safety", "Team"}
BALLS = {f"Ball{color}{part}" for color in ("Red", "Green") for part in ("Motors", "Encoders")}
MOVING = {"Motors", "Encoders", "Walk"}
NECK = {"NeckMotors", "NeckEncoders", "NeckSpeed", "Head"}
PATIENT = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER))
"""For tests in which a velocity is to last."""


@pytest.fixture(scope="module")
def cart():
    with served_to_client(FakeRobot(clock_at(4.0), body=CART), PATIENT) as robot:
        yield robot


@pytest.fixture(scope="module")
def giant():
    with served_to_client(FakeRobot(body=GIANT)) as robot:
        yield robot


@pytest.fixture(scope="module")
def arm():
    with served_to_client(FakeRobot(body=ARM)) as robot:
        yield robot


def angle_of(robot, joint):
    state = robot.proxy(JointsPrx, "Body").getJointState()
    return state.positions[robot.robot.body.joint_names.index(joint)]


def reported(robot):
    return [event.message for event in robot.proxy(HealthPrx, "Health").getHealth().events]


# -- what is announced --------------------------------------------------------------------------------------------


def test_a_cart_serves_what_it_has(cart):
    senses = {"Touch", "Battery", "Sonar"}
    expected = ALWAYS | BALLS | MOVING | NECK | senses | {"Camera", "Leds", "Sight"}
    assert set(cart.communicator.identities()) == expected


def test_an_arm_serves_its_joints_and_its_hinge(arm):
    assert set(arm.communicator.identities()) == ALWAYS | BALLS | {"CraneMotors", "CraneEncoders"}


def test_a_humanoid_serves_what_it_has(giant):
    shoulders = {f"{side}Shoulder{part}" for side in ("Left", "Right") for part in ("Motors", "Encoders")}
    expected = ALWAYS | BALLS | MOVING | NECK | shoulders | {"Camera", "InertialUnit", "Sight"}
    assert set(giant.communicator.identities()) == expected


def test_a_description_as_large_as_it_may_be_arrives(monkeypatch):
    looks = json.dumps("x" * (LARGEST_DESCRIPTION - 2))
    monkeypatch.setattr(FakeRobot, "looks", lambda _: looks)
    with served_to_client(FakeRobot(body=ARM)) as robot:
        assert robot.proxy(DescriptionPrx, "Description").getLooks() == looks


# -- hinges -------------------------------------------------------------------------------------------------------


def test_an_axis_turns_with_its_sign_from_its_zero(cart):
    neck, encoders = cart.proxy(Pose3DMotorsPrx, "NeckMotors"), cart.proxy(Pose3DEncodersPrx, "NeckEncoders")
    assert neck.setPose3DMotorsData(motors(pan=0.4, tilt=-0.3, panSpeed=4.0, tiltSpeed=3.0)) == 0
    there = wait_for(encoders.getPose3DEncodersData, lambda now: abs(now.pan - 0.4) < 1e-4)
    assert there.pan == pytest.approx(0.4, abs=1e-3)
    assert angle_of(cart, "mast_turn") == pytest.approx(0.1, abs=1e-3)
    wait_for(encoders.getPose3DEncodersData, lambda now: abs(now.tilt + 0.3) < 1e-4)
    assert angle_of(cart, "gimbal_tilt") == pytest.approx(-0.05, abs=1e-3)
    goal = neck.getPose3DMotorsData()
    assert (goal.pan, goal.tilt, goal.panSpeed, goal.tiltSpeed) == pytest.approx((0.4, -0.3, 4.0, 3.0))


def test_the_limits_of_an_axis_are_those_of_its_joint_seen_from_the_axis(cart):
    params = cart.proxy(Pose3DMotorsPrx, "NeckMotors").getPose3DMotorsParams()
    assert (params.minPan, params.maxPan) == pytest.approx((-1.5, 1.5))
    assert (params.minTilt, params.maxTilt) == pytest.approx((-0.75, 0.75))
    assert (params.maxPanSpeed, params.maxTiltSpeed) == (4.0, 3.0)
    limits = cart.proxy(PoseHeadPrx, "Head").getLimits()
    assert (limits.minPan, limits.maxPan, limits.maxPanSpeed) == pytest.approx((-1.5, 1.5, 4.0))
    assert (limits.minTilt, limits.maxTilt, limits.maxTiltSpeed) == pytest.approx((-0.75, 0.75, 3.0))


def test_a_velocity_turns_an_axis_in_its_own_direction(cart):
    head, speed = cart.proxy(PoseHeadPrx, "Head"), cart.proxy(Pose3DMotorsPrx, "NeckSpeed")
    head.setPose(0.0, 0.0, 1.0)
    wait_for(head.getPose, lambda now: abs(now.pan) < 1e-3 and abs(now.tilt) < 1e-3)
    accepted = head.setSpeed(0.5, 0.25)
    assert (accepted.panSpeed, accepted.tiltSpeed) == pytest.approx((0.5, 0.25))
    moving = wait_for(head.getPose, lambda now: now.pan > 0.1 and now.panSpeed > 0.4)
    assert moving.tilt > 0.0
    assert angle_of(cart, "mast_turn") < 0.5 - 0.1
    command = speed.getPose3DMotorsData()
    assert (command.panSpeed, command.tiltSpeed) == pytest.approx((0.5, 0.25))
    assert speed.setPose3DMotorsData(motors(panSpeed=-0.5)) == 0
    wait_for(head.getPose, lambda now: now.panSpeed < -0.4)
    head.stop()
    eventually(lambda: cart.assembly.body.velocity("mast_turn") == 0.0)


def test_a_shoulder_hangs_at_the_same_tilt_on_every_humanoid(giant):
    shoulder = giant.proxy(Pose3DMotorsPrx, "LeftShoulderMotors")
    encoders = giant.proxy(Pose3DEncodersPrx, "LeftShoulderEncoders")
    assert encoders.getPose3DEncodersData().tilt == pytest.approx(math.pi / 2)
    shoulder.setPose3DMotorsData(motors(tilt=1.0, tiltSpeed=4.0))
    eventually(lambda: abs(angle_of(giant, "port_swing") - (1.0 - math.pi / 2)) < 1e-3)


def test_the_waist_is_the_neck_of_a_humanoid_whose_camera_it_turns(giant):
    giant.proxy(PoseHeadPrx, "Head").setPose(0.3, 0.1, 1.0)
    eventually(lambda: abs(angle_of(giant, "belt_turn") - 0.3) < 1e-3)
    eventually(lambda: abs(angle_of(giant, "belt_bow") - 0.1) < 1e-3)


def test_a_speed_rule_of_the_body_limits_its_joints(giant):
    params = giant.proxy(Pose3DMotorsPrx, "LeftShoulderMotors").getPose3DMotorsParams()
    assert params.maxTiltSpeed == pytest.approx(1.0), "its knees are straight"
    giant.proxy(JointsPrx, "Body").setJointPositions({"port_shin": 0.5}, 1.0)
    shoulder = giant.proxy(Pose3DMotorsPrx, "RightShoulderMotors")
    eventually(lambda: shoulder.getPose3DMotorsParams().maxTiltSpeed == 4.0)


# -- cameras ------------------------------------------------------------------------------------------------------


def test_a_camera_shows_the_floor_from_the_link_that_carries_it(cart):
    head = cart.proxy(PoseHeadPrx, "Head")
    head.setPose(0.5, 0.5, 1.0)
    wait_for(head.getPose, lambda now: abs(now.pan - 0.5) < 1e-4 and abs(now.tilt - 0.5) < 1e-4)
    camera = cart.proxy(CameraPrx, "Camera")
    view = camera.getCameraDescription()
    assert len(camera.getImageData("RGB8").pixelData) == 320 * 240 * 3
    point = camera.getFloorPoint(view.u0, view.v0, 0.0)
    # The camera is ahead of the axis of the tilt, 0.6 m above the floor and 0.1 m in front of the middle.
    way = 0.05 * math.cos(0.5) + (0.6 - 0.05 * math.sin(0.5)) / math.tan(0.5)
    assert (point.x, point.y) == pytest.approx((0.1 + way * math.cos(0.5), way * math.sin(0.5)), abs=0.01)


# -- wheels -------------------------------------------------------------------------------------------------------


def test_a_wheel_turns_without_end_for_clients_too(cart):
    body = cart.proxy(JointsPrx, "Body")
    wheel = body.getJointLimits()[0]
    assert (wheel.name, wheel.lower, wheel.upper) == ("drive_port", -math.inf, math.inf)
    assert body.setJointPositions({"drive_port": 40.0}, 1.0) == {"drive_port": 40.0}
    eventually(lambda: angle_of(cart, "drive_port") > 1.0)
    body.stop()
