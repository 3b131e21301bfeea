"""How every robot moves for its clients, through proxies over Zenoh, beside what the shipped suite tests."""

import threading

import pytest

from interfaces.jderobot import (
    CameraPrx,
    Pose3DEncodersPrx,
    Pose3DMotorsPrx,
)
from interfaces.nao import HealthPrx, JointsPrx, PoseHeadPrx
from naoserver.bodies.parts import Axis
from naoserver.options import SafetyOptions, ServerOptions
from tests.support.conformance import (
    FAMILIES,
    WAYS,
    motors,
    on_each_with,
    pan_of,
    robots,
    tilt_of,
)
from tests.support.limits import EVENT_LIMIT
from tests.support.robot_server import wait_for

TOLERANCE = 0.05
"""Radians by which a joint that carries a load may miss its target."""
BALLS = ("BallRed", "BallGreen")
SLOW = 0.15
"""Speed of a head in rad/s at which it is far from its limit when a velocity ends late, on a busy machine."""


@pytest.fixture(params=robots(bodies=FAMILIES))
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


def hinged(*hinges):
    """Return what says whether a body has some hinges."""
    return lambda body: all(hinge in body.hinges for hinge in hinges)


def axis_of(nao, hinge, axis):
    return nao.robot.body.hinges[hinge][axis]


@on_each_with(hinged("LeftShoulder", "LeftElbow"), lambda body: body.neck, weight=True)
def test_joints_and_hinges_go_where_they_are_sent_and_stop_where_they_are(nao, body):
    angles = {
        axis_of(nao, "LeftShoulder", Axis.TILT): 1.0,
        axis_of(nao, "RightElbow", Axis.ROLL): 0.8,
        axis_of(nao, "Neck", Axis.PAN): -0.4,
    }
    targets = {axis.joint: axis.joint_angle(angle) for axis, angle in angles.items()}
    assert body.setJointPositions(targets, 0.3) == targets
    places = {name: index for index, name in enumerate(body.getJointNames())}

    def arrived(state):
        return all(abs(state.positions[places[joint]] - goal) < TOLERANCE for joint, goal in targets.items())

    wait_for(body.getJointState, arrived)

    elbow = nao.proxy(Pose3DMotorsPrx, "LeftElbowMotors")
    assert elbow.setPose3DMotorsData(motors(pan=-0.9, roll=-0.6, panSpeed=1.0, tiltSpeed=1.0)) == 0
    command = elbow.getPose3DMotorsData()
    goal = (command.pan, command.roll, command.panSpeed, command.tiltSpeed)
    assert goal == pytest.approx((-0.9, -0.6, 1.0, 1.0))
    encoders = nao.proxy(Pose3DEncodersPrx, "LeftElbowEncoders")
    data = wait_for(
        encoders.getPose3DEncodersData,
        lambda data: abs(data.pan + 0.9) < TOLERANCE and abs(data.roll + 0.6) < TOLERANCE,
    )
    assert data.tilt == data.x == 0.0

    raised = axis_of(nao, "LeftShoulder", Axis.TILT)
    body.setJointPositions({raised.joint: raised.joint_angle(-1.0)}, 0.05)
    shoulder = nao.proxy(Pose3DEncodersPrx, "LeftShoulderEncoders")
    start = shoulder.getPose3DEncodersData().tilt
    wait_for(shoulder.getPose3DEncodersData, lambda data: data.tilt < start - 0.05)
    body.stop()
    place = places[raised.joint]
    state = wait_for(body.getJointState, lambda state: abs(state.velocities[place]) < 0.02)
    assert raised.of(state.commands[place]) > -0.9


@on_each_with(lambda body: body.couplings)
def test_joints_that_share_a_motor_have_one_setpoint(body, nao):
    pair, names = nao.robot.body.couplings[0], body.getJointNames()
    left, right = names.index(pair.leader), names.index(pair.follower)
    goal = body.getJointState().commands[left] - 0.05
    assert body.setJointPositions({pair.follower: goal}, 0.05)[pair.follower] == pytest.approx(goal)
    state = wait_for(body.getJointState, lambda state: abs(state.commands[left] - goal) < 1e-3)
    assert state.commands[right] == pytest.approx(state.commands[left], abs=1e-6)


def test_what_was_limited_comes_back_is_counted_and_reported_as_an_event(nao, body):
    joint = pan_of(nao.robot.body)
    upper = nao.robot.body.joint[joint].upper
    assert body.setJointPositions({joint: 100.0}, 0.2) == {joint: upper}

    neck = nao.proxy(Pose3DMotorsPrx, "NeckMotors")
    assert neck.setPose3DMotorsData(motors(pan=-9.0, tilt=0.1)) == 1
    assert neck.getPose3DMotorsData().pan == pytest.approx(neck.getPose3DMotorsParams().minPan)
    assert neck.setPose3DMotorsData(motors(pan=0.1, tilt=0.1)) == 0

    health = nao.proxy(HealthPrx, "Health")
    before = health.getHealth().limitedCommands
    body.setJointPositions({joint: 50.0}, 0.1)
    report = health.getHealth()
    assert report.limitedCommands == before + 1
    assert any(event.source == joint and "out of range" in event.message for event in report.events)


@on_each_with(hinged("LeftShoulder"))
def test_a_hinge_that_is_stopped_stays_where_it_is_by_then(nao, body):
    shoulder = nao.proxy(Pose3DMotorsPrx, "LeftShoulderMotors")
    encoders = nao.proxy(Pose3DEncodersPrx, "LeftShoulderEncoders")
    start = encoders.getPose3DEncodersData().tilt
    shoulder.setPose3DMotorsData(motors(tilt=start - 1.0, tiltSpeed=0.3))
    wait_for(encoders.getPose3DEncodersData, lambda data: data.tilt < start - 0.1)
    shoulder.stop()
    axis = axis_of(nao, "LeftShoulder", Axis.TILT)
    place = body.getJointNames().index(axis.joint)
    state = wait_for(body.getJointState, lambda state: abs(state.velocities[place]) < 0.02)
    held = axis.of(state.commands[place])
    assert held > start - 0.9
    wait_for(encoders.getPose3DEncodersData, lambda data: abs(data.tilt - held) < TOLERANCE)
    assert shoulder.getPose3DMotorsData().tilt == pytest.approx(held, abs=TOLERANCE)


# -- the head, and velocities --------------------------------------------------------------------------------


def test_the_head_goes_to_a_pose_and_turns_at_a_speed_by_either_name(nao):
    head, neck = nao.proxy(PoseHeadPrx, "Head"), nao.proxy(Pose3DMotorsPrx, "NeckSpeed")
    accepted = head.setPose(0.5, -0.2, 0.3)
    assert (accepted.pan, accepted.tilt) == pytest.approx((0.5, -0.2))
    wait_for(head.getPose, lambda pose: abs(pose.pan - 0.5) < TOLERANCE and abs(pose.tilt + 0.2) < TOLERANCE)

    if any(table.dependent == tilt_of(nao.robot.body) for table in nao.robot.body.tables):
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


@pytest.fixture(params=robots(bodies=FAMILIES))
def soon_forgotten(request):
    """A robot that is served, whose velocities end soon, and a client's session."""
    with request.param(ServerOptions(safety=SafetyOptions(velocity_timeout=0.2))) as nao:
        yield nao


def test_a_velocity_of_the_head_lasts_while_it_is_renewed_and_its_end_is_counted(soon_forgotten):
    nao = soon_forgotten
    head, health = nao.proxy(PoseHeadPrx, "Head"), nao.proxy(HealthPrx, "Health")
    timeouts = health.getHealth().velocityTimeouts
    done = threading.Event()

    def renew():
        while not done.wait(0.05):
            head.setSpeed(SLOW, 0.0)

    renewing = threading.Thread(target=renew)
    renewing.start()
    try:
        wait_for(head.getPose, lambda pose: pose.pan > 0.2 and abs(pose.panSpeed - SLOW) < 0.05)
    finally:
        done.set()
        renewing.join(EVENT_LIMIT)
    wait_for(head.getPose, lambda pose: abs(pose.panSpeed) < 0.02)
    assert health.getHealth().velocityTimeouts > timeouts


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


@pytest.mark.parametrize(
    "nao", robots(bodies=FAMILIES, ways=WAYS[:2]), indirect=True
)  # nobody moves a ball beside a real robot
def test_the_balls_go_where_they_are_sent(nao):
    for ball in BALLS:
        ways = motors(pan=0.2, x=0.9, z=0.45, panSpeed=1.0, tiltSpeed=0.5)
        assert nao.proxy(Pose3DMotorsPrx, f"{ball}Motors").setPose3DMotorsData(ways) == 0
    for ball in BALLS:
        wait_for(
            nao.proxy(Pose3DEncodersPrx, f"{ball}Encoders").getPose3DEncodersData,
            lambda data: max(abs(data.pan - 0.2), abs(data.x - 0.9), abs(data.z - 0.45)) < 0.03,
        )
