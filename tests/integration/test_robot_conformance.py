"""What every robot must do, whatever its implementation: one suite, through proxies over Zenoh."""

import math
import threading
from itertools import pairwise

import pytest

from interfaces.jderobot import (
    CameraPrx,
    ConfigurationNotExistException,
    InvalidValueException,
    Pose3DEncodersPrx,
    Pose3DMotorsData,
    Pose3DMotorsPrx,
)
from interfaces.nao import ClockPrx, HealthPrx, JointsPrx, PoseHeadPrx
from naoserver.body import H25
from naoserver.servants.hinge import HINGES
from tests.support.conformance import ROBOTS
from tests.support.limits import EVENT_LIMIT, START_LIMIT
from tests.support.robot_server import wait_for
from zenoh_ice import MarshalException

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


def motors(**values):
    return Pose3DMotorsData(**(dict.fromkeys(Pose3DMotorsData.__struct_fields__, 0.0) | values))


# -- the body ------------------------------------------------------------------------------------------------


def test_it_has_the_joints_of_an_h25(body):
    assert body.getJointNames() == list(H25.joint_names)
    for limits, facts in zip(body.getJointLimits(), H25.joints, strict=True):
        assert (limits.name, limits.lower, limits.upper) == (facts.name, facts.lower, facts.upper)
        assert limits.maxVelocity == facts.max_velocity


def test_its_state_has_a_value_for_each_joint_and_moves_on_in_time(body):
    first = body.getJointState.wait(timeout=EVENT_LIMIT)
    second = body.getJointState.wait(after=first, timeout=EVENT_LIMIT)
    assert second.value.time > first.value.time
    assert second.time == second.value.time
    state = body.getJointState()
    for values in (state.positions, state.velocities, state.commands, state.torques):
        assert len(values) == 26
        assert all(math.isfinite(value) for value in values)


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


def test_the_hip_yaw_pitch_joints_move_as_one(body):
    names = body.getJointNames()
    left, right = names.index("LHipYawPitch"), names.index("RHipYawPitch")
    goal = body.getJointState().commands[left] - 0.05
    assert body.setJointPositions({"RHipYawPitch": goal}, 0.05)["RHipYawPitch"] == pytest.approx(goal)
    state = wait_for(body.getJointState, lambda state: abs(state.commands[left] - goal) < 1e-3)
    assert state.commands[right] == pytest.approx(state.commands[left], abs=1e-6)


# -- the hinges ----------------------------------------------------------------------------------------------


def test_every_hinge_is_served_with_the_limits_of_its_joints(nao):
    facts = {joint.name: joint for joint in H25.joints}
    for hinge in HINGES:
        params = nao.proxy(Pose3DMotorsPrx, f"{hinge.name}Motors").getPose3DMotorsParams()
        for axis, joint in hinge.joints:
            assert getattr(params, f"max{axis.capitalize()}") == facts[joint].upper
            assert getattr(params, f"min{axis.capitalize()}") == facts[joint].lower
        nao.proxy(Pose3DEncodersPrx, f"{hinge.name}Encoders").getPose3DEncodersData()


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
    wrist = nao.proxy(Pose3DMotorsPrx, "RightWristMotors")
    assert wrist.setPose3DMotorsData(motors(pan=9.0)) == 1
    assert wrist.getPose3DMotorsData().pan == wrist.getPose3DMotorsParams().maxPan
    assert wrist.setPose3DMotorsData(motors(pan=0.1)) == 0


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
def test_a_camera_describes_itself(camera):
    description = camera.getCameraDescription()
    assert (description.name, description.width, description.height, description.rate) == (
        "Camera",
        320,
        240,
        10.0,
    )
    assert 2 * math.atan(160 / description.fdistx) == pytest.approx(math.radians(56.3), abs=0.01)
    assert (description.u0, description.v0) == (159.5, 119.5)


@pytest.mark.gl
def test_an_image_is_what_its_description_says(camera):
    for name, channels in (("RGB8", 3), ("BGR8", 3), ("GRAY8", 1)):
        assert name in camera.getImageFormat()
        image = camera.getImageData(name)
        shape = image.description
        assert (shape.width, shape.height, shape.format) == (320, 240, name)
        assert shape.size == len(image.pixelData) == 320 * 240 * channels


@pytest.mark.gl
def test_images_are_timed_by_the_robots_clock(nao, camera):
    clock = nao.proxy(ClockPrx, "Clock")
    before = clock.getTime().time
    stamp = camera.getImageData("RGB8").timeStamp
    time = stamp.seconds + stamp.useconds / 1e6
    assert before - 5.0 <= time <= clock.getTime().time + 0.01


@pytest.mark.gl
def test_images_of_the_stream_are_a_period_apart(camera):
    assert camera.getImageFormat()[0] == "RGB8"
    times = []
    for sample in camera.getImageData.samples(timeout=START_LIMIT):
        assert sample.value.description.format == "RGB8"
        times.append(sample.time)
        if len(times) == 8:
            break
    assert times[-1] - times[0] > 0.35, (
        "a late one may come close to the next, but they are no more than asked for"
    )
    assert all(after > before for before, after in pairwise(times))


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


def test_a_setting_that_a_camera_does_not_have_is_refused(camera):
    for setting, value, reason in (
        ("width", 321, "321x240"),
        ("rate", 1000.0, "up to 30"),
        ("rate", math.nan, "nan"),
        ("rate", 0.0, "0"),
    ):
        description = camera.getCameraDescription()
        setattr(description, setting, value)
        with pytest.raises(ConfigurationNotExistException, match=reason):
            camera.setCameraDescription(description)
    assert camera.getCameraDescription().width == 320


def test_an_unknown_pixel_format_is_refused_with_those_there_are(camera):
    with pytest.raises(ConfigurationNotExistException, match=r"'PNG'.*RGB8"):
        camera.getImageData("PNG")


# -- clock, health, balls ------------------------------------------------------------------------------------


def test_the_clock_streams_a_time_that_goes_on(nao):
    clock = nao.proxy(ClockPrx, "Clock")
    first = clock.getTime.wait(timeout=EVENT_LIMIT)
    second = clock.getTime.wait(after=first, timeout=EVENT_LIMIT)
    assert second.value.time > first.value.time
    assert second.value.rate > 0.0
    assert second.value.simulated == nao.robot.clock.simulated


def test_health_reports_that_it_stands(nao):
    report = nao.proxy(HealthPrx, "Health").getHealth.wait(timeout=EVENT_LIMIT).value
    assert not report.fallen
    assert report.torsoTilt < 0.2
    assert report.cameraRates.keys() >= {"Camera", "CameraBottom"}
    assert report.uptime > 0


def test_what_was_limited_is_counted_and_reported_as_an_event(nao, body):
    health = nao.proxy(HealthPrx, "Health")
    before = health.getHealth().limitedCommands
    body.setJointPositions({"LWristYaw": 50.0}, 0.1)
    report = health.getHealth()
    assert report.limitedCommands == before + 1
    assert any(event.source == "LWristYaw" and "out of range" in event.message for event in report.events)


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


def test_joints_of_one_motor_are_as_stiff_as_each_other(body):
    assert body.setStiffnesses({"RHipYawPitch": 0.6}, 0.0) == {"RHipYawPitch": 0.6}
    names = body.getJointNames()
    both = [names.index(f"{side}HipYawPitch") for side in "LR"]
    wait_for(body.getJointState, lambda state: [state.stiffnesses[joint] for joint in both] == [0.6, 0.6])


def test_a_stiffness_that_cannot_be_is_refused_with_its_field(body):
    for stiffnesses, seconds, field in (
        ({"HeadYaw": 1.1}, 0.0, "HeadYaw"),
        ({"HeadYaw": math.nan}, 0.0, "HeadYaw"),
        ({"Tail": 0.5}, 0.0, "Tail"),
        ({"HeadYaw": 0.5}, -1.0, "seconds"),
        ({"HeadYaw": 0.5}, math.inf, "seconds"),
    ):
        with pytest.raises(InvalidValueException) as refusal:
            body.setStiffnesses(stiffnesses, seconds)
        assert refusal.value.field == field
    assert set(body.getJointState().stiffnesses) == {1.0}


# -- what is refused -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_is_refused_with_its_field(nao, head, body, value):
    refused = []
    for call in (
        lambda: head.setPose(value, 0.0, 0.5),
        lambda: head.setPose(0.0, 0.0, value),
        lambda: head.setSpeed(0.0, value),
        lambda: body.setJointPositions({"HeadYaw": 0.0, "LKneePitch": value}, 0.1),
        lambda: nao.proxy(Pose3DMotorsPrx, "NeckMotors").setPose3DMotorsData(motors(roll=value)),
        lambda: nao.proxy(Pose3DMotorsPrx, "NeckSpeed").setPose3DMotorsData(motors(tiltSpeed=value)),
    ):
        with pytest.raises(InvalidValueException) as refusal:
            call()
        refused.append(refusal.value.field)
    assert refused == ["pan", "fraction", "tilt", "LKneePitch", "roll", "tiltSpeed"]
    assert abs(head.getPose().pan) < TOLERANCE, "nothing moved, and the server lives"


@pytest.mark.parametrize("fraction", [0.0, -0.1, 1.01])
def test_a_fraction_out_of_its_domain_is_refused(head, fraction):
    with pytest.raises(InvalidValueException) as refusal:
        head.setPose(0.0, 0.0, fraction)
    assert refusal.value.field == "fraction"


def test_a_negative_speed_of_a_position_is_refused(nao):
    with pytest.raises(InvalidValueException) as refusal:
        nao.proxy(Pose3DMotorsPrx, "NeckMotors").setPose3DMotorsData(motors(panSpeed=-1.0))
    assert refusal.value.field == "panSpeed"


def test_an_unknown_joint_is_refused_and_no_joint_moves(body):
    with pytest.raises(InvalidValueException, match="HeadYaw") as refusal:
        body.setJointPositions({"HeadYaw": 0.5, "Tail": 0.0}, 0.5)
    assert refusal.value.field == "Tail"
    assert body.getJointState().commands[0] == pytest.approx(0.0, abs=1e-6)


def test_a_wrong_type_is_refused_with_the_field(body):
    with pytest.raises(MarshalException, match="targets"):
        body.setJointPositions({"HeadYaw": "left"}, 0.5)
    assert len(body.getJointState().positions) == 26
