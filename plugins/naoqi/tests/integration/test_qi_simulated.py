"""`naoserver-sim --qi`: programs for NAOqi and proxies drive the same simulated robot."""

import pytest

pytest.importorskip("qi")

from interfaces.nao import HealthPrx, JointsPrx, SafetyPrx, ScenePrx
from naoserver.bodies.nao import H21, H25
from plugins.naoqi.tests.support.naoqi import connected, eventually_near
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import initialize

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def served():
    """The endpoint of a simulated robot, one without hands that move, and its address as a NAOqi."""
    endpoint = free_endpoint()
    options = (
        "--listen",
        endpoint,
        "--no-skin",
        "--speed",
        "4",
        "--body",
        "H21",
        "--qi",
        "tcp://127.0.0.1:0",
    )
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


def test_a_program_recognizes_what_the_scene_says_to_the_robot(session, proxy):
    recognition, memory = session.service("ALSpeechRecognition"), session.service("ALMemory")
    recognition.setVocabulary(["yes", "no"], False)
    recognition.subscribe("test")
    assert proxy(ScenePrx, "Scene").sayToRobot("Yes!") == "yes"
    assert memory.getData("WordRecognized") == ["yes", 1.0]
    recognition.unsubscribe("test")


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
        safety.resetEmergencyStop(True)
    motion.setAngles("HeadYaw", 0.0, 0.5)


def test_a_program_runs_on_an_h21_and_learns_that_it_has_no_hands(session):
    motion, memory = session.service("ALMotion"), session.service("ALMemory")
    assert motion.getBodyNames("Body") == list(H21.joint_names)
    config = dict(zip(*motion.getRobotConfig(), strict=True))
    assert (config["Model Type"], config["Number of Hands"]) == ("naoH21", 0)
    motion.wakeUp()
    arm = motion.getBodyNames("LArm")
    assert arm == ["LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll"]
    motion.angleInterpolation("LArm", [1.0, 0.3, -1.0, -0.5], 1.0, True)
    assert motion.getAngles("LArm", True) == pytest.approx([1.0, 0.3, -1.0, -0.5], abs=0.1)
    before = motion.getPosition("LArm", 0, False)
    motion.positionInterpolation("LArm", 0, [*before[:2], before[2] + 0.02, 0, 0, 0], 7, 0.5)
    assert motion.getPosition("LArm", 0, False)[2] == pytest.approx(before[2] + 0.02, abs=0.003)
    assert motion.getMass("LArm") == pytest.approx(sum(arm_masses()))
    for wrong in (lambda: motion.openHand("LHand"), lambda: motion.getPosition("LWristYaw", 0, True)):
        with pytest.raises(RuntimeError, match=r"there is no .*(LHand|LWristYaw)"):
            wrong()
    for key in ("LWristYaw/Position/Sensor/Value", "LHand/Touch/Back/Sensor/Value"):
        with pytest.raises(RuntimeError, match=key):
            memory.getData(f"Device/SubDeviceList/{key}")


def arm_masses():
    links = {link.name: link.mass for link in H25.links}
    return [links[H25.joint[joint].child] for joint in H25.groups.left_arm if joint != "LHand"]


def test_it_walks_and_comes_into_a_posture(session):
    motion, posture = session.service("ALMotion"), session.service("ALRobotPosture")
    x = motion.getRobotPosition(True)[0]
    assert motion.moveTo(0.2, 0.0, 0.0)
    assert motion.getRobotPosition(True)[0] == pytest.approx(x + 0.2, abs=0.06)
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
