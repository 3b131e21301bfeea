"""The behavior `get_up`: it notices a fall, gets up, and goes on with what it did."""

from __future__ import annotations

import pytest

from interfaces.jderobot import InvalidValueException
from interfaces.nao import ActionState, ActionStatus
from visualhfsm.testing import Behavior, MakeBehavior

DOCUMENT = "behaviors/get_up.xml"

pytestmark = pytest.mark.sim


@pytest.fixture
def b(behavior: MakeBehavior) -> Behavior:
    return behavior(DOCUMENT, robot="sim", camera="drawn", world="empty", noise=True, seed=1)


def shove(b: Behavior, x: float, y: float) -> None:
    """Push the torso to the front and to the left, by forces in N."""
    stage = b.robot.device.stage
    assert stage is not None
    stage.push((x, y, 0.0), 0.15)


def action(status: ActionStatus) -> ActionState:
    return ActionState(0.0, "Stand", status, 0.0, "", 1)


@pytest.mark.parametrize(
    ("x", "y", "side"), [(-120.0, 0.0, "back"), pytest.param(120.0, 0.0, "belly", marks=pytest.mark.slow)]
)
def test_it_gets_up_after_a_fall(b: Behavior, x: float, y: float, side: str) -> None:
    b.advance(1.0)
    shove(b, x, y)
    b.run_until("fallen", limit=2.0)
    b.run_until("get_up", limit=1.1)
    assert b.variables("get_up")["lay"] == side
    b.run_until("up", limit=50.0)
    assert not b.robot.state.fallen
    b.run_until("busy", limit=1.1)
    assert [state for _, state in b.changes("get_up")] == ["busy", "fallen", "get_up", "up", "busy"]


@pytest.mark.parametrize(("activity", "moves"), [("walk", "Motors.setV"), ("wave", "Motions.play")])
def test_it_does_its_activity_until_it_falls(behavior: MakeBehavior, activity: str, moves: str) -> None:
    b = behavior(
        DOCUMENT, robot="sim", camera="drawn", world="empty", seed=1, parameters={"activity": activity}
    )
    b.advance(1.5)
    assert b.calls(moves)
    shove(b, -150.0, 0.0)
    fell = b.run_until("fallen", limit=2.0)
    b.advance(0.5)
    assert all(call.time <= fell for call in b.calls(moves))


def test_an_attempt_that_fails_is_repeated(b: Behavior) -> None:
    b.stub("Health", getHealth=b.component.Health.getHealth())
    b.force("get_up", "falls")
    b.run_until("get_up", limit=2.0)
    b.stub("Postures", goToPosture=None, getPostureState=action(ActionStatus.Failed))
    b.run_until("fallen", limit=1.0)
    b.run_until("get_up", limit=1.1)


def test_a_robot_that_is_too_hot_waits(b: Behavior) -> None:
    hot = InvalidValueException("LShoulderPitch is at 85 degrees: let it cool below 75", "name")
    b.stub("Postures", goToPosture=hot, getPostureState=action(ActionStatus.Done))
    b.force("get_up", "falls")
    b.run_until("get_up", limit=2.0)
    b.advance(0.1)
    assert b.active == "fallen", "what came of an earlier call is not taken for an answer to the refused one"
    b.stub("Postures", goToPosture=None)
    b.run_until("up", limit=2.0)


def test_it_gets_up_again_when_it_falls_right_after(b: Behavior) -> None:
    b.stub("Postures", goToPosture=None, getPostureState=action(ActionStatus.Done))
    b.force("get_up", "falls")
    b.run_until("up", limit=2.0)
    shove(b, 150.0, 0.0)
    b.run_until("fallen", limit=2.0)
