"""The log of a run: moments to scrub back to, changes, values over time, all of it bounded."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsm_runtime.recording_file.messages import Fault
from tests.support.component import ball_mark, dance_and_follow, snapshot
from visualhfsm._monitor.realm.automata import Automata, StateLog, number_in
from visualhfsm._monitor.realm.robot import RobotState
from visualhfsm._monitor.realm.run_log import (
    LiveSnapshot,
    RunLog,
    SeriesTable,
    is_sound,
    numbers_of,
)

AUTOMATA = Automata(dance_and_follow())


def live(time: float) -> LiveSnapshot:
    return LiveSnapshot(1e9 + time, snapshot(time), RobotState(joints={"HeadYaw": 0.1}))


def log_of(until: float, **options: float) -> RunLog:
    made = RunLog(**options)  # type: ignore[arg-type]
    for tenth in range(round(until * 10) + 1):
        made.add(live(tenth / 10))
    return made


def time_at(made: RunLog, time: float) -> float:
    raw = made.at(time)
    assert raw is not None
    return msgspec.json.decode(raw, type=LiveSnapshot).component.time


def test_each_moment_can_be_returned_to() -> None:
    made = log_of(12)
    assert time_at(made, 3.0) == 3.0
    assert time_at(made, 3.09) == 3.0
    assert time_at(made, -5) == 0.0
    assert time_at(made, math.inf) == 12.0


def test_a_failure_shorter_than_the_time_between_two_moments_is_kept() -> None:
    made, stuck = RunLog(), (Fault("LKneePitch", "stuck"),)
    for time in (1.0, 1.01, 1.02, 1.03):
        failing = stuck if time == 1.01 else ()
        made.add(LiveSnapshot(time, snapshot(time), RobotState(failing=failing)))
    assert [(span.faults, span.start, span.end) for span in made.timeline().failures] == [(stuck, 1.01, 1.02)]
    raw = made.at(1.015)
    assert raw is not None
    assert msgspec.json.decode(raw, type=LiveSnapshot).robot.failing == stuck


def test_nothing_is_there_before_the_first_moment() -> None:
    made = RunLog()
    assert made.at(0) is None
    assert made.timeline().changes == []


def test_changes_and_spans_are_reported() -> None:
    timeline = log_of(12).timeline()
    assert (timeline.start, timeline.end) == (0.0, 12.0)
    assert (10.0, 1, 1, 2, 1) in timeline.changes
    assert (1, 1, False, 0.0, 10.0) in timeline.spans


def test_old_moments_go_when_memory_is_full() -> None:
    made = log_of(20, largest=20_000)
    timeline = made.timeline()
    assert timeline.start > 0
    assert time_at(made, 0) == timeline.start
    assert all(change[0] >= timeline.start for change in timeline.changes)
    assert time_at(made, 20) == 20


def test_moments_closer_than_the_interval_are_left_out_unless_a_state_changes() -> None:
    made = RunLog(interval=3.0)
    for hundredth in range(0, 1250, 5):
        made.add(live(hundredth / 100))
    assert [time_at(made, time) for time in (2.9, 3.1, 7.9)] == [0.0, 3.0, 6.0]
    assert [time_at(made, time) for time in (8.1, 9.9, 10.1)] == [8.0, 8.0, 10.0]  # states changed at both


def test_a_component_that_is_paused_adds_nothing() -> None:
    made = log_of(1)
    before = made.timeline()
    made.add(live(1.0))
    assert made.timeline() == before


def test_all_numbers_can_be_plotted() -> None:
    numbers = numbers_of(live(9.5))
    assert numbers["4.error"] == 12.5
    assert numbers["4.seen"] == 1.0
    assert numbers["4:lastCycle"] == 0.001
    assert numbers["joint.HeadYaw"] == 0.1
    read = log_of(5).series(["joint.HeadYaw", "4.error", "nothing"], 1, 2, 100)
    assert read["times"] == pytest.approx(np.arange(1, 2.05, 0.1))
    assert set(read["values"]) == {"joint.HeadYaw", "4.error"}


def test_a_series_keeps_its_peaks_when_it_is_thinned() -> None:
    table = SeriesTable()
    for row in range(5000):
        table.add(row, {"peak": 100.0 if row == 1234 else math.sin(row)})
    times, values = table.read(["peak"], 0, 5000, 100)
    assert len(times) <= 104
    assert times[values["peak"].index(100.0)] == 1234


def test_a_number_that_comes_later_is_missing_before() -> None:
    table = SeriesTable()
    table.add(0, {"a": 1})
    table.add(1, {"b": 2})
    assert table.read(["a", "b"], 0, 1, 10) == ([0, 1], {"a": [1, None], "b": [None, 2]})


@given(st.integers(1, 40), st.lists(st.floats(0, 10), max_size=100))
def test_the_ring_holds_the_newest_rows(capacity: int, steps: list[float]) -> None:
    table = SeriesTable(capacity)
    times = np.cumsum(steps) if steps else np.zeros(0)
    for number, time in enumerate(times):
        table.add(float(time), {"n": number})
    read, values = table.read(["n"], -1, math.inf, 1000)
    first = max(0, len(times) - capacity)
    assert read == times[first:].tolist()
    assert values.get("n", []) == list(range(first, len(times)))


@pytest.mark.parametrize(
    "changed",
    [
        {"time": math.nan},
        {"time": math.inf},
        {"time": 1e17},
        {"time": -1.0},
        {"startedAt": math.nan},
        {"automata": list(snapshot(0.0).automata) * 10_000},
        {"automata": [msgspec.structs.replace(snapshot(0.0).automata[0], enteredAt=math.inf)]},
        {"marks": [ball_mark(0, 0)] * 200},
        {"marks": [ball_mark(0, math.nan)]},
        {"marks": [ball_mark(0, 0, "x" * 100)]},
        {"joints": {"HeadYaw": math.nan}},
        {"joints": dict.fromkeys(map(str, range(200)), 0.0)},
        {"speed": math.inf},
    ],
    ids=[
        "no number",
        "infinite",
        "beyond all time",
        "negative",
        "no start",
        "too many automata",
        "entered never",
        "too many marks",
        "a mark nowhere",
        "a long label",
        "a joint nowhere",
        "too many joints",
        "endlessly fast",
    ],
)
def test_a_snapshot_of_no_run_is_none(changed: dict[str, Any]) -> None:
    sound = snapshot(1.0)
    assert is_sound(sound)
    assert not is_sound(msgspec.structs.replace(sound, **changed))


def test_automata_that_are_gone_are_forgotten_when_there_are_many() -> None:
    log = StateLog(100)
    for number in range(1, 500):
        one = snapshot(float(number))
        one.automata = [msgspec.structs.replace(one.automata[0], id=number)]
        log.add(one)
    assert len(log._last) <= 101
    assert len(log._open) <= 101


def test_changes_of_state_have_the_time_at_which_the_state_was_entered() -> None:
    changes = log_of(26.9).changes()
    names = [(c.time, AUTOMATA.state_name(c.automaton, c.destination)) for c in changes]
    assert names == [(8.0, "green"), (10.0, "dance"), (20.0, "followBall"), (26.0, "red")]


def test_a_change_that_two_snapshots_show_only_by_its_time_is_noted() -> None:
    log = log_of(0.9)
    again = snapshot(1.2)
    again.automata[0].enteredAt, again.automata[0].lastTransition = 1.1, 3
    log.add(LiveSnapshot(1.2, again))
    assert [(change.time, change.origin, change.destination) for change in log.changes()] == [(1.1, 1, 1)]


def test_spans_join_without_a_gap_and_distinguish_ghosts() -> None:
    spans = [span for span in log_of(26.9).timeline().spans if span[0] == 2]
    seen = [(AUTOMATA.state_name(2, state), ghost, start, end) for _, state, ghost, start, end in spans]
    assert seen == [
        ("red", False, 0.0, 8.0), ("green", False, 8.0, 10.0), ("green", True, 10.0, 20.0),
        ("green", False, 20.0, 26.0), ("red", False, 26.0, pytest.approx(26.9)),
    ]  # fmt: skip


def test_a_log_that_begins_late_starts_where_it_begins() -> None:
    log = RunLog()
    for tenth in range(120, 130):
        log.add(live(tenth / 10))
    assert log.duration == pytest.approx(0.9)
    assert min(start for _, _, _, start, _ in log.timeline().spans) == 12.0
    assert not log.changes()


def test_the_first_entry_of_an_automaton_that_was_a_ghost_is_no_change() -> None:
    log = log_of(0.9)
    first = snapshot(1.2)
    first.automata[4].enteredAt = 1.1
    log.add(LiveSnapshot(1.2, first))
    assert not log.changes()


@pytest.mark.parametrize(("text", "number"), [("np.float64(1.5)", 1.5), ("-2", -2.0), ("1e3", 1000.0)])
def test_numbers_are_read_as_python_shows_them(text: str, number: float) -> None:
    assert number_in(text) == number


@pytest.mark.parametrize("text", ["nan", "inf", "None", "", "np.float64(", "__import__('os')"])
def test_what_is_no_number_is_none(text: str) -> None:
    assert number_in(text) is None


def test_a_snapshot_with_an_unknown_automaton_is_of_other_automata() -> None:
    other = snapshot(6.0)
    assert AUTOMATA.fit(other)
    other.automata[4].id = 9
    assert not AUTOMATA.fit(other)


def test_a_snapshot_of_another_generation_is_of_other_automata() -> None:
    assert not AUTOMATA.fit(msgspec.structs.replace(snapshot(6.0), generation=1))


def test_moments_are_fewer_when_all_would_be_too_large() -> None:
    log = log_of(20.0)
    every = log.moments(1 << 30)
    assert [time for time, _ in every] == pytest.approx([tenth / 10 for tenth in range(201)])
    assert all(msgspec.json.decode(moment)["component"]["time"] == time for time, moment in every)
    size = sum(len(moment) for _, moment in every)
    fewer = log.moments(size // 4)
    assert sum(len(moment) for _, moment in fewer) <= 1.1 * size / 4
    assert len(fewer) >= 40
    assert fewer[-1] == every[-1]
    assert RunLog().moments(1 << 30) == []
