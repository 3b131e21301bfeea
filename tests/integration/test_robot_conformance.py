"""How every robot must move, whatever its implementation: one suite, through proxies over Zenoh."""

import threading

import pytest

from interfaces.jderobot import (
    CameraPrx,
    MotorsPrx,
    Pose3DEncodersPrx,
    Pose3DMotorsPrx,
)
from interfaces.nao import HealthPrx, JointsPrx, PoseHeadPrx
from naoserver.body import H25
from tests.support.conformance import ROBOTS, motors, on_each_body
from tests.support.limits import EVENT_LIMIT
from tests.support.robot_server import eventually, wait_for

TOLERANCE = 0.05
"""Radians by which a joint that carries a load may miss its target."""
BALLS = ("BallRed", "BallGreen")


@pytest.fixture(params=ROBOTS)
def nao(request):
    """A robot that is served, and a client's session."""
    with request.param(None) as nao:
        yield nao


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
def test_joints_and_hinges_go_where_they_are_sent_and_stop_where_they_are(nao, body):
    targets = {"LShoulderPitch": 1.0, "RElbowRoll": 0.8, "HeadYaw": -0.4}
    assert body.setJointPositions(targets, 0.3) == targets
    places = {name: index for index, name in enumerate(body.getJointNames())}

    def arrived(state):
        return all(abs(state.positions[places[joint]] - goal) < TOLERANCE for joint, goal in targets.items())

    wait_for(body.getJointState, arrived)

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

    body.setJointPositions({"LShoulderPitch": -1.0}, 0.05)
    shoulder = nao.proxy(Pose3DEncodersPrx, "LeftShoulderEncoders")
    start = shoulder.getPose3DEncodersData().tilt
    wait_for(shoulder.getPose3DEncodersData, lambda data: data.tilt < start - 0.05)
    body.stop()
    place = places["LShoulderPitch"]
    state = wait_for(body.getJointState, lambda state: abs(state.velocities[place]) < 0.02)
    assert state.commands[place] > -0.9


def test_the_hips_share_a_motor(body, nao):
    names = body.getJointNames()
    left, right = both = [names.index(f"{side}HipYawPitch") for side in "LR"]
    goal = body.getJointState().commands[left] - 0.05
    assert body.setJointPositions({"RHipYawPitch": goal}, 0.05)["RHipYawPitch"] == pytest.approx(goal)
    state = wait_for(body.getJointState, lambda state: abs(state.commands[left] - goal) < 1e-3)
    assert state.commands[right] == pytest.approx(state.commands[left], abs=1e-6)

    # The joint of one side moves, and the hip of the other side is stopped.
    body.setJointPositions({"LHipYawPitch": goal - 0.2}, 0.02)
    wait_for(body.getJointState, lambda state: state.commands[left] < goal - 0.02)
    nao.proxy(Pose3DMotorsPrx, "RightHipMotors").stop()
    state = wait_for(body.getJointState, lambda state: abs(state.velocities[left]) < 0.005)
    assert state.commands[left] > goal - 0.19
    assert state.commands[right] == pytest.approx(state.commands[left], abs=1e-3)

    assert body.setStiffnesses({"RHipYawPitch": 0.6}, 0.0) == {"RHipYawPitch": 0.6}
    wait_for(body.getJointState, lambda state: [state.stiffnesses[joint] for joint in both] == [0.6, 0.6])


def test_what_was_limited_comes_back_is_counted_and_reported_as_an_event(nao, body):
    upper = H25.joints[0].upper
    assert body.setJointPositions({"HeadYaw": 100.0}, 0.2) == {"HeadYaw": upper}

    elbow = nao.proxy(Pose3DMotorsPrx, "RightElbowMotors")
    assert elbow.setPose3DMotorsData(motors(pan=9.0, roll=0.5)) == 1
    assert elbow.getPose3DMotorsData().pan == elbow.getPose3DMotorsParams().maxPan
    assert elbow.setPose3DMotorsData(motors(pan=0.1, roll=0.5)) == 0

    health = nao.proxy(HealthPrx, "Health")
    before = health.getHealth().limitedCommands
    body.setJointPositions({"LElbowYaw": 50.0}, 0.1)
    report = health.getHealth()
    assert report.limitedCommands == before + 1
    assert any(event.source == "LElbowYaw" and "out of range" in event.message for event in report.events)


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


# -- the head, and velocities --------------------------------------------------------------------------------


def test_the_head_goes_to_a_pose_and_turns_at_a_speed_by_either_name(nao):
    head, neck = nao.proxy(PoseHeadPrx, "Head"), nao.proxy(Pose3DMotorsPrx, "NeckSpeed")
    accepted = head.setPose(0.5, -0.2, 0.3)
    assert (accepted.pan, accepted.tilt) == (0.5, -0.2)
    wait_for(head.getPose, lambda pose: abs(pose.pan - 0.5) < TOLERANCE and abs(pose.tilt + 0.2) < TOLERANCE)

    # It keeps clear of the shoulders.
    assert head.setPose(1.526988, 0.5, 0.5).tilt == pytest.approx(0.200015)

    accepted = head.setSpeed(100.0, 0.0)
    head.stop()
    assert accepted.panSpeed == head.getLimits().maxPanSpeed

    # Until the first cycle after its command, its speed may be of what it did before.
    head.setPose(0.0, 0.0, 0.5)
    wait_for(head.getPose, lambda pose: abs(pose.pan) < TOLERANCE and abs(pose.panSpeed) < 0.02)

    def turns(pose):
        assert neck.setPose3DMotorsData(motors(panSpeed=-0.5, pan=1.0)) == 0  # it holds for half a second
        return pose.pan < -0.1 and neck.getPose3DMotorsData().panSpeed == -0.5

    wait_for(head.getPose, turns)
    head.stop()
    wait_for(head.getPose, lambda pose: abs(pose.panSpeed) < 0.02)
    assert neck.getPose3DMotorsData().panSpeed == 0.0
    assert neck.setPose3DMotorsData(motors(panSpeed=50.0)) == 1
    head.stop()


def test_a_velocity_of_the_head_or_the_walk_lasts_while_it_is_renewed_and_each_end_is_counted(nao):
    head, health = nao.proxy(PoseHeadPrx, "Head"), nao.proxy(HealthPrx, "Health")
    timeouts = health.getHealth().velocityTimeouts
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
    assert health.getHealth().velocityTimeouts > timeouts

    motors = nao.proxy(MotorsPrx, "Motors")
    timeouts = health.getHealth().velocityTimeouts
    motors.setV(0.08)
    eventually(lambda: motors.getV() == 0.0)
    eventually(lambda: health.getHealth().velocityTimeouts == timeouts + 1)


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


# -- balls ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("nao", ROBOTS[:2], indirect=True)  # nobody moves a ball beside a real robot
def test_the_balls_go_where_they_are_sent(nao):
    for ball in BALLS:
        ways = motors(pan=0.2, x=0.9, z=0.45, panSpeed=1.0, tiltSpeed=0.5)
        assert nao.proxy(Pose3DMotorsPrx, f"{ball}Motors").setPose3DMotorsData(ways) == 0
    for ball in BALLS:
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
