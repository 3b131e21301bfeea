"""Hinges, head, streams and cameras, as clients use them."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import pytest
from msgspec.structs import replace

from interfaces.jderobot import (
    CameraPrx,
    EncodersPrx,
    Pose3DEncodersPrx,
    Pose3DMotorsData,
    Pose3DMotorsPrx,
)
from interfaces.nao import ClockPrx, FootPressurePrx, HealthPrx, InertialUnitPrx, JointsPrx, PoseHeadPrx
from naoserver.bodies.parts import Axis, Joint
from naoserver.conformance._robot import (
    CAMERA,
    HINGE,
    NECK,
    RobotClient,
    free_hinge,
    needs,
    slowly,
    speed_of,
    target_of,
    tolerance_of,
)
from naoserver.conformance.test_safety import check_it_is_held

TURN = 0.15
"""Velocity of a head in rad/s."""
TOLERANCE = 0.05
"""In rad/s."""


class Way(NamedTuple):
    """An axis of a hinge, and how a test moves it."""

    axis: Axis
    joint: Joint
    place: int
    start: float
    target: float

    def done(self, at: float) -> float:
        """Return the part of the way that is behind it."""
        return (at - self.start) / (self.target - self.start)

    def arrived(self, at: float) -> bool:
        return abs(at - self.target) < tolerance_of(self.joint)


def way_of(nao: RobotClient, hinge: str, axis: Axis) -> Way:
    """Return the way of an axis from where it is to a step away."""
    of, body = nao.robot.body.hinges[hinge][axis], nao.robot.body
    joint, place = body.joint[of.joint], body.joint_names.index(of.joint)
    start = nao.robot.read().commands[place]
    return Way(axis, joint, place, of.of(start), of.of(target_of(joint, start)))


@needs(HINGE)
def test_a_hinge_goes_where_it_is_sent_and_a_stop_holds_it(rest: RobotClient) -> None:
    """A hinge goes where its motors are sent, as its encoders say; a stop holds it on its way."""
    found = free_hinge(rest.robot.body)
    assert found is not None
    hinge, axis = found
    motors = rest.proxy(Pose3DMotorsPrx, f"{hinge}Motors")
    encoders = rest.proxy(Pose3DEncodersPrx, f"{hinge}Encoders")
    way = way_of(rest, hinge, axis)

    def send(target: float, speed: float) -> int:
        aims = {str(axis): target, "panSpeed": speed, "tiltSpeed": speed}
        return motors.setPose3DMotorsData(replace(motors.getPose3DMotorsData(), **aims))

    def at() -> float:
        return float(getattr(encoders.getPose3DEncodersData(), axis))

    assert send(way.target, speed_of(way.joint)) == 0
    command = motors.getPose3DMotorsData()
    speed = command.panSpeed if axis is Axis.PAN else command.tiltSpeed
    assert (getattr(command, axis), speed) == pytest.approx((way.target, speed_of(way.joint)))
    rest.until(lambda: way.arrived(at()), f"{hinge} goes to {way.target:.3g}")

    crawl = slowly(rest.robot, way.joint) * way.joint.max_velocity
    start = rest.robot.body.hinges[hinge][axis].joint_angle(way.start)
    send(way.start, crawl)
    rest.until(lambda: way.done(at()) < 0.8, f"{hinge} goes back")
    motors.stop()
    check_it_is_held(rest, way.place, start, f"a stop of {hinge}")
    held = getattr(motors.getPose3DMotorsData(), axis)
    assert held == pytest.approx(at(), abs=tolerance_of(way.joint)), "its goal is not where it was stopped"

    highest = getattr(motors.getPose3DMotorsParams(), f"max{axis.capitalize()}")
    assert send(highest + 9.0, crawl) == 1, "what is out of range is limited, and the answer does not say so"
    assert getattr(motors.getPose3DMotorsData(), axis) == pytest.approx(highest)


def test_every_hinge_has_the_limits_of_its_joints(nao: RobotClient) -> None:
    """Every hinge is served, with the limits of its joints."""
    facts = nao.robot.body.joint
    for hinge, axes in nao.robot.body.hinges.items():
        params = nao.proxy(Pose3DMotorsPrx, f"{hinge}Motors").getPose3DMotorsParams()
        for axis, of in axes.items():
            ends = sorted((of.of(facts[of.joint].lower), of.of(facts[of.joint].upper)))
            assert getattr(params, f"min{axis.capitalize()}") == ends[0]
            assert getattr(params, f"max{axis.capitalize()}") == ends[1]
        nao.proxy(Pose3DEncodersPrx, f"{hinge}Encoders").getPose3DEncodersData()


@needs(NECK)
def test_the_head_goes_to_a_pose(rest: RobotClient) -> None:
    """The head goes to a pose at a fraction of its speed."""
    head, pan = rest.proxy(PoseHeadPrx, "Head"), way_of(rest, "Neck", Axis.PAN)
    tilt = way_of(rest, "Neck", Axis.TILT).start
    accepted = head.setPose(pan.target, tilt, speed_of(pan.joint) / pan.joint.max_velocity)
    assert (accepted.pan, accepted.tilt) == pytest.approx((pan.target, tilt), abs=1e-6)
    rest.until(lambda: pan.arrived(head.getPose().pan), f"the head turns to {pan.target:.3g}")
    assert head.getPose().tilt == pytest.approx(tilt, abs=tolerance_of(pan.joint))


def by_speed(nao: RobotClient, velocity: float) -> float:
    """Turn the head by `Head`; return the velocity that was accepted."""
    return nao.proxy(PoseHeadPrx, "Head").setSpeed(velocity, 0.0).panSpeed


def by_motors(nao: RobotClient, velocity: float) -> float:
    """Turn the head by `NeckSpeed`, which ignores places; return the velocity that it has now."""
    neck = nao.proxy(Pose3DMotorsPrx, "NeckSpeed")
    values = dict.fromkeys(Pose3DMotorsData.__struct_fields__, 0.0) | {"pan": 1.0, "panSpeed": velocity}
    assert neck.setPose3DMotorsData(Pose3DMotorsData(**values)) == 0
    return neck.getPose3DMotorsData().panSpeed


@needs(NECK)
def test_a_velocity_of_the_head_ends_unless_it_is_renewed(rest: RobotClient) -> None:
    """A velocity of the head lasts while it is renewed; that it was not renewed is counted."""
    for turn in (by_speed, by_motors):
        check_it_lasts_while_it_is_renewed(rest, turn)


def check_it_lasts_while_it_is_renewed(nao: RobotClient, turn: Callable[[RobotClient, float], float]) -> None:
    """Check it of a way to turn the head."""
    head, health = nao.proxy(PoseHeadPrx, "Head"), nao.proxy(HealthPrx, "Health")
    pan, timeouts = way_of(nao, "Neck", Axis.PAN), health.getHealth().velocityTimeouts
    velocity = math.copysign(TURN, pan.target - pan.start)

    def turns() -> bool:
        accepted, pose = turn(nao, velocity), head.getPose()
        return accepted == velocity and abs(pose.panSpeed - velocity) < TOLERANCE and pan.done(pose.pan) > 0.5

    nao.until(turns, f"the head turns at {velocity} rad/s while that is renewed")
    nao.until(lambda: abs(head.getPose().panSpeed) < 0.02, "it ends when it is not renewed")
    nao.until(lambda: health.getHealth().velocityTimeouts > timeouts, "the end is counted")


def test_the_clock_streams_a_time_that_goes_on(nao: RobotClient) -> None:
    """The clock streams a time that goes on, and says whether it is simulated."""
    clock = nao.proxy(ClockPrx, "Clock")
    first = clock.getTime()
    # Two samples may have the same time where a busy machine has stopped a simulation.
    nao.until(lambda: clock.getTime.wait(timeout=nao.limit).value.time > first.time, "its time goes on")
    later = clock.getTime()
    assert later.rate > 0.0
    assert later.simulated == nao.robot.clock.simulated


STREAMS: dict[str, tuple[Any, str]] = {
    "Body": (JointsPrx, "getJointState"),
    "Encoders": (EncodersPrx, "getEncodersData"),
    "FootPressure": (FootPressurePrx, "getFeetReading"),
    "InertialUnit": (InertialUnitPrx, "getInertialReading"),
}


def test_streams_go_on_in_time(nao: RobotClient) -> None:
    """A stream has the robot's time, which advances, and no older state after a newer one."""
    for identity in STREAMS.keys() & nao.assembly.servants.keys():
        interface, operation = STREAMS[identity]
        times: list[float] = []
        for sample in getattr(nao.proxy(interface, identity), operation).samples(timeout=nao.limit):
            times.append(sample.time)
            assert getattr(sample.value, "time", sample.time) == sample.time
            if len(set(times)) == 3:
                break
        assert times == sorted(times), f"{identity} streams an older state after a newer one"


@pytest.fixture
def camera(nao: RobotClient) -> CameraPrx:
    """The first camera of the robot, with its first settings."""
    camera = nao.proxy(CameraPrx, nao.robot.cameras[0].name)
    camera.reset()
    return camera


@needs(CAMERA)
def test_a_camera_describes_itself(nao: RobotClient, camera: CameraPrx) -> None:
    """A camera describes its images as its lens is described in the body."""
    facts, description = nao.robot.cameras[0], camera.getCameraDescription()
    width, height = description.width, description.height
    assert (description.name, width, height, description.rate) == (facts.name, 320, 240, 10.0)
    seen = 2 * math.atan(width / 2 / description.fdistx)
    assert seen == pytest.approx(facts.horizontal_fov, abs=0.01)
    assert (description.u0, description.v0) == ((width - 1) / 2, (height - 1) / 2)


@needs(CAMERA)
def test_an_image_is_what_its_description_says(nao: RobotClient, camera: CameraPrx) -> None:
    """An image is what its description says, in each format, and has the time of the robot's clock."""
    clock = nao.proxy(ClockPrx, "Clock")
    for name, channels in (("RGB8", 3), ("BGR8", 3), ("GRAY8", 1)):
        before = clock.getTime().time
        image = camera.getImageData(name)
        shape = image.description
        assert (shape.width, shape.height, shape.format) == (320, 240, name)
        assert shape.size == len(image.pixelData) == 320 * 240 * channels
        time = image.timeStamp.seconds + image.timeStamp.useconds / 1e6
        assert before - 5.0 <= time <= clock.getTime().time + 0.01


@needs(CAMERA)
def test_the_size_and_the_rate_of_a_camera_can_be_set_and_reset(nao: RobotClient, camera: CameraPrx) -> None:
    """Size and rate of a camera can be set, and reset."""
    facts, description = nao.robot.cameras[0], camera.getCameraDescription()
    for width, height in facts.sizes[:2]:
        description.width, description.height, description.rate = width, height, 5.0
        assert camera.setCameraDescription(description) == 0
        image = camera.getImageData("GRAY8").description
        assert (image.width, image.height) == (width, height)
        assert camera.getCameraDescription().rate == 5.0
    camera.reset()
    assert camera.getImageDescription().width == 320


@needs(CAMERA)
def test_images_of_the_stream_are_a_period_apart(nao: RobotClient, camera: CameraPrx) -> None:
    """A camera streams RGB images, no more than its rate."""
    assert camera.getImageFormat()[0] == "RGB8"
    times: list[float] = []
    for sample in camera.getImageData.samples(timeout=nao.limit):
        assert sample.value.description.format == "RGB8"
        times.append(sample.time)
        if len(times) == 8:
            break
    assert times[-1] - times[0] > 0.35, "one may be late and close to the next; more come than asked for"
    assert all(after > before for before, after in pairwise(times))
