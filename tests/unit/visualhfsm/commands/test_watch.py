"""The line about a component and its robot: what it says, and how it shows what it does not know."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from interfaces.hfsm import Breakpoint, ComponentStatus, ErrorReport
from tests.support.component import ball_mark, dance_and_follow
from tests.support.examples import examples
from tests.support.watching import watched
from visualhfsm._commands.watch import WatchState, status_line
from visualhfsm._monitor.realm.automata import Automata
from visualhfsm._monitor.realm.robot import RobotState


def test_states_marks_and_robot_are_in_one_line() -> None:
    assert status_line(watched(9.5)).strip().split("  ") == [
        "9.4 s", "followBall > green > follow", "green ball 172 116 px", "head +0.31 -0.07 rad",
        "10.0 images/s", "real time x 0.99",
    ]  # fmt: skip


def test_a_component_that_stands_at_a_breakpoint_says_where() -> None:
    shown = watched(9.5)
    assert shown.snapshot is not None
    shown.snapshot.status = ComponentStatus.Paused
    shown.snapshot.stoppedAt = [Breakpoint(2, 2, 0, "")]
    assert "  paused at green  " in status_line(shown)
    shown.snapshot.stoppedAt = [Breakpoint(2, 0, 1, "")]
    assert "  paused at to green  " in status_line(shown)


def test_the_refused_command_that_pauses_it_is_reported() -> None:
    shown = watched(9.5)
    assert shown.snapshot is not None
    shown.snapshot.status = ComponentStatus.Paused
    shown.snapshot.refusal = "dance/left: CommandRefusedException: the robot is stopped: a hand in the way"
    assert "paused: dance/left: CommandRefusedException: the robot is stopped: a hand" in status_line(shown)


def test_the_last_error_of_the_component_is_reported() -> None:
    shown = watched(9.5)
    assert shown.snapshot is not None
    shown.snapshot.errors.append(ErrorReport(3.2, 1, 1, "x.py:3", "no such joint HeadRoll"))
    shown.snapshot.status = ComponentStatus.Halted
    assert "  halted  error at 3.2 s in followBall: no such joint HeadRoll  " in status_line(shown)


def test_a_robot_that_its_server_does_not_reach_is_lost() -> None:
    line = status_line(replace(watched(), robot_lost=True))
    assert line.endswith("  robot lost")
    assert "real time" not in line


def test_a_robot_that_has_fallen_is_reported() -> None:
    shown = watched()
    assert shown.robot.health is not None
    shown.robot.health.fallen = True
    assert "  fallen  " in status_line(shown)


@pytest.mark.parametrize("reason", ["lost", "none"])
def test_a_mark_that_is_not_there_is_left_out(reason: str) -> None:
    shown = watched()
    assert shown.snapshot is not None
    if reason == "none":
        shown.snapshot.marks = []
    else:
        shown = replace(shown, snapshot_age=1.4)
    assert "px" not in status_line(shown)


def test_who_does_not_answer_is_reported() -> None:
    nothing = WatchState("follow_ball", "tcp/127.0.0.1:7447")
    assert status_line(nothing) == (
        "Waiting for a robot server at tcp/127.0.0.1:7447; naoserver-sim starts one"
    )
    only_robot = replace(watched(), automata=None, snapshot=None)
    assert "start it, such as by python dance_and_follow.py" in status_line(only_robot)
    lost = status_line(replace(watched(), robot_age=3.2))
    assert lost == "Robot server lost 3 s ago; going on when it is back at tcp/127.0.0.1:7447"
    assert "dance_and_follow lost 1 s ago" in status_line(replace(watched(), snapshot_age=1.4))


def test_what_other_processes_send_does_not_command_the_terminal() -> None:
    structure = dance_and_follow()
    structure.automata[0].states[0].name = "\x1b[2Jx\n"
    shown = replace(watched(), automata=Automata(structure))
    assert shown.snapshot is not None
    shown.snapshot.errors.append(ErrorReport(1.0, 1, 1, "", "\x1b]0;title\x07"))
    shown.snapshot.status, shown.snapshot.refusal = ComponentStatus.Paused, "\x9b31m"
    shown.snapshot.marks = [ball_mark(0, 0, "\x1b[31m")]
    assert not re.search("[\x00-\x1f\x7f-\x9f]", status_line(shown))


@settings(max_examples=examples(30), deadline=None)
@given(st.floats(), st.floats(), st.floats())
@example(float("nan"), float("nan"), float("nan"))
def test_no_number_that_arrives_breaks_the_line(first: float, second: float, third: float) -> None:
    shown = watched()
    assert shown.snapshot is not None
    assert shown.robot.health is not None
    snapshot, health = shown.snapshot, shown.robot.health
    snapshot.time = health.time = first
    health.realTimeFactor = health.cameraRates["Camera"] = third
    snapshot.marks = [ball_mark(first, second)]
    shown = replace(shown, robot=RobotState({"LShoulderPitch": first}, second, third, health))
    assert status_line(shown)
