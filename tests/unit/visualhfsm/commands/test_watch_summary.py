"""The figures of a run."""

import io

import pytest
from msgspec.structs import replace
from rich.console import Console

from interfaces.hfsm import ErrorReport
from interfaces.nao import HealthReport
from tests.support.component import dance_and_follow, snapshot
from visualhfsm._commands.watch_summary import figures_of, in_middle_third, summarize, summary_table
from visualhfsm._monitor.realm.automata import Automata
from visualhfsm._monitor.realm.robot import RobotState
from visualhfsm._monitor.realm.run_log import LiveSnapshot, RunLog


def health(lag: float, factor: float, tilt: float = float("nan"), **rates: float) -> RobotState:
    report = HealthReport(0.0, 0.0, factor, lag, tilt, False, rates, 0, 0, [])
    return RobotState(health=report)


def record(until: float, ball_at, robot: RobotState | None = None) -> RunLog:
    log = RunLog()
    for tenth in range(round(until * 10)):
        time = tenth / 10
        log.add(LiveSnapshot(time, snapshot(time, ball_at(time)), robot or RobotState()))
    return log


def test_the_first_two_seconds_of_each_time_of_following_do_not_count():
    def off_center_at_first(time: float) -> tuple[float, float]:
        beginning = max(start for start in (0, 8, 20, 26) if start <= time)
        return (150.0 if time - beginning < 2 else 5.0, 0.0)

    centered = summarize(record(30, off_center_at_first)).centered
    # Red is followed from 0 to 8 and 26 to 30 s, green from 8 to 10 and 20 to 26 s, ten times a second.
    assert centered == {"red ball": (1.0, 60 + 20), "green ball": (1.0, 0 + 40)}


def test_a_ball_that_was_lost_is_counted_again_two_seconds_after_it_is_found():
    def lost_for_two_seconds(time: float) -> tuple[float, float] | None:
        return None if 3 <= time < 5 else (0.0, 0.0)

    assert summarize(record(8, lost_for_two_seconds)).centered == {"red ball": (1.0, 10 + 10)}


def test_a_ball_outside_of_the_middle_third_lowers_the_share():
    def off_center_after_four_seconds(time: float) -> tuple[float, float]:
        return (0.0 if time < 4 else 100.0, 0.0)

    assert summarize(record(6, off_center_after_four_seconds)).centered == {"red ball": (0.5, 40)}


def test_without_a_mark_there_is_no_share():
    assert summarize(record(1, lambda time: None)).centered == {}


def test_marks_on_another_camera_do_not_count():
    assert summarize(record(6, lambda time: (0.0, 0.0)), "CameraBottom").centered == {}


@pytest.mark.parametrize(
    ("u", "v", "centered"),
    [(0, 0, True), (53.3, 40.0, True), (53.4, 0, False), (0, -40.1, False), (-53.3, -40.0, True)],
)
def test_the_middle_third_is_a_sixth_to_each_side(u, v, centered):
    assert in_middle_third(159.5 + u, 119.5 + v, (320, 240)) is centered


def test_means_and_maxima_are_of_what_is_known():
    log = record(1, lambda time: None, health(0.01, 0.9, 0.05, Camera=10))
    log.add(LiveSnapshot(1.0, snapshot(1.0), health(0.03, 1.2)))
    log.add(LiveSnapshot(1.1, snapshot(1.1)))
    summary = summarize(log)
    assert summary.real_time_factor == pytest.approx((10 * 0.9 + 1.2) / 11)
    assert (summary.typical_lag, summary.largest_lag) == pytest.approx((0.01, 0.03))
    assert (summary.torso_tilt, summary.camera_rate) == pytest.approx((0.05, 10))
    assert summary.duration == pytest.approx(1.1)


def test_an_empty_log_has_a_summary():
    summary = summarize(RunLog())
    assert (summary.duration, summary.centered, summary.largest_lag, summary.cycles) == (0.0, {}, None, 0)


def test_errors_overruns_and_cycles_are_those_of_the_last_snapshot():
    log = record(1, lambda time: None)
    last = snapshot(1.0)
    last.automata = [replace(automaton, overruns=2, cycles=50) for automaton in last.automata]
    log.add(LiveSnapshot(1.0, last))
    summary = summarize(log)
    assert (summary.errors, summary.overruns, summary.cycles) == (0, 10, 250)


@pytest.mark.parametrize(("sent", "shown"), [(19, "19"), (20, "20 or more")])
def test_errors_of_which_a_component_sends_the_newest_alone_are_not_called_all(sent, shown):
    log = record(1, lambda time: None)
    last = snapshot(1.0)
    last.errors = [ErrorReport(1.0, 1, 1, "", "no such joint")] * sent
    log.add(LiveSnapshot(1.0, last))
    (errors,) = [figure for figure in figures_of(summarize(log)) if figure.name == "errors"]
    assert errors.value == shown


def test_the_table_of_a_run_ends_with_its_changes_of_state():
    log = record(12, lambda time: None)
    written = io.StringIO()
    table = summary_table(Automata(dance_and_follow()), log, figures_of(summarize(log)))
    Console(file=written, width=80).print(table)
    *_, green, dance = written.getvalue().rstrip().splitlines()
    assert green.strip() == "8.00 s    red → green"
    assert dance.strip() == "10.00 s  followBall → dance"
