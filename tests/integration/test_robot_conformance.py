"""How every robot must move, whatever its implementation: one suite, through proxies over Zenoh."""

import threading

import pytest

from interfaces.jderobot import (
    CameraPrx,
    Pose3DEncodersPrx,
    Pose3DMotorsPrx,
)
from interfaces.nao import HealthPrx, JointsPrx, PoseHeadPrx
from naoserver.body import H25
from tests.support.conformance import ROBOTS, motors, on_each_body
from tests.support.limits import EVENT_LIMIT
from tests.support.robot_server import wait_for

TOLERANCE = 0.05
"""Radians by which a joint that carries a load may miss its target."""
BALLS = ("BallRed", "BallGreen")


@pytest.fixture(params=ROBOTS)
def nao(request):
    """A robot that is served, and a client's session."""
    with request.param(None) as nao:
        yield nao


@pytest.fixture
def head(nao):
    return nao.proxy(PoseHeadPrx, "Head")


@pytest.fixture
def body(nao):
    return nao.proxy(JointsPrx, "Body")


@pytest.fixture
def camera(nao):
    camera = nao.proxy(CameraPrx, "Camera")
    camera.reset()
    return camera


# -- the body ------------------------------------------------------------------------------------------------


@on_each_body
def test_joints_go_where_they_are_sent(body):
    targets = {"LShoulderPitch": 1.0, "RElbowRoll": 0.8, "HeadYaw": -0.4}
    assert body.setJointPositions(targets, 0.3) == targets
    places = {name: index for index, name in enumerate(body.getJointNames())}

    def arrived(state):
        return all(abs(state.positions[places[joint]] - goal) < TOLERANCE for joint, goal in targets.items())

    wait_for(body.getJointState, arrived)


def test_a_target_out_of_range_comes_back_as_it_was_limited(body):
    upper = H25.joints[0].upper
    assert body.setJointPositions({"HeadYaw": 100.0}, 0.2) == {"HeadYaw": upper}


@on_each_body
def test_stop_holds_the_joints_where_they_are(nao, body):
    body.setJointPositions({"LShoulderPitch": -1.0}, 0.05)
    shoulder = nao.proxy(Pose3DEncodersPrx, "LeftShoulderEncoders")
    start = shoulder.getPose3DEncodersData().tilt
    wait_for(shoulder.getPose3DEncodersData, lambda data: data.tilt < start - 0.05)
    body.stop()
    names = body.getJointNames()
    state = wait_for(
        body.getJointState, lambda state: abs(state.velocities[names.index("LShoulderPitch")]) < 0.02
    )
    assert state.commands[names.index("LShoulderPitch")] > -0.9


@on_each_body
def test_the_hip_yaw_pitch_joints_move_as_one(body):
    names = body.getJointNames()
    left, right = names.index("LHipYawPitch"), names.index("RHipYawPitch")
    goal = body.getJointState().commands[left] - 0.05
    assert body.setJointPositions({"RHipYawPitch": goal}, 0.05)["RHipYawPitch"] == pytest.approx(goal)
    state = wait_for(body.getJointState, lambda state: abs(state.commands[left] - goal) < 1e-3)
    assert state.commands[right] == pytest.approx(state.commands[left], abs=1e-6)


# -- the hinges ----------------------------------------------------------------------------------------------


@on_each_body
def test_a_hinge_goes_where_it_is_sent_and_its_encoders_report(nao):
    elbow = nao.proxy(Pose3DMotorsPrx, "LeftElbowMotors")
    assert elbow.setPose3DMotorsData(motors(pan=-0.9, roll=-0.6, panSpeed=1.0, tiltSpeed=1.0)) == 0
    command = elbow.getPose3DMotorsData()
    assert (command.pan, command.roll, command.panSpeed, command.tiltSpeed) == (-0.9, -0.6, 1.0, 1.0)
    encoders = nao.proxy(Pose3DEncodersPrx, "LeftElbowEncoders")
    data = wait_for(
        encoders.getPose3DEncodersData,
        lambda data: abs(data.pan + 0.9) < TOLERANCE and abs(data.roll + 0.6) < TOLERANCE,
    )
    assert data.tilt == data.x == 0.0


def test_a_hinge_that_was_limited_says_so(nao):
    elbow = nao.proxy(Pose3DMotorsPrx, "RightElbowMotors")
    assert elbow.setPose3DMotorsData(motors(pan=9.0, roll=0.5)) == 1
    assert elbow.getPose3DMotorsData().pan == elbow.getPose3DMotorsParams().maxPan
    assert elbow.setPose3DMotorsData(motors(pan=0.1, roll=0.5)) == 0


def test_a_hinge_that_is_stopped_stays_where_it_is_by_then(nao, body):
    shoulder = nao.proxy(Pose3DMotorsPrx, "LeftShoulderMotors")
    encoders = nao.proxy(Pose3DEncodersPrx, "LeftShoulderEncoders")
    start = encoders.getPose3DEncodersData().tilt
    shoulder.setPose3DMotorsData(motors(tilt=start - 1.0, tiltSpeed=0.3))
    wait_for(encoders.getPose3DEncodersData, lambda data: data.tilt < start - 0.1)
    shoulder.stop()
    place = body.getJointNames().index("LShoulderPitch")
    state = wait_for(body.getJointState, lambda state: abs(state.velocities[place]) < 0.02)
    assert state.commands[place] > start - 0.9
    wait_for(encoders.getPose3DEncodersData, lambda data: abs(data.tilt - state.commands[place]) < TOLERANCE)
    assert shoulder.getPose3DMotorsData().tilt == pytest.approx(state.commands[place], abs=TOLERANCE)


@on_each_body
def test_a_hip_that_is_stopped_stops_the_joint_that_shares_its_motor(nao, body):
    names = body.getJointNames()
    left, right = names.index("LHipYawPitch"), names.index("RHipYawPitch")
    start = body.getJointState().commands[left]
    body.setJointPositions({"LHipYawPitch": start - 0.2}, 0.02)
    wait_for(body.getJointState, lambda state: state.commands[left] < start - 0.02)
    nao.proxy(Pose3DMotorsPrx, "RightHipMotors").stop()
    state = wait_for(body.getJointState, lambda state: abs(state.velocities[left]) < 0.005)
    assert state.commands[left] > start - 0.19
    assert state.commands[right] == pytest.approx(state.commands[left], abs=1e-3)


# -- the head ------------------------------------------------------------------------------------------------


def test_the_head_goes_to_a_pose(head):
    accepted = head.setPose(0.5, -0.2, 0.3)
    assert (accepted.pan, accepted.tilt) == (0.5, -0.2)
    wait_for(head.getPose, lambda pose: abs(pose.pan - 0.5) < TOLERANCE and abs(pose.tilt + 0.2) < TOLERANCE)


def test_the_head_keeps_clear_of_the_shoulders(head):
    assert head.setPose(1.526988, 0.5, 0.5).tilt == pytest.approx(0.200015)


def test_the_head_turns_at_a_speed_while_it_is_renewed_and_then_stops(nao, head):
    timeouts = nao.proxy(HealthPrx, "Health").getHealth().velocityTimeouts
    done = threading.Event()

    def renew():
        while not done.wait(0.1):
            head.setSpeed(0.4, 0.0)

    renewing = threading.Thread(target=renew)
    renewing.start()
    try:
        wait_for(head.getPose, lambda pose: pose.pan > 0.35 and abs(pose.panSpeed - 0.4) < 0.15)
    finally:
        done.set()
        renewing.join(EVENT_LIMIT)
    wait_for(head.getPose, lambda pose: abs(pose.panSpeed) < 0.02)
    assert nao.proxy(HealthPrx, "Health").getHealth().velocityTimeouts > timeouts


def test_the_speed_of_the_head_is_limited_and_reported(head):
    accepted = head.setSpeed(100.0, 0.0)
    head.stop()
    assert accepted.panSpeed == head.getLimits().maxPanSpeed


def test_the_neck_in_speed_is_the_neck_of_the_head(nao, head):
    neck = nao.proxy(Pose3DMotorsPrx, "NeckSpeed")

    def turns(pose):
        assert neck.setPose3DMotorsData(motors(panSpeed=-0.5, pan=1.0)) == 0  # it holds for half a second
        return pose.pan < -0.05 and neck.getPose3DMotorsData().panSpeed == -0.5

    wait_for(head.getPose, turns)
    head.stop()
    wait_for(head.getPose, lambda pose: abs(pose.panSpeed) < 0.02)
    assert neck.getPose3DMotorsData().panSpeed == 0.0
    assert neck.setPose3DMotorsData(motors(panSpeed=50.0)) == 1
    head.stop()


# -- cameras -------------------------------------------------------------------------------------------------


@pytest.mark.gl
def test_size_and_rate_can_be_set_and_reset(camera):
    description = camera.getCameraDescription()
    description.width, description.height, description.rate = 640, 480, 5.0
    assert camera.setCameraDescription(description) == 0
    image = camera.getImageData("GRAY8").description
    assert (image.width, image.height) == (640, 480)
    assert camera.getCameraDescription().rate == 5.0
    camera.reset()
    assert camera.getImageDescription().width == 320


# -- clock, health, balls ------------------------------------------------------------------------------------


def test_what_was_limited_is_counted_and_reported_as_an_event(nao, body):
    health = nao.proxy(HealthPrx, "Health")
    before = health.getHealth().limitedCommands
    body.setJointPositions({"LElbowYaw": 50.0}, 0.1)
    report = health.getHealth()
    assert report.limitedCommands == before + 1
    assert any(event.source == "LElbowYaw" and "out of range" in event.message for event in report.events)


@pytest.mark.parametrize("ball", BALLS)
def test_a_ball_goes_where_it_is_sent(nao, ball):
    if not nao.robot.mechanisms:
        pytest.skip("nobody moves a ball beside a real robot")
    assert (
        nao.proxy(Pose3DMotorsPrx, f"{ball}Motors").setPose3DMotorsData(
            motors(pan=0.2, x=0.9, z=0.45, panSpeed=1.0, tiltSpeed=0.5)
        )
        == 0
    )
    wait_for(
        nao.proxy(Pose3DEncodersPrx, f"{ball}Encoders").getPose3DEncodersData,
        lambda data: max(abs(data.pan - 0.2), abs(data.x - 0.9), abs(data.z - 0.45)) < 0.03,
    )


# -- stiffness -----------------------------------------------------------------------------------------------


def test_a_joint_that_is_limp_heeds_nobody_until_it_is_stiff_again(body):
    yaw = body.getJointNames().index("HeadYaw")
    assert body.setStiffnesses({"HeadYaw": 0.0}, 0.0) == {"HeadYaw": 0.0}
    wait_for(body.getJointState, lambda state: state.stiffnesses[yaw] == 0.0)
    body.setJointPositions({"HeadYaw": 0.5}, 1.0)
    body.setJointPositions({"HeadPitch": 0.2}, 1.0)
    state = wait_for(body.getJointState, lambda state: abs(state.positions[yaw + 1] - 0.2) < TOLERANCE)
    assert abs(state.positions[yaw]) < TOLERANCE
    body.setStiffnesses({"HeadYaw": 1.0}, 0.1)
    wait_for(body.getJointState, lambda state: state.stiffnesses[yaw] == 1.0)
    body.setJointPositions({"HeadYaw": 0.4}, 1.0)
    wait_for(body.getJointState, lambda state: abs(state.positions[yaw] - 0.4) < TOLERANCE)


@on_each_body
def test_joints_of_one_motor_are_as_stiff_as_each_other(body):
    assert body.setStiffnesses({"RHipYawPitch": 0.6}, 0.0) == {"RHipYawPitch": 0.6}
    names = body.getJointNames()
    both = [names.index(f"{side}HipYawPitch") for side in "LR"]
    wait_for(body.getJointState, lambda state: [state.stiffnesses[joint] for joint in both] == [0.6, 0.6])
