"""The live view: what it shows, at which sizes, and how it shows what it does not know."""

import io
import math
import re
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rich.console import Console

from interfaces.hfsm import Breakpoint, ComponentStatus, ErrorReport
from tests.support.component import ball_mark, dance_and_follow, transition_structure
from tests.support.examples import examples
from tests.support.watching import watched
from visualhfsm.monitoring.automata import Automata
from visualhfsm.monitoring.robot import RobotState
from visualhfsm.watch.telemetry import WatchState
from visualhfsm.watch.terminal import View, status_line


def draw(shown: WatchState, width: int = 80, height: int = 24) -> list[str]:
    output = io.StringIO()
    Console(width=width, height=height, file=output, legacy_windows=False).print(View(shown), end="")
    return output.getvalue().splitlines()


def line_with(lines: list[str], text: str) -> str:
    return next(line for line in lines if text in line)


@pytest.mark.parametrize("size", [(80, 24), (140, 40), (60, 24), (200, 60)])
def test_a_terminal_of_any_usual_size_is_filled_and_shows_every_state(size):
    width, height = size
    lines = draw(watched(), width, height)
    assert len(lines) == height
    assert {len(line) for line in lines} == {width}
    for name in ("followBall", "red", "green", "dance", "right", "left"):
        assert any(name in line for line in lines)


@settings(max_examples=examples(20), deadline=None)
@given(st.integers(20, 250), st.integers(4, 80), st.sampled_from([0.1, 9.5, 12.0]))
def test_no_size_overflows(width, height, time):
    lines = draw(watched(time), width, height)
    assert len(lines) <= height
    assert max(len(line) for line in lines) <= width


def test_current_ghost_and_other_states_have_marks_of_their_own():
    lines = draw(watched(9.5))
    assert "● followBall" in line_with(lines, "followBall ")
    assert "● green" in line_with(lines, "● green")
    assert "○ dance" in line_with(lines, "dance ")
    assert "◌ right" in line_with(lines, "right ")


def test_final_states_and_what_has_finished_have_marks_of_their_own():
    structure = dance_and_follow()
    structure.automata[4].states[1].final = True
    structure.automata[1].states[0].final = True
    shown = replace(watched(9.5), automata=Automata(structure))
    assert shown.snapshot is not None
    shown.snapshot.automata[1].state = 1
    shown.snapshot.automata[1].finished = True
    lines = draw(shown)
    assert "■ red" in line_with(lines, "■ red")
    assert "finished" in line_with(lines, "■ red")
    assert "□ left" in line_with(lines, "left ")


def test_the_events_that_a_state_waits_for_are_shown():
    structure = dance_and_follow()
    structure.automata[3].transitions[0] = transition_structure(1, "", 1, 2, event="ball_lost")
    lines = draw(replace(watched(9.5), automata=Automata(structure)), 140, 40)
    assert "waits for ball_lost" in line_with(lines, "● follow ")


def test_an_event_that_changed_the_state_is_reported():
    structure = dance_and_follow()
    structure.automata[1].transitions[0] = transition_structure(1, "change", 1, 2, event="now")
    lines = draw(replace(watched(9.5), automata=Automata(structure)), 140, 40)
    assert "change at now" in line_with(lines, "red →")


def test_a_component_that_stands_at_a_breakpoint_says_where():
    shown = watched(9.5)
    assert shown.snapshot is not None
    shown.snapshot.status = ComponentStatus.Paused
    shown.snapshot.stoppedAt = [Breakpoint(2, 2, 0, "")]
    assert "paused at green" in draw(shown)[0]
    assert "paused at green" in status_line(shown)
    shown.snapshot.stoppedAt = [Breakpoint(2, 0, 1, "")]
    assert "paused at to green" in draw(shown)[0]


def test_the_refused_command_that_pauses_it_is_reported_beside_the_time():
    shown = watched(9.5)
    assert shown.snapshot is not None
    shown.snapshot.status = ComponentStatus.Paused
    shown.snapshot.refusal = "dance/left: CommandRefusedException: the robot is stopped: a hand in the way"
    assert "paused: dance/left: Command" in draw(shown)[0]
    assert "s watched" in draw(shown)[0]
    assert "a hand in the way" in status_line(shown)


def test_the_bar_of_a_timer_shrinks_with_what_is_left():
    early, late = (line_with(draw(watched(time), 140, 40), "● followBall") for time in (1.0, 9.0))
    assert "9.1 s to dance" in early
    assert "1.1 s to dance" in late
    full = draw(watched(0.1), 140, 40)
    assert line_with(full, "● followBall").count("━") == 24


def test_a_mark_is_reported_in_pixels_and_drawn_in_its_place():
    lines = draw(watched())
    assert "u  +12.5 px" in line_with(lines, "u  +")
    assert "v   -3.2 px" in line_with(lines, "v  ")
    centered = next(row for row, line in enumerate(lines) if "●" in line.split("Camera")[-1][40:])
    right = watched()
    assert right.snapshot is not None
    right.snapshot.marks = [ball_mark(150.0, 100.0)]
    lines = draw(right)
    below = next(row for row, line in enumerate(lines) if "●" in line[40:])
    assert below > centered


def test_without_a_mark_the_picture_says_so():
    lost = watched()
    assert lost.snapshot is not None
    lost.snapshot.marks = []
    assert any("nothing marked" in line for line in draw(lost))


def test_the_marks_of_a_component_that_is_lost_are_gone():
    assert any("nothing marked" in line for line in draw(replace(watched(), snapshot_age=1.4)))


def test_marks_of_another_camera_are_not_shown_on_this_one():
    shown = watched()
    assert shown.snapshot is not None
    shown.snapshot.marks[0].camera = "CameraBottom"
    assert any("nothing marked" in line for line in draw(shown))


def test_angles_are_reported_in_radians():
    lines = draw(watched())
    assert "+0.31" in line_with(lines, "head pan")
    assert "-0.07" in line_with(lines, "head tilt")
    assert line_with(lines, "shoulder pitch").count("█") == 2


def test_a_head_turned_to_the_left_is_drawn_on_the_left():
    line = line_with(draw(watched()), "head pan")
    assert line.index("█") < line.index("┼")


def test_changes_of_state_are_reported_with_their_time():
    assert "8.0 s    red → green" in line_with(draw(watched()), "red →")


def test_a_lost_server_is_a_banner_and_its_values_are_marked_as_old():
    lines = draw(replace(watched(), robot_age=3.2))
    assert "Robot server lost 3 s ago" in lines[1]
    assert "tcp/127.0.0.1:7447" in lines[1]
    assert len(lines) == 24
    assert any("Robot (rad), 3 s old" in line for line in lines)


def test_a_lost_component_is_a_banner():
    lines = draw(replace(watched(), snapshot_age=1.4))
    assert "dance_and_follow lost 1 s ago" in lines[1]
    assert any("Automata, 1 s old" in line for line in lines)


def test_before_anything_is_heard_the_view_shows_what_it_waits_for():
    nothing = WatchState("follow_ball", "tcp/127.0.0.1:7447")
    lines = draw(nothing)
    assert "Waiting for a robot server at tcp/127.0.0.1:7447; naoserver-sim starts one" in lines[1]
    only_robot = replace(watched(), automata=None, snapshot=None)
    assert "start it, such as by python dance_and_follow.py" in draw(only_robot)[1]


def test_errors_of_the_component_are_shown():
    shown = watched()
    assert shown.snapshot is not None
    shown.snapshot.errors.append(ErrorReport(3.2, 1, 1, "x.py:3", "no such joint HeadRoll"))
    shown.snapshot.status = ComponentStatus.Halted
    lines = draw(shown)
    assert "halted" in lines[0]
    assert "3.2 s  followBall: no such joint" in line_with(lines, "no such")
    assert "│   HeadRoll " in line_with(lines, "HeadRoll")


def test_what_other_processes_send_is_not_taken_for_markup():
    structure = dance_and_follow()
    structure.automata[0].states[0].name = "[red]x[/]"
    lines = draw(replace(watched(), automata=Automata(structure)))
    assert "● [red]x[/]" in line_with(lines, "x[/]")


def test_what_other_processes_send_does_not_command_the_terminal():
    structure = dance_and_follow()
    structure.automata[0].states[0].name = "\x1b[2Jx\n"
    shown = replace(watched(), automata=Automata(structure))
    assert shown.snapshot is not None
    assert shown.robot.health is not None
    shown.snapshot.errors.append(ErrorReport(1.0, 1, 1, "", "\x1b]0;title\x07"))
    shown.snapshot.automata[3].variables["name"] = "\x1b[31m"
    shown.snapshot.marks = [ball_mark(0, 0, "\x1b[31m")]
    shown.robot.health.events[0].message = "\x9b31m"
    lines = draw(shown, 140, 40)
    assert len(lines) == 40
    assert not re.search("[\x00-\x1f\x7f-\x9f]", "".join(lines))


@settings(max_examples=examples(30), deadline=None)
@given(st.integers(1, 10**6), st.integers(1, 10**6), st.integers(20, 200), st.integers(10, 60))
def test_an_image_of_any_shape_fits(image_width, image_height, width, height):
    lines = draw(replace(watched(), image_size=(image_width, image_height)), width, height)
    assert max(len(line) for line in lines) <= width


@settings(max_examples=examples(30), deadline=None)
@given(st.floats(), st.floats(), st.floats())
@example(math.nan, math.nan, math.nan)
def test_no_number_that_arrives_breaks_the_view(first, second, third):
    shown = watched()
    assert shown.snapshot is not None
    assert shown.robot.health is not None
    snapshot, health = shown.snapshot, shown.robot.health
    snapshot.time = health.time = first
    snapshot.automata[0].timers[0].remaining = snapshot.automata[0].enteredAt = second
    health.realTimeFactor = health.lag = health.torsoTilt = health.cameraRates["Camera"] = third
    snapshot.marks = [ball_mark(first, second)]
    shown = replace(
        shown,
        robot=RobotState({"LShoulderPitch": first}, second, third, health),
        limits={"HeadYaw": (second, third), "LShoulderPitch": (second, third)},
    )
    assert len(draw(shown)) == 24


def test_states_that_do_not_fit_are_counted():
    lines = draw(watched(), 60, 12)
    assert any("more states" in line for line in lines)
    assert any("● green" in line for line in lines)


def test_a_line_for_other_output_shows_the_same():
    assert status_line(watched(9.5)).strip().split("  ") == [
        "9.4 s", "followBall > green > follow", "green ball +12 -3 px", "head +0.31 -0.07 rad",
        "10.0 images/s", "real time x 0.99",
    ]  # fmt: skip


def test_a_line_for_other_output_shows_trouble():
    assert "Robot server lost" in status_line(replace(watched(), robot_age=3.0))
