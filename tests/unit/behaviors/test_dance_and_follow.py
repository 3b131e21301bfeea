"""The paper's third experiment, `dance_and_follow`, in virtual time: a hierarchy whose automata become ghosts."""

from __future__ import annotations

import pytest

from hfsm_runtime.tree import ChangeKind
from tests.support.soak import repeated
from visualhfsm.testing import Behavior, MakeBehavior, check_properties

DOCUMENT = "behaviors/dance_and_follow.xml"
POSITIONS = 10
ARMS = ("RightShoulder", "RightElbow", "LeftShoulder", "LeftElbow")


@pytest.fixture
def b(behavior: MakeBehavior) -> Behavior:
    return behavior(DOCUMENT, robot="fake")


@pytest.mark.slow
def test_ball_and_dance_take_turns_of_ten_seconds_and_the_balls_of_eight(b: Behavior) -> None:
    b.robot.ball("red").place(pan=-0.5)
    b.robot.ball("green").place(pan=0.5)
    b.advance(7.9)
    assert b.is_active("followBall/red")
    assert b.robot.head[0] == pytest.approx(-0.5, abs=0.02)
    b.advance(2.0)
    assert b.is_active("followBall/green")
    assert b.robot.head[0] == pytest.approx(0.5, abs=0.05)
    b.advance(10.0)
    arm, reached = b.state("dance"), b.variables("dance")["reached"]
    b.advance(5.0)
    assert b.is_ghost("dance")
    assert (b.state("dance"), b.variables("dance")["reached"]) == (arm, reached)
    b.run_until("dance")
    assert b.time == 30.0
    kinds = [(change.kind, change.state) for change in b.trace if change.automaton == "dance"]
    assert kinds[-2:] == [(ChangeKind.GHOST, arm), (ChangeKind.RESUMED, arm)], "it goes on where it was left"
    b.advance(17.0)
    assert b.changes("dance_and_follow") == [
        (0.0, "followBall"), (10.0, "dance"), (20.0, "followBall"), (30.0, "dance"), (40.0, "followBall"),
    ]  # fmt: skip
    # 8 s red; 2 s green, 10 s dance, 6 s green; 4 s red, 10 s dance, 4 s red.
    assert b.changes("followBall") == [(0.0, "red"), (8.0, "green"), (26.0, "red"), (44.0, "green")]
    commands = [call for arm in ARMS for call in b.calls(f"{arm}Motors")]
    assert commands
    assert {call.automaton for call in commands} == {"dance"}
    assert all(call.time % 20.0 >= 10.0 for call in commands), (
        "nobody moves the arms while a ball is followed"
    )


@pytest.mark.slow
def test_the_dance_begins_with_a_head_that_stands_still(b: Behavior) -> None:
    b.robot.ball("green").move(pan=1.5, speed=0.4)
    b.advance(10.2)
    assert b.active == "dance/right"
    assert b.calls("Head")[-1].target == "Head.stop"
    still = b.robot.head
    b.advance(9.7)
    assert b.robot.head == pytest.approx(still, abs=1e-3)
    assert not [call for call in b.calls("Head") if call.time > 10.0]


@pytest.mark.slow
def test_each_arm_goes_through_ten_positions_in_its_turn(b: Behavior) -> None:
    b.run_until("dance/left")
    reached = [call for call in b.calls("RightShoulderMotors") if call.automaton == "dance"]
    assert len({(call.data.tilt, call.data.roll) for call in reached}) == POSITIONS
    assert not [call for call in b.calls("LeftShoulderMotors") if call.time < b.time]
    b.run_until("dance/right")
    assert b.variables("dance")["reached"] == 0
    assert len({call.data.tilt for call in b.calls("LeftShoulderMotors")}) == POSITIONS


@pytest.mark.parametrize("color", ["red", "green"])
def test_a_ball_that_is_lost_is_searched_and_found(b: Behavior, color: str) -> None:
    follow, search = f"followBall/{color}/follow", f"followBall/{color}/search"
    b.robot.ball(color).hide()
    lost = b.run_until(search, limit=10.0)
    assert lost == pytest.approx(0.6 if color == "red" else 8.6, abs=0.1)
    b.advance(0.3)
    assert b.active == search
    b.robot.ball(color).place(pan=0.5)
    b.run_until(follow, limit=1.0)


@pytest.mark.slow
def test_the_search_for_a_ball_rests_while_the_robot_dances(b: Behavior) -> None:
    b.robot.ball("green").hide()
    b.run_until("followBall/green/search", limit=9.0)
    b.run_until("dance")
    assert b.is_ghost("followBall/green")
    b.run_until("followBall", limit=10.0)
    assert b.active == "followBall/green/search"


@pytest.mark.slow
def test_whatever_the_guards_do_only_one_of_them_drives_the_robot() -> None:
    def ghosts_are_still(b: Behavior) -> bool:
        return b.is_ghost("followBall") == b.is_active("dance") and b.is_ghost("dance") != b.is_active(
            "dance"
        )

    def one_ball_at_a_time(b: Behavior) -> bool:
        return b.is_ghost("followBall/red") or b.is_ghost("followBall/green")

    check_properties(DOCUMENT, ghosts_are_still, one_ball_at_a_time, examples=repeated(10, 25), steps=20)


@pytest.mark.slow
def test_whatever_the_balls_do_the_code_of_ghosts_never_runs() -> None:
    def only_who_is_active_calls(b: Behavior) -> bool:
        calls = [call for call in b.calls()[-20:] if call.automaton and call.target != "Head.stop"]
        return all((call.automaton == "dance") == (10.0 <= call.time % 20.0 < 20.0) for call in calls)

    check_properties(
        DOCUMENT,
        only_who_is_active_calls,
        abstract=False,
        robot="fake",
        balls=["red", "green"],
        examples=repeated(3, 5),
        steps=10,
    )
