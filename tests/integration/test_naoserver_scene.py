"""Ground truth and scene as clients use them: over Zenoh, from a simulation."""

from functools import partial

import pytest

from interfaces.jderobot import (
    CommandRefusedException,
    InvalidValueException,
    Pose3DEncodersPrx,
    Pose3DMotorsPrx,
)
from interfaces.nao import (
    GroundTruthPrx,
    HearingPrx,
    Quaternion,
    SafetyPrx,
    ScenePrx,
    ShapeKind,
    TouchPrx,
    Vector3,
)
from naoserver.bodies.kinematics import kinematics_of
from naoserver.fake import FakeRobot
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.conformance import FAMILIES, in_simulation, motors, robots
from tests.support.limits import EVENT_LIMIT
from tests.support.robot_server import HASTE, eventually, served_to_client, wait_for
from zenoh_ice import ObjectNotExistException

pytestmark = pytest.mark.sim


@pytest.fixture
def nao(request):
    """A robot that is served, by default a simulated one on a soccer field, and a client's session."""
    soccer = partial(SimulatedRobot, skin=False, world=load_world("soccer"))
    make = getattr(request, "param", lambda _: served_to_client(soccer()))
    with make(None) as nao:
        yield nao


@pytest.fixture
def scene(nao):
    return nao.proxy(ScenePrx, "Scene")


@pytest.fixture
def truth(nao):
    return nao.proxy(GroundTruthPrx, "GroundTruth")


def test_what_is_placed_is_where_the_truth_has_it(scene, truth):
    assert scene.getObjects() == ["Ball"]
    scene.placeObject("Ball", Vector3(x=1.0, y=0.5, z=0.05))
    scene.placeRobot(-1.0, -0.5, 0.0)

    def there():
        reading = truth.getGroundTruth()
        ball, torso = reading.objects["Ball"].position, reading.torso.position
        return abs(ball.x - 1.0) < 0.01 and abs(torso.x + 1.0) < 0.05

    eventually(there)


def test_ground_truth_is_streamed(truth):
    sample = truth.getGroundTruth.wait(timeout=EVENT_LIMIT)
    later = truth.getGroundTruth.wait(after=sample, timeout=EVENT_LIMIT)
    assert later.value.time > sample.value.time
    assert isinstance(later.value.torso.orientation, Quaternion)


def test_a_push_and_a_press_reach_the_robot(nao, scene, truth):
    scene.pressSensor("ChestButton", 60.0)
    eventually(lambda: "ChestButton" in nao.proxy(TouchPrx, "Touch").getTouchReading().touched)
    scene.pushRobot(Vector3(x=80.0, y=0.0, z=0.0), 0.3)
    eventually(lambda: truth.getGroundTruth().torso.position.z < 0.25)


def test_a_sentence_reaches_those_who_listen(nao, scene):
    assert scene.sayToRobot("hello") == ""
    nao.assembly.hearing.listen(lambda sentence: sentence.upper())
    assert scene.sayToRobot("hello") == "HELLO"
    with pytest.raises(InvalidValueException, match="there is nothing to hear") as caught:
        scene.sayToRobot(" ")
    assert caught.value.field == "text"


def test_a_sentence_is_heard_by_behaviors(nao, scene):
    ears = nao.proxy(HearingPrx, "Hearing")
    assert (ears.getHeard().text, ears.getHeard().count) == ("", 0)
    before = ears.getHeard.wait(timeout=EVENT_LIMIT)
    scene.sayToRobot(" Go home ")
    assert (ears.getHeard().text, ears.getHeard().count) == ("Go home", 1)
    assert ears.getHeard.wait(after=before, timeout=EVENT_LIMIT).value.count == 1


def test_the_world_is_reported_as_shapes(scene, truth):
    shapes = scene.getShapes()
    assert {shape.object for shape in shapes} - {""} == truth.getGroundTruth().objects.keys() == {"Ball"}
    (ball,) = (shape for shape in shapes if shape.object)
    assert (ball.kind, ball.size.x) == (ShapeKind.Sphere, 0.05)
    assert shapes[0].kind is ShapeKind.Plane
    assert sum(shape.kind is ShapeKind.Capsule for shape in shapes) == 6


def test_a_push_is_a_command_of_the_robot(nao, scene, truth):
    safety = nao.proxy(SafetyPrx, "Safety")
    safety.emergencyStop("test")
    with pytest.raises(CommandRefusedException):
        scene.pushRobot(Vector3(x=80.0, y=0.0, z=0.0), 0.3)
    scene.placeObject("Ball", Vector3(x=1.0, y=0.5, z=0.05))  # a ball is no part of the robot
    safety.resetEmergencyStop(True)
    scene.pushRobot(Vector3(x=80.0, y=0.0, z=0.0), 0.3)
    eventually(lambda: truth.getGroundTruth().torso.position.z < 0.25)


def test_what_cannot_be_is_refused_with_the_value_named(scene):
    with pytest.raises(InvalidValueException, match="Ball") as caught:
        scene.placeObject("Bal", Vector3(x=0.0, y=0.0, z=0.1))
    assert caught.value.field == "name"
    with pytest.raises(InvalidValueException):
        scene.pushRobot(Vector3(x=float("nan"), y=0.0, z=0.0), 0.1)
    with pytest.raises(InvalidValueException, match="Tail"):
        scene.pressSensor("Tail", 0.1)


@in_simulation(bodies=FAMILIES)
def test_every_body_stands_as_high_as_its_posture_and_is_pressed_where_it_feels(nao):
    truth, scene, body = (
        nao.proxy(GroundTruthPrx, "GroundTruth"),
        nao.proxy(ScenePrx, "Scene"),
        nao.robot.body,
    )
    height = kinematics_of(body).torso_place(body.resting_angles)[2, 3]
    assert truth.getGroundTruth().torso.position.z == pytest.approx(height, abs=0.02)
    scene.placeObject("BallRed", Vector3(x=0.8, y=0.1, z=0.4))
    wait_for(truth.getGroundTruth, lambda seen: abs(seen.objects["BallRed"].position.y - 0.1) < 0.02)
    if body.touch_sensors:
        sensor = body.touch_sensors[1]
        scene.pressSensor(sensor, 5.0)
        wait_for(nao.proxy(TouchPrx, "Touch").getTouchReading, lambda reading: reading.touched == [sensor])


@pytest.mark.parametrize("nao", robots(bodies=FAMILIES), indirect=True)
def test_the_balls_go_where_they_are_sent(nao):
    aims = motors(pan=0.2, x=0.9, z=0.45, panSpeed=1.0, tiltSpeed=0.5)
    for ball in ("BallRed", "BallGreen"):
        assert nao.proxy(Pose3DMotorsPrx, f"{ball}Motors").setPose3DMotorsData(aims) == 0
    for ball in ("BallRed", "BallGreen"):
        wait_for(
            nao.proxy(Pose3DEncodersPrx, f"{ball}Encoders").getPose3DEncodersData,
            lambda data: max(abs(data.pan - 0.2), abs(data.x - 0.9), abs(data.z - 0.45)) < 0.03,
        )


def test_a_robot_without_a_stage_serves_neither():
    with served_to_client(FakeRobot(), timeout=HASTE) as nao:
        for proxy, identity in ((ScenePrx, "Scene"), (GroundTruthPrx, "GroundTruth")):
            with pytest.raises(ObjectNotExistException):
                nao.proxy(proxy, identity)
