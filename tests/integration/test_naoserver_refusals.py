"""What a served robot refuses or limits, with the field that it is about, as clients see it over Zenoh."""

import math

import pytest

from interfaces.jderobot import (
    CameraPrx,
    ConfigurationNotExistException,
    InvalidValueException,
    Pose3DMotorsPrx,
)
from interfaces.nao import JointsPrx, PoseHeadPrx
from naoserver.fake import FakeRobot
from tests.support.conformance import motors
from tests.support.robot_server import served_to_client
from zenoh_ice import MarshalException

HEAD = (PoseHeadPrx, "Head")
BODY = (JointsPrx, "Body")
NECK = (Pose3DMotorsPrx, "NeckMotors")
TURN = (Pose3DMotorsPrx, "NeckSpeed")


@pytest.fixture(scope="module")
def nao():
    """A robot that stands: all that it is asked is refused."""
    with served_to_client(FakeRobot()) as nao:
        yield nao


NOT_FINITE = [
    (HEAD, lambda head, value: head.setPose(value, 0.0, 0.5), "pan"),
    (HEAD, lambda head, value: head.setPose(0.0, 0.0, value), "fraction"),
    (HEAD, lambda head, value: head.setSpeed(0.0, value), "tilt"),
    (BODY, lambda body, value: body.setJointPositions({"HeadYaw": 0.0, "HeadPitch": value}, 0.1), "HeadPitch"),
    (BODY, lambda body, value: body.setStiffnesses({"HeadYaw": value}, 0.0), "HeadYaw"),
    (BODY, lambda body, value: body.setStiffnesses({"HeadYaw": 0.5}, value), "seconds"),
    (NECK, lambda neck, value: neck.setPose3DMotorsData(motors(roll=value)), "roll"),
    (TURN, lambda neck, value: neck.setPose3DMotorsData(motors(tiltSpeed=value)), "tiltSpeed"),
]  # fmt: skip
OUT_OF_DOMAIN = [
    *((HEAD, lambda head, of=of: head.setPose(0.0, 0.0, of), "fraction") for of in (0.0, -0.1, 1.01)),
    (BODY, lambda body: body.setJointPositions({"HeadYaw": 0.5, "Tail": 0.0}, 0.5), "Tail"),
    (BODY, lambda body: body.setStiffnesses({"HeadYaw": 1.1}, 0.0), "HeadYaw"),
    (BODY, lambda body: body.setStiffnesses({"Tail": 0.5}, 0.0), "Tail"),
    (BODY, lambda body: body.setStiffnesses({"HeadYaw": 0.5}, -1.0), "seconds"),
    (NECK, lambda neck: neck.setPose3DMotorsData(motors(panSpeed=-1.0)), "panSpeed"),
]
REFUSED = [
    *((at, lambda proxy, call=call, of=of: call(proxy, of), field)
      for at, call, field in NOT_FINITE for of in (math.nan, math.inf, -math.inf)),
    *OUT_OF_DOMAIN,
]  # fmt: skip


@pytest.mark.parametrize(("at", "call", "field"), REFUSED)
def test_a_value_out_of_its_domain_is_refused_with_its_field(nao, at, call, field):
    body = nao.proxy(JointsPrx, "Body")
    before = body.getJointState()
    with pytest.raises(InvalidValueException) as refusal:
        call(nao.proxy(*at))
    assert refusal.value.field == field
    after = body.getJointState()
    assert (after.commands, after.stiffnesses) == (before.commands, before.stiffnesses), "nothing moved"


def test_a_wrong_type_is_refused_with_the_field(nao):
    body = nao.proxy(JointsPrx, "Body")
    with pytest.raises(MarshalException, match="targets"):
        body.setJointPositions({"HeadYaw": "left"}, 0.5)
    assert len(body.getJointState().positions) == len(nao.robot.body.joints)


@pytest.mark.parametrize(
    ("setting", "value", "reason"),
    [
        ("width", 321, "321x240"),
        ("rate", 1000.0, "up to 30"),
        ("rate", math.nan, "nan"),
        ("rate", 0.0, "0"),
    ],
)
def test_a_setting_that_a_camera_does_not_have_is_refused(nao, setting, value, reason):
    camera = nao.proxy(CameraPrx, "Camera")
    description = camera.getCameraDescription()
    setattr(description, setting, value)
    with pytest.raises(ConfigurationNotExistException, match=reason):
        camera.setCameraDescription(description)
    assert (camera.getCameraDescription().width, camera.getCameraDescription().rate) == (320, 10.0)


def test_an_unknown_pixel_format_is_refused_with_those_there_are(nao):
    with pytest.raises(ConfigurationNotExistException, match=r"'PNG'.*RGB8"):
        nao.proxy(CameraPrx, "Camera").getImageData("PNG")


def test_a_velocity_of_the_head_above_its_limit_is_answered_by_what_it_is_limited_to(nao):
    head, neck = nao.proxy(PoseHeadPrx, "Head"), nao.proxy(Pose3DMotorsPrx, "NeckSpeed")
    assert head.setSpeed(100.0, 0.0).panSpeed == head.getLimits().maxPanSpeed
    head.stop()
    assert neck.getPose3DMotorsData().panSpeed == 0.0
    assert neck.setPose3DMotorsData(motors(panSpeed=50.0)) == 1
    neck.stop()
    assert neck.getPose3DMotorsData().panSpeed == 0.0
