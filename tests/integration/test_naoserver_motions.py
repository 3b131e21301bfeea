"""Motions and postures through proxies over Zenoh."""

import pytest

from interfaces.jderobot import InvalidValueException
from interfaces.nao import ActionStatus, JointsPrx, MotionsPrx, PosturesPrx
from naoserver.fake import FakeRobot
from tests.support.motion_rig import MOTIONS
from tests.support.robot_server import served, served_to_client, wait_for


@pytest.fixture
def nao():
    with served_to_client(FakeRobot()) as nao:
        yield nao


def test_a_motion_is_played_reported_and_stopped(nao):
    motions, body = nao.proxy(MotionsPrx, "Motions"), nao.proxy(JointsPrx, "Body")
    reported = {facts.name: facts for facts in motions.getMotions()}
    assert reported.keys() == MOTIONS.keys()
    assert reported["kick"].start == "StandInit"
    assert reported["wave"].duration == pytest.approx(MOTIONS["wave"].duration)
    assert motions.getMotionState().status is ActionStatus.Idle

    motions.play("wave", 1.0)
    state = wait_for(motions.getMotionState, lambda state: state.progress > 0.05)
    assert (state.name, state.status, state.count) == ("wave", ActionStatus.Moving, 1)
    with pytest.raises(InvalidValueException, match="the motion wave") as refused:
        body.setJointPositions({"RElbowRoll": 0.5}, 0.2)
    assert refused.value.field == "RElbowRoll"

    motions.stop()
    wait_for(motions.getMotionState, lambda state: state.status is ActionStatus.Stopped)
    body.setJointPositions({"RElbowRoll": 0.5}, 0.2)


def test_a_posture_is_gone_to_and_reported(nao):
    postures = nao.proxy(PosturesPrx, "Postures")
    assert postures.getPosture() == "StandInit"
    postures.goToPosture("Stand", 1.0)
    state = wait_for(postures.getPostureState, lambda state: state.status is ActionStatus.Done)
    assert (state.name, state.progress) == ("Stand", 1.0)
    assert postures.getPosture() == "Stand"


@pytest.mark.parametrize(
    ("name", "pace", "field"),
    [("fly", 1.0, "name"), ("wave", 0.0, "pace"), ("wave", 2.5, "pace"), ("wave", float("nan"), "pace"),
     ("stand_up_from_belly", 1.0, "name")],
)  # fmt: skip
def test_a_motion_that_cannot_be_played_is_refused(nao, name, pace, field):
    with pytest.raises(InvalidValueException) as refused:
        nao.proxy(MotionsPrx, "Motions").play(name, pace)
    assert refused.value.field == field


@pytest.mark.parametrize(("name", "fraction", "field"), [("Fly", 1.0, "name"), ("Stand", 1.5, "fraction")])
def test_a_posture_that_is_none_is_refused(nao, name, fraction, field):
    with pytest.raises(InvalidValueException) as refused:
        nao.proxy(PosturesPrx, "Postures").goToPosture(name, fraction)
    assert refused.value.field == field


def test_a_dance_ends_with_its_client():
    with served(FakeRobot()) as server, server.client() as watcher:
        with server.client() as dancer:
            dancer.proxy(MotionsPrx, "Motions").play("dance", 1.0)
        motions = watcher.proxy(MotionsPrx, "Motions")
        state = wait_for(motions.getMotionState, lambda state: state.status is ActionStatus.Stopped)
        assert (state.name, state.message) == ("dance", "the client that commanded it is gone")
