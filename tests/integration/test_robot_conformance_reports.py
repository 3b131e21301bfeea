"""What every robot reports to clients and refuses while it stands: it changes nothing, so it is started once."""

import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Final

import pytest

from interfaces.jderobot import (
    CameraPrx,
    ConfigurationNotExistException,
    EncodersPrx,
    InvalidValueException,
    Pose3DEncodersPrx,
    Pose3DMotorsPrx,
)
from interfaces.nao import (
    BatteryPrx,
    ClockPrx,
    FootPressurePrx,
    HealthPrx,
    InertialUnitPrx,
    JointsPrx,
    LedColor,
    LedsPrx,
    PoseHeadPrx,
    SonarPrx,
    TouchPrx,
)
from naoserver.body import Body
from naoserver.moves.motion_file import load_motions
from tests.support.conformance import BODIES, FAMILIES, motors, pan_of, robots, tilt_of
from tests.support.limits import EVENT_LIMIT, START_LIMIT
from tests.support.robot_server import wait_for
from zenoh_ice import MarshalException

TOLERANCE = 0.05
"""Radians by which a joint that is not moved may be away from its place."""
GRAVITY = 9.81
GRAVITY_TOLERANCE = 0.3
"""In m/s2, at rest."""
TILT_TOLERANCE = 0.12
"""In rad, of a torso that stands: its posture leans forwards a little."""
WEIGHT_TOLERANCE = 0.1
"""Part of the weight by which what the soles feel may miss it."""
RATE_TOLERANCE = 0.1
"""In rad/s, at rest."""

ALWAYS = {"Body", "Clock", "Description", "Health", "Safety", "Team"}
OF_A_PART: Final[Mapping[str, Callable[[Body], object]]] = {
    "Battery": lambda body: body.battery,
    "Encoders": lambda body: body.walk,
    "FootPressure": lambda body: has_pressure(body),
    "Head": lambda body: body.neck,
    "InertialUnit": lambda body: body.inertial_unit,
    "Leds": lambda body: body.lights,
    "Motions": load_motions,
    "Motors": lambda body: body.walk,
    "NeckSpeed": lambda body: body.neck,
    "Postures": lambda body: body.postures,
    "Sonar": lambda body: body.sonar,
    "Sounds": lambda body: body.voice,
    "Speech": lambda body: body.voice,
    "Touch": lambda body: body.touch,
    "Walk": lambda body: body.walk,
}
"""The identities that are served where the body has a part."""
BALLS = {f"Ball{color}{kind}" for color in ("Red", "Green") for kind in ("Motors", "Encoders")}
SIMULATION = {"CameraOutside", "GroundTruth", "Hearing", "Scene"}


def has_pressure(body):
    return any(sole.pressure for sole in body.soles)


def on_each_with(*parts, bodies=BODIES):
    """Run a test with each body that has some parts."""
    return pytest.mark.parametrize("served", robots(*parts, bodies=bodies, weight=True), indirect=True)


on_each_family = on_each_with(bodies=FAMILIES)
"""For what is the same for an H21 as for an H25."""


@pytest.fixture(scope="module", params=robots(weight=True))
def served(request):
    """A robot that is served."""
    with request.param(None) as nao:
        yield nao


@pytest.fixture(scope="module")
def nao(served):
    """The robot, and a client's session."""
    with served.client() as nao:
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


# -- what it is and does --------------------------------------------------------------------------------------


def test_it_serves_what_such_a_robot_has(nao):
    body = nao.robot.body
    expected = ALWAYS | {identity for identity, part in OF_A_PART.items() if part(body)}
    expected |= {camera.name for camera in body.cameras}
    for hinge in body.hinges:
        expected |= {f"{hinge}Motors", f"{hinge}Encoders"}
    if nao.robot.mechanisms:
        expected |= BALLS
    if nao.robot.stage is not None:
        expected |= SIMULATION
    assert nao.assembly.servants.keys() == expected


def test_it_begins_upright_stiff_warm_and_untouched(nao, body):
    state = body.getJointState()
    assert set(state.stiffnesses) == {1.0}
    assert all(10.0 < temperature < 60.0 for temperature in state.temperatures)
    report = nao.proxy(HealthPrx, "Health").getHealth()
    assert not report.fallen
    assert report.torsoTilt < 0.2
    assert report.cameraRates.keys() >= {camera.name for camera in nao.robot.body.cameras}
    assert report.uptime > 0
    if nao.robot.body.inertial_unit:
        unit = nao.proxy(InertialUnitPrx, "InertialUnit")
        upright = wait_for(unit.getInertialReading, at_rest)
        assert max(abs(upright.roll), abs(upright.pitch)) < TILT_TOLERANCE
    if nao.robot.body.touch:
        touch = nao.proxy(TouchPrx, "Touch")
        assert touch.getTouchNames() == list(nao.robot.body.touch_sensors)
        wait_for(touch.getTouchReading, lambda reading: reading.touched == [])
    if nao.robot.body.battery:
        reading = nao.proxy(BatteryPrx, "Battery").getBatteryReading.wait(timeout=EVENT_LIMIT).value
        assert 0.0 <= reading.charge <= 1.0
        assert -20.0 < reading.current < 20.0
        assert 0.0 < reading.temperature < 60.0
        assert not reading.plugged


def test_every_hinge_is_served_with_the_limits_of_its_joints(nao):
    facts = nao.robot.body.joint
    for hinge, axes in nao.robot.body.hinges.items():
        params = nao.proxy(Pose3DMotorsPrx, f"{hinge}Motors").getPose3DMotorsParams()
        for axis, of in axes.items():
            ends = sorted((of.of(facts[of.joint].lower), of.of(facts[of.joint].upper)))
            assert getattr(params, f"min{axis.capitalize()}") == ends[0]
            assert getattr(params, f"max{axis.capitalize()}") == ends[1]
        nao.proxy(Pose3DEncodersPrx, f"{hinge}Encoders").getPose3DEncodersData()


def at_rest(reading):
    force, rate = reading.acceleration, reading.angularVelocity
    return (
        abs(math.hypot(force.x, force.y, force.z) - GRAVITY) < GRAVITY_TOLERANCE
        and math.hypot(rate.x, rate.y, rate.z) < RATE_TOLERANCE
    )


@on_each_family
def test_the_clock_streams_a_time_that_goes_on(nao):
    clock = nao.proxy(ClockPrx, "Clock")
    first = clock.getTime.wait(timeout=EVENT_LIMIT).value
    # Two samples may have the same time where a busy machine has stopped the simulation.
    later = wait_for(clock.getTime, lambda now: now.time != first.time)
    assert later.time > first.time
    assert later.rate > 0.0
    assert later.simulated == nao.robot.clock.simulated


def test_streams_go_on_in_time(nao):
    """Each stream has the robot's time, which advances, and no older state after a newer one."""
    streams = {
        "Body": (JointsPrx, "getJointState"),
        "Encoders": (EncodersPrx, "getEncodersData"),
        "FootPressure": (FootPressurePrx, "getFeetReading"),
        "InertialUnit": (InertialUnitPrx, "getInertialReading"),
    }
    for identity in streams.keys() & nao.assembly.servants.keys():
        interface, operation = streams[identity]
        times = []
        for sample in getattr(nao.proxy(interface, identity), operation).samples(timeout=EVENT_LIMIT):
            times.append(sample.time)
            assert getattr(sample.value, "time", sample.time) == sample.time
            if len(set(times)) == 3:
                break
        assert times == sorted(times), identity


# -- the senses -----------------------------------------------------------------------------------------------


@on_each_with(has_pressure)
def test_the_feet_carry_the_weight_between_them(nao):
    feet = nao.proxy(FootPressurePrx, "FootPressure")
    weight = GRAVITY * nao.robot.body.mass

    def carries(reading):
        left, right = reading.left, reading.right
        return left.total + right.total == pytest.approx(weight, rel=WEIGHT_TOLERANCE)

    reading = wait_for(feet.getFeetReading, carries)
    for foot in (reading.left, reading.right):
        parts = (foot.frontLeft, foot.frontRight, foot.rearLeft, foot.rearRight)
        assert min(parts) >= 0.0
        assert sum(parts) == pytest.approx(foot.total)
        assert foot.total > 0.2 * weight
        assert -0.05 < foot.centerX < 0.11
        assert abs(foot.centerY) < 0.06


@on_each_with(lambda body: body.sonar, bodies=FAMILIES)
def test_the_sonar_reports_distances_within_its_limits_or_none(nao):
    sonar = nao.proxy(SonarPrx, "Sonar")
    limits = sonar.getSonarLimits()
    assert 0.0 < limits.nearest < limits.farthest < 10.0
    assert math.radians(20) < limits.cone < math.radians(90)
    reading = sonar.getSonarReading.wait(timeout=EVENT_LIMIT).value
    for distance in (reading.left, reading.right):
        assert distance == math.inf or limits.nearest <= distance <= limits.farthest


# -- cameras --------------------------------------------------------------------------------------------------


@on_each_family
@pytest.mark.gl
def test_a_camera_describes_itself(nao, camera):
    description = camera.getCameraDescription()
    assert (description.name, description.width, description.height, description.rate) == (
        "Camera",
        320,
        240,
        10.0,
    )
    assert 2 * math.atan(160 / description.fdistx) == pytest.approx(
        nao.robot.body.cameras[0].horizontal_fov, abs=0.01
    )
    assert (description.u0, description.v0) == (159.5, 119.5)


@on_each_family
@pytest.mark.gl
def test_an_image_is_what_its_description_says(camera):
    for name, channels in (("RGB8", 3), ("BGR8", 3), ("GRAY8", 1)):
        assert name in camera.getImageFormat()
        image = camera.getImageData(name)
        shape = image.description
        assert (shape.width, shape.height, shape.format) == (320, 240, name)
        assert shape.size == len(image.pixelData) == 320 * 240 * channels


@on_each_family
@pytest.mark.gl
def test_images_are_timed_by_the_robots_clock(nao, camera):
    clock = nao.proxy(ClockPrx, "Clock")
    before = clock.getTime().time
    stamp = camera.getImageData("RGB8").timeStamp
    time = stamp.seconds + stamp.useconds / 1e6
    assert before - 5.0 <= time <= clock.getTime().time + 0.01


@on_each_family
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


@on_each_family
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


@on_each_family
def test_an_unknown_pixel_format_is_refused_with_those_there_are(camera):
    with pytest.raises(ConfigurationNotExistException, match=r"'PNG'.*RGB8"):
        camera.getImageData("PNG")


# -- what is refused ------------------------------------------------------------------------------------------


@on_each_family
def test_a_stiffness_that_cannot_be_is_refused_with_its_field(nao, body):
    joint = pan_of(nao.robot.body)
    for stiffnesses, seconds, field in (
        ({joint: 1.1}, 0.0, joint),
        ({joint: math.nan}, 0.0, joint),
        ({"Tail": 0.5}, 0.0, "Tail"),
        ({joint: 0.5}, -1.0, "seconds"),
        ({joint: 0.5}, math.inf, "seconds"),
    ):
        with pytest.raises(InvalidValueException) as refusal:
            body.setStiffnesses(stiffnesses, seconds)
        assert refusal.value.field == field
    assert set(body.getJointState().stiffnesses) == {1.0}


@on_each_family
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_is_refused_with_its_field(nao, head, body, value):
    first, second = pan_of(nao.robot.body), tilt_of(nao.robot.body)
    refused = []
    for call in (
        lambda: head.setPose(value, 0.0, 0.5),
        lambda: head.setPose(0.0, 0.0, value),
        lambda: head.setSpeed(0.0, value),
        lambda: body.setJointPositions({first: 0.0, second: value}, 0.1),
        lambda: nao.proxy(Pose3DMotorsPrx, "NeckMotors").setPose3DMotorsData(motors(roll=value)),
        lambda: nao.proxy(Pose3DMotorsPrx, "NeckSpeed").setPose3DMotorsData(motors(tiltSpeed=value)),
    ):
        with pytest.raises(InvalidValueException) as refusal:
            call()
        refused.append(refusal.value.field)
    assert refused == ["pan", "fraction", "tilt", second, "roll", "tiltSpeed"]
    assert abs(head.getPose().pan) < TOLERANCE, "nothing moved, and the server lives"


@on_each_family
@pytest.mark.parametrize("fraction", [0.0, -0.1, 1.01])
def test_a_fraction_out_of_its_domain_is_refused(head, fraction):
    with pytest.raises(InvalidValueException) as refusal:
        head.setPose(0.0, 0.0, fraction)
    assert refusal.value.field == "fraction"


@on_each_family
def test_a_negative_speed_of_a_position_is_refused(nao):
    with pytest.raises(InvalidValueException) as refusal:
        nao.proxy(Pose3DMotorsPrx, "NeckMotors").setPose3DMotorsData(motors(panSpeed=-1.0))
    assert refusal.value.field == "panSpeed"


@on_each_family
def test_an_unknown_joint_is_refused_and_no_joint_moves(nao, body):
    joint = pan_of(nao.robot.body)
    place = nao.robot.body.joint_names.index(joint)
    with pytest.raises(InvalidValueException, match=nao.robot.body.joint_names[0]) as refusal:
        body.setJointPositions({joint: 0.5, "Tail": 0.0}, 0.5)
    assert refusal.value.field == "Tail"
    assert body.getJointState().commands[place] == pytest.approx(0.0, abs=1e-6)


@on_each_family
def test_a_wrong_type_is_refused_with_the_field(nao, body):
    joint = pan_of(nao.robot.body)
    with pytest.raises(MarshalException, match="targets"):
        body.setJointPositions({joint: "left"}, 0.5)
    assert len(body.getJointState().positions) == len(nao.robot.body.joints)


@on_each_family
def test_a_light_that_is_not_there_is_refused_by_name(nao):
    leds = nao.proxy(LedsPrx, "Leds")
    with pytest.raises(InvalidValueException) as refusal:
        leds.setLed("Tail", LedColor(red=1.0, green=0.0, blue=0.0), 0.0)
    assert refusal.value.field == "name"
