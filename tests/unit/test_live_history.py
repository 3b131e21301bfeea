"""The history of a run: moments to scrub back to, changes, numbers over time, all of it bounded."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.component import snapshot
from visualhfsm.live.history import History
from visualhfsm.live.series import SeriesTable
from visualhfsm.live.values import LiveSnapshot, RobotState, is_sound, numbers_of
from visualhfsm.watch import state_log


def live(time: float) -> LiveSnapshot:
    return LiveSnapshot(1e9 + time, snapshot(time), RobotState(joints={"HeadYaw": 0.1}))


def history(until: float, **options: float) -> History:
    made = History(**options)  # type: ignore[arg-type]
    for tenth in range(round(until * 10) + 1):
        made.add(live(tenth / 10))
    return made


def time_at(made: History, time: float) -> float:
    raw = made.at(time)
    assert raw is not None
    return msgspec.json.decode(raw, type=LiveSnapshot).component.time


def test_each_moment_can_be_returned_to() -> None:
    made = history(12)
    assert time_at(made, 3.0) == 3.0
    assert time_at(made, 3.09) == 3.0
    assert time_at(made, -5) == 0.0
    assert time_at(made, math.inf) == 12.0


def test_nothing_is_there_before_the_first_moment() -> None:
    made = History()
    assert made.at(0) is None
    assert made.timeline().changes == []


def test_changes_and_spans_are_told() -> None:
    timeline = history(12).timeline()
    assert (timeline.start, timeline.end) == (0.0, 12.0)
    assert (10.0, 1, 1, 2, 1) in timeline.changes
    assert (1, 1, False, 0.0, 10.0) in timeline.spans


def test_old_moments_go_when_memory_is_full() -> None:
    made = history(20, largest=20_000)
    timeline = made.timeline()
    assert timeline.start > 0
    assert time_at(made, 0) == timeline.start
    assert all(change[0] >= timeline.start for change in timeline.changes)
    assert time_at(made, 20) == 20


def test_moments_closer_than_the_interval_are_left_out_unless_a_state_changes() -> None:
    made = History(interval=3.0)
    for hundredth in range(0, 1250, 5):
        made.add(live(hundredth / 100))
    assert [time_at(made, time) for time in (2.9, 3.1, 7.9)] == [0.0, 3.0, 6.0]
    assert [time_at(made, time) for time in (8.1, 9.9, 10.1)] == [8.0, 8.0, 10.0]  # states changed at both


def test_a_component_that_is_paused_adds_nothing() -> None:
    made = history(1)
    before = made.timeline()
    made.add(live(1.0))
    assert made.timeline() == before


def test_all_numbers_can_be_plotted() -> None:
    numbers = numbers_of(live(9.5))
    assert numbers["4.error_u"] == 12.5
    assert numbers["4.ball_seen"] == 1.0
    assert numbers["4:lastCycle"] == 0.001
    assert numbers["joint.HeadYaw"] == 0.1
    read = history(5).series(["joint.HeadYaw", "4.error_u", "nothing"], 1, 2, 100)
    assert read["times"] == pytest.approx(np.arange(1, 2.05, 0.1))
    assert set(read["values"]) == {"joint.HeadYaw", "4.error_u"}


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
    ],
    ids=["no number", "infinite", "beyond all time", "negative", "no start", "too many automata"],
)
def test_a_snapshot_of_no_run_is_none(changed: dict[str, Any]) -> None:
    sound = snapshot(1.0)
    assert is_sound(sound)
    assert not is_sound(msgspec.structs.replace(sound, **changed))


def test_automata_that_are_gone_are_forgotten_when_there_are_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(state_log, "_MOST_AUTOMATA", 100)
    log = state_log.StateLog()
    for number in range(1, 500):
        one = snapshot(float(number))
        one.automata = [msgspec.structs.replace(one.automata[0], id=number)]
        log.add(one)
    assert len(log._last) <= 101
    assert len(log._open) <= 101
