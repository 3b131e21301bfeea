"""The recording of a run: balls, changes of state, spans, and which snapshots belong to it."""

import pytest

from interfaces.hfsm import ComponentSnapshot
from tests.support.component import ball_variables, dance_and_follow, snapshot
from visualhfsm.watch.automata import Automata
from visualhfsm.watch.recording import Ball, Recording, RobotReading, read_ball


@pytest.fixture
def automata():
    return Automata(dance_and_follow())


def ball_of(automata: Automata, seen: ComponentSnapshot) -> Ball:
    ball = read_ball(automata, seen)
    assert ball is not None
    return ball


def record(automata: Automata, until: float, beginning: float = 0.0) -> Recording:
    recording = Recording(automata)
    for tenth in range(round(beginning * 10), round(until * 10)):
        recording.add(snapshot(tenth / 10), RobotReading(pan=0.1))
    return recording


def test_the_ball_is_that_of_the_automaton_that_runs(automata):
    ball = ball_of(automata, snapshot(9.5, ball_variables(-7.5, 2.0)))
    assert (ball.name, ball.error_u, ball.error_v, ball.seen, ball.following_since) == (
        "green",
        -7.5,
        2,
        True,
        8,
    )


def test_a_ghost_has_no_ball(automata):
    assert read_ball(automata, snapshot(12.0)) is None


def test_a_ball_out_of_sight_is_not_seen(automata):
    assert not ball_of(automata, snapshot(1.0, ball_variables(0.0, 0.0, seen=False))).seen


@pytest.mark.parametrize(("text", "number"), [("np.float64(1.5)", 1.5), ("-2", -2.0), ("1e3", 1000.0)])
def test_numbers_are_read_as_python_shows_them(automata, text, number):
    assert ball_of(automata, snapshot(1.0, {**ball_variables(0, 0), "error_u": text})).error_u == number


@pytest.mark.parametrize("text", ["nan", "inf", "None", "", "np.float64(", "__import__('os')"])
def test_what_is_no_number_is_no_ball(automata, text):
    assert read_ball(automata, snapshot(1.0, {**ball_variables(0, 0), "error_u": text})) is None


def test_changes_of_state_have_the_time_at_which_the_state_was_entered(automata):
    changes = record(automata, 27).changes
    names = [(c.time, automata.state_name(c.automaton, c.destination)) for c in changes]
    assert names == [(8.0, "green"), (10.0, "dance"), (20.0, "followBall"), (26.0, "red")]


def test_a_change_that_two_snapshots_show_only_by_its_time_is_noted(automata):
    recording = record(automata, 1)
    again = snapshot(1.2)
    again.automata[0].enteredAt, again.automata[0].lastTransition = 1.1, 3
    recording.add(again, RobotReading())
    assert [(change.time, change.origin, change.destination) for change in recording.changes] == [(1.1, 1, 1)]


def test_spans_join_without_a_gap_and_tell_ghosts(automata):
    spans = [span for span in record(automata, 27).spans if span.automaton == 2]
    seen = [(automata.state_name(2, span.state), span.ghost, span.start, span.end) for span in spans]
    assert seen == [
        ("red", False, 0.0, 8.0), ("green", False, 8.0, 10.0), ("green", True, 10.0, 20.0),
        ("green", False, 20.0, 26.0), ("red", False, 26.0, pytest.approx(26.9)),
    ]  # fmt: skip


def test_a_snapshot_from_before_belongs_to_another_run(automata):
    recording = record(automata, 5)
    assert recording.follows(snapshot(5.0))
    assert not recording.follows(snapshot(0.1))


def test_a_snapshot_with_an_unknown_automaton_belongs_to_another_component(automata):
    recording = record(automata, 5)
    other = snapshot(6.0)
    other.automata[4].id = 9
    assert not recording.follows(other)


def test_a_recording_that_begins_late_starts_where_it_begins(automata):
    recording = record(automata, 13, beginning=12)
    assert recording.duration == pytest.approx(0.9)
    assert min(span.start for span in recording.spans) == 12.0
    assert not recording.changes


def test_the_first_entry_of_an_automaton_that_was_a_ghost_is_no_change(automata):
    recording = record(automata, 1)
    first = snapshot(1.2)
    first.automata[4].enteredAt = 1.1
    recording.add(first, RobotReading())
    assert not recording.changes


def test_a_component_that_is_paused_adds_no_rows(automata):
    recording = record(automata, 1)
    for _ in range(3):
        recording.add(snapshot(1.0), RobotReading())
    assert len(recording.rows) == 11


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_a_time_that_is_no_number_does_not_belong_to_a_run(automata, number):
    recording = record(automata, 1)
    late = snapshot(1.0)
    late.time = number
    assert not recording.follows(late)
    late = snapshot(1.0)
    late.automata[0].enteredAt = number
    assert not recording.follows(late)
