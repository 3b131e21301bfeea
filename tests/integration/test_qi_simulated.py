"""`naoserver-sim --qi`: programs for NAOqi and proxies drive the same simulated robot."""

import pytest

pytest.importorskip("qi")

from interfaces.nao import HealthPrx, JointsPrx, SafetyPrx
from tests.support.naoqi import connected, eventually_near
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import initialize

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def served():
    """The endpoint of a simulated robot, and its address as a NAOqi."""
    endpoint = free_endpoint()
    options = ("--listen", endpoint, "--no-skin", "--speed", "2", "--qi", "tcp://127.0.0.1:0")
    with ComponentProcess(module("naoserver_sim", *options)) as process:
        url = process.wait_for(r"^NAOqi: (\S+)")[1]
        process.wait_for("^ready")
        yield endpoint, url


@pytest.fixture
def session(served):
    with connected(served[1]) as session:
        yield session


@pytest.fixture
def proxy(served):
    with initialize(connect=[served[0]], listen=["tcp/127.0.0.1:0"], clock="wall") as communicator:
        yield lambda interface, identity: interface.checkedCast(communicator.stringToProxy(identity))


def test_both_see_where_the_head_is(session, proxy):
    session.service("ALMotion").angleInterpolation("HeadYaw", 0.6, 1.0, True)
    body = proxy(JointsPrx, "Body")
    index = body.getJointNames().index("HeadYaw")
    eventually_near(lambda: body.getJointState().positions[index], 0.6, 0.02)


def test_the_safety_layer_limits_both(session, proxy):
    before = proxy(HealthPrx, "Health").getHealth().limitedCommands
    session.service("ALMotion").setAngles("HeadYaw", 10.0, 0.5)
    assert proxy(HealthPrx, "Health").getHealth().limitedCommands > before


def test_an_emergency_stop_refuses_both(session, proxy):
    motion, safety = session.service("ALMotion"), proxy(SafetyPrx, "Safety")
    safety.emergencyStop("a test")
    try:
        for command in (
            lambda: motion.setAngles("HeadYaw", 0.0, 0.5),
            lambda: motion.angleInterpolation("HeadYaw", 0.0, 1.0, True),
            lambda: motion.moveToward(1.0, 0.0, 0.0),
            lambda: motion.wakeUp(),
        ):
            with pytest.raises(RuntimeError, match="the robot is stopped: a test"):
                command()
    finally:
        safety.resetEmergencyStop()
    motion.setAngles("HeadYaw", 0.0, 0.5)


def test_it_walks_and_comes_into_a_posture(session):
    motion, posture = session.service("ALMotion"), session.service("ALRobotPosture")
    assert motion.moveTo(0.2, 0.0, 0.0)
    assert motion.getRobotPosition(True)[0] == pytest.approx(0.2, abs=0.06)
    assert posture.goToPosture("StandInit", 0.8)
    assert posture.getPosture() == "StandInit"
    assert session.service("ALMemory").getData("robotHasFallen") is False


@pytest.mark.gl
def test_it_sees(session):
    video = session.service("ALVideoDevice")
    handle = video.subscribeCamera("test", 0, 1, 11, 10)
    picture = video.getImageRemote(handle)
    assert len(picture[6]) == 320 * 240 * 3
    assert len(set(picture[6])) > 10
    video.unsubscribe(handle)
