"""What moves a robot, as clients use it over Zenoh, on a robot without physics."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

from interfaces.jderobot import EncodersPrx, InvalidValueException, MotorsPrx, Pose3DMotorsPrx
from interfaces.nao import (
    ActionStatus,
    HealthPrx,
    JointCommand,
    JointsPrx,
    MotionsPrx,
    PoseHeadPrx,
    PosturesPrx,
    WalkPrx,
)
from naoserver.bodies import find_body
from naoserver.bodies.capabilities import STILL
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from tests.support.conformance import motors
from tests.support.limits import FOREVER
from tests.support.motion_rig import MOTIONS
from tests.support.robot_server import RobotClient, eventually, served_to_client, wait_for

PATIENT = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER, gains_timeout=FOREVER))
"""For tests in which a velocity is to last."""
SOON = ServerOptions(safety=SafetyOptions(velocity_timeout=0.1, gains_timeout=0.1))
"""For tests in which nobody renews one."""


# -- what a client commands ends with it, at every entrance -------------------------------------------------------


class Entrance(NamedTuple):
    """A way to move a robot, and whether it moves by it."""

    interface: Any
    identity: str
    move: Callable[[Any], object]
    moves: Callable[[RobotClient], object]

    def __call__(self, nao: RobotClient) -> object:
        return self.move(nao.proxy(self.interface, self.identity))


HEAD, ELBOW = "AAHead_yaw", "Left_Elbow_Pitch"
PULL = {ELBOW: JointCommand(position=0.4, kp=50.0, kd=2.0)}


def walks(nao):
    return nao.robot.walker.commanded() != STILL


def turns(nao):
    return nao.assembly.body.velocity(HEAD) != 0.0


def waves(nao):
    return nao.proxy(MotionsPrx, "Motions").getMotionState().status is ActionStatus.Moving


def goes(nao):
    """Return whether a way was begun that was not ended: it is short, and leads into a crouch without a client."""
    state = nao.proxy(PosturesPrx, "Postures").getPostureState()
    return state.status in (ActionStatus.Moving, ActionStatus.Done)


RENEWED = {
    "setV": Entrance(MotorsPrx, "Motors", lambda walk: walk.setV(0.1), walks),
    "setW": Entrance(MotorsPrx, "Motors", lambda walk: walk.setW(0.1), walks),
    "setL": Entrance(MotorsPrx, "Motors", lambda walk: walk.setL(0.1), walks),
    "setSpeed": Entrance(PoseHeadPrx, "Head", lambda head: head.setSpeed(0.1, 0.0), turns),
    "NeckSpeed": Entrance(
        Pose3DMotorsPrx, "NeckSpeed", lambda neck: neck.setPose3DMotorsData(motors(panSpeed=0.1)), turns
    ),
    "gains": Entrance(
        JointsPrx, "Body", lambda body: body.setJointCommands(PULL), lambda nao: not nao.is_free(ELBOW)
    ),
}
"""What lasts only while it is renewed."""
ENTRANCES = RENEWED | {
    "walkTo": Entrance(WalkPrx, "Walk", lambda walk: walk.walkTo(5.0, 0.0, 0.0), walks),
    "play": Entrance(MotionsPrx, "Motions", lambda motions: motions.play("wave", 0.1), waves),
    "goToPosture": Entrance(
        PosturesPrx, "Postures", lambda postures: postures.goToPosture("StandZero", 0.3), goes
    ),
    "setJointPositions": Entrance(
        JointsPrx,
        "Body",
        lambda body: body.setJointPositions({HEAD: 1.0}, 0.01),
        lambda nao: nao.robot.read().velocities[nao.robot.body.joint_names.index(HEAD)] > 0.0,
    ),
}


@pytest.fixture(scope="module")
def hasty():
    with served_to_client(FakeRobot(body=find_body("T1")), SOON) as nao:
        yield nao


@pytest.fixture(scope="module")
def patient():
    with served_to_client(FakeRobot(body=find_body("T1")), PATIENT) as nao:
        yield nao


@pytest.mark.parametrize("entrance", RENEWED)
def test_what_nobody_renews_ends_and_is_counted(hasty, entrance):
    begin, health = RENEWED[entrance], hasty.proxy(HealthPrx, "Health")
    before = health.getHealth().velocityTimeouts
    eventually(lambda: begin(hasty) is not None and begin.moves(hasty))
    eventually(lambda: not begin.moves(hasty))
    eventually(lambda: health.getHealth().velocityTimeouts > before)
    assert any("not renewed" in event.message for event in health.getHealth().events)


@pytest.mark.parametrize("entrance", ENTRANCES)
def test_what_a_lost_client_began_ends(patient, entrance):
    begin = ENTRANCES[entrance]
    with patient.client() as other:
        begin(other)
        eventually(lambda: begin.moves(patient))
    eventually(lambda: not begin.moves(patient))


# -- the walk -----------------------------------------------------------------------------------------------------


@pytest.fixture
def nao():
    with served_to_client(FakeRobot(), PATIENT) as nao:
        yield nao


@pytest.fixture(scope="module")
def patient_nao():
    """A Nao that stands: all that it is asked is refused."""
    with served_to_client(FakeRobot(), PATIENT) as nao:
        yield nao


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda nao: nao.proxy(MotorsPrx, "Motors").setV(math.nan), "v"),
        (lambda nao: nao.proxy(MotorsPrx, "Motors").setW(math.nan), "w"),
        (lambda nao: nao.proxy(MotorsPrx, "Motors").setL(math.nan), "l"),
        (lambda nao: nao.proxy(WalkPrx, "Walk").walkTo(math.nan, 0.0, 0.0), "x"),
        (lambda nao: nao.proxy(WalkPrx, "Walk").walkTo(0.0, 101.0, 0.0), "y"),
        (lambda nao: nao.proxy(WalkPrx, "Walk").walkTo(0.0, 0.0, 7.0), "heading"),
        (lambda nao: nao.proxy(MotionsPrx, "Motions").play("fly", 1.0), "name"),
        (lambda nao: nao.proxy(MotionsPrx, "Motions").play("wave", 0.0), "pace"),
        (lambda nao: nao.proxy(MotionsPrx, "Motions").play("wave", 2.5), "pace"),
        (lambda nao: nao.proxy(MotionsPrx, "Motions").play("wave", math.nan), "pace"),
        (lambda nao: nao.proxy(MotionsPrx, "Motions").play("stand_up_from_belly", 1.0), "name"),
        (lambda nao: nao.proxy(PosturesPrx, "Postures").goToPosture("Fly", 1.0), "name"),
        (lambda nao: nao.proxy(PosturesPrx, "Postures").goToPosture("Stand", 0.0), "fraction"),
        (lambda nao: nao.proxy(PosturesPrx, "Postures").goToPosture("Stand", 1.5), "fraction"),
    ],
)
def test_what_no_robot_can_do_is_refused_by_its_field(patient_nao, call, field):
    with pytest.raises(InvalidValueException) as refusal:
        call(patient_nao)
    assert refusal.value.field == field


def test_the_odometry_reports_where_it_has_got_to_in_calls_and_as_a_stream(nao):
    walk, encoders = nao.proxy(MotorsPrx, "Motors"), nao.proxy(EncodersPrx, "Encoders")
    assert encoders.getEncodersData().robotx == 0.0
    walk.setV(0.3)
    walk.setW(0.9)
    there = wait_for(encoders.getEncodersData, lambda data: data.robottheta > 0.1)
    walk.stop()
    assert (walk.getV(), walk.getW(), walk.getL()) == (0.0, 0.0, 0.0)
    here = encoders.getEncodersData()
    assert here.robotx > 0.0
    assert here.robottheta >= there.robottheta
    assert (here.robotcos, here.robotsin) == pytest.approx(
        (math.cos(here.robottheta), math.sin(here.robottheta)), abs=1e-6
    )
    assert encoders.getEncodersData() == here


def test_the_walk_to_a_place_streams_how_far_it_is(nao):
    walk = nao.proxy(WalkPrx, "Walk")
    shares = []
    walk.getWalkState.subscribe(lambda sample: shares.append(sample.value.progress))
    walk.walkTo(0.2, 0.0, 0.5)
    wait_for(walk.getWalkState, lambda state: state.status is ActionStatus.Done)
    eventually(lambda: shares[-1:] == [1.0])
    assert any(0.0 < share < 1.0 for share in shares)


# -- motions ------------------------------------------------------------------------------------------------------


def test_motions_have_their_facts_and_the_state_of_the_newest_one_is_streamed(nao):
    motions = nao.proxy(MotionsPrx, "Motions")
    reported = {facts.name: facts for facts in motions.getMotions()}
    assert reported.keys() == MOTIONS.keys()
    assert reported["kick"].start == "StandInit"
    assert reported["wave"].duration == pytest.approx(MOTIONS["wave"].duration)
    assert motions.getMotionState().status is ActionStatus.Idle
    motions.play("wave", 1.0)
    state = wait_for(motions.getMotionState, lambda state: state.progress > 0.05)
    assert (state.name, state.status, state.count) == ("wave", ActionStatus.Moving, 1)
    motions.stop()
    wait_for(motions.getMotionState, lambda state: state.status is ActionStatus.Stopped)
