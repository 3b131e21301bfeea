"""The robot over genuine libqi: a fake one in another process, which is served as NAOqi."""

import pytest

pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")

from contextlib import closing

from naoserver.hardware.connection import CallFailed, LinkLost
from plugins.naoqi.tests.support.naoqi import call, connect_patiently
from tests.support.limits import CALL_LIMIT
from tests.support.processes import ComponentProcess, module
from tests.support.robot_server import eventually
from visualhfsm_naoqi.robot._libqi_link import connect
from visualhfsm_naoqi.robot._link import NAME, RobotAddress
from visualhfsm_naoqi.robot._robot import NaoqiRobot
from visualhfsm_naoqi.robot.calls import CallTimeout

SUBSCRIBERS = "ALVideoDevice.getSubscribers"


@pytest.fixture(scope="module")
def address():
    with ComponentProcess(
        module("plugins.naoqi.tests.support.faulty", "--qi", "tcp://127.0.0.1:0")
    ) as process:
        yield RobotAddress.parse(process.wait_for(r"^ready: (\S+)")[1])


@pytest.fixture
def link(address):
    with closing(connect(address, CALL_LIMIT)) as link:
        yield link
        call(link, "Faults.clear")


@pytest.fixture
def robot(address, link):
    with closing(NaoqiRobot(lambda _: connect_patiently(address))) as robot:
        robot.start()
        yield robot


def test_cameras_are_released_when_the_robot_is_closed(address, link):
    with closing(NaoqiRobot(lambda _: connect_patiently(address))) as robot:
        robot.start()
        robot.capture("Camera", 320, 240)
        robot.capture("CameraBottom", 320, 240)
        assert len(call(link, SUBSCRIBERS)) == 2
        assert all(name.startswith(NAME) for name in call(link, SUBSCRIBERS))
    eventually(lambda: call(link, SUBSCRIBERS) == [])


def test_a_way_into_a_posture_of_before_ends_at_the_start(address, link):
    call(link, "ALMotion.angleInterpolation", "LShoulderPitch", 1.5, 0.2, True, timeout=CALL_LIMIT)
    former = link.begin("ALRobotPosture.goToPosture", "StandZero", 0.05)  # it takes half a minute
    eventually(lambda: call(link, "ALMotion.getAngles", "LShoulderPitch", False)[0] < 1.4999)
    with closing(NaoqiRobot(lambda _: connect_patiently(address))) as robot:
        robot.start()
        assert former.result(CALL_LIMIT) is False
        assert call(link, "ALMotion.getAngles", "LShoulderPitch", False)[0] > 0.5


@pytest.mark.parametrize(
    ("operation", "arguments", "message"),
    [
        ("ALMotion.getAngles", ("Tail", True), "ALMotion::getAngles: there is no joint or chain 'Tail'"),
        ("ALMotion.fly", (), "ALMotion.fly: this robot has no such method"),
        ("ALFlight.begin", (), "ALFlight: Cannot find service 'ALFlight'"),
        ("ALMotion.getAngles", (), "ALMotion.getAngles: Arguments types did not match"),
    ],
)
def test_a_call_that_fails_says_what_and_why_in_one_line(link, operation, arguments, message):
    with pytest.raises(CallFailed) as failure:
        call(link, operation, *arguments)
    assert str(failure.value).startswith(message)
    assert "\n" not in str(failure.value)


def test_a_call_that_takes_too_long_is_given_up(link):
    call(link, "Faults.slow", "ALMotion::getAngles", 30.0)
    with pytest.raises(CallTimeout, match=r"no answer within 0\.05 s"):
        call(link, "ALMotion.getAngles", "Head", True, timeout=0.05)


def test_a_link_that_was_closed_says_so(address):
    link = connect(address, CALL_LIMIT)
    link.close()
    link.close()
    assert link.lost.is_set()
    with pytest.raises(LinkLost):
        call(link, "ALMotion.getAngles", "Head", True)
