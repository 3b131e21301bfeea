"""The plans of trials beside the behaviors: a few trials of each say what all of them are to say."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec import structs

from visualhfsm.trials import Outcome, Plan, plan_of
from visualhfsm.trials._trial import run_trial

pytestmark = pytest.mark.sim


def plan(name: str, **fields: object) -> Plan:
    """Return the plan of a behavior, whose pictures are drawn."""
    return structs.replace(plan_of(Path("behaviors") / f"{name}.xml"), camera="drawn", **fields)


def at_speed(speed: float) -> Outcome:
    """Return how the ball is followed for six seconds that is carried at a speed in rad/s."""
    follow = plan("follow_ball", limit=6.0)
    carried = structs.replace(follow.disturbances["carried"], speed=speed)
    return run_trial(structs.replace(follow, disturbances={"carried": carried}), 1)


def test_a_slow_ball_is_followed_and_the_faster_it_is_the_larger_is_the_error() -> None:
    slow, faster = at_speed(0.25), at_speed(0.5)
    assert slow.success
    assert faster.success
    assert (slow.numbers["losses"], slow.numbers["lost"]) == (0.0, 0.0)
    assert 0.02 < slow.numbers["aim mean"] < 0.12
    assert faster.numbers["aim mean"] > 1.5 * slow.numbers["aim mean"]


def test_a_ball_that_is_too_fast_is_lost() -> None:
    outcome = at_speed(2.0)
    assert outcome.reason == "loses the ball"
    assert outcome.numbers["losses"] >= 1
    assert 0.0 < outcome.numbers["lost"] < 6.0


def shoved(direction: float, **fields: object) -> Outcome:
    """Return how the robot gets up that is pushed over in a direction, in rad to the left of the front."""
    get_up = plan("get_up", parameters={"activity": "stand"}, **fields)
    shove = structs.replace(get_up.disturbances["shove"], at=2.0, push=120.0, direction=direction)
    return run_trial(structs.replace(get_up, disturbances={"shove": shove}), 1)


def test_a_robot_that_falls_on_its_back_stands_up() -> None:
    outcome = shoved(3.14)
    assert outcome.success
    assert outcome.groups == {"lay": "back"}
    assert 15.0 < outcome.numbers["seconds"] < 25.0


def test_a_robot_that_still_lies_has_failed() -> None:
    outcome = shoved(0.0, limit=4.0)
    assert outcome.reason == "not in up after 4 s"
    assert outcome.groups == {"lay": "belly"}


def test_a_robot_that_does_not_fall_is_not_counted_as_one_that_got_up() -> None:
    get_up = plan("get_up", parameters={"activity": "stand"}, limit=3.0)
    gentle = structs.replace(get_up.disturbances["shove"], at=1.0, push=1.0)
    outcome = run_trial(structs.replace(get_up, disturbances={"shove": gentle}), 1)
    assert (outcome.success, outcome.groups) == (False, {"lay": "did not fall"})
    assert "seconds" not in outcome.numbers
