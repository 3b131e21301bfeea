"""The estimate of another clock's time between its samples."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.waiting import at_once, until
from zenoh_ice import Clock, CommunicatorDestroyedException, MarshalException, RobotClock
from zenoh_ice.threads import clock as module


class Wall:
    """Steady wall time that a test moves."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def wall(monkeypatch: pytest.MonkeyPatch) -> Wall:
    wall = Wall()
    monkeypatch.setattr(module, "time", wall)
    return wall


def test_it_is_a_clock() -> None:
    clock = RobotClock(7.0, 5.0, simulated=True)
    assert isinstance(clock, Clock)
    assert clock.rate == 5.0
    assert clock.simulated


def test_time_runs_on_between_samples_at_their_rate(wall: Wall) -> None:
    clock = RobotClock(10.0, 5.0, simulated=True)
    wall.now += 0.1
    assert clock.now() == pytest.approx(10.5)
    clock.update(10.6, 2.0, simulated=True)
    assert clock.now() == pytest.approx(10.6)
    wall.now += 0.5
    assert clock.now() == pytest.approx(11.6)
    clock.update(11.6, 0.0, simulated=True)
    wall.now += 5.0
    assert clock.now() == pytest.approx(11.6)


def test_an_estimate_that_was_ahead_waits_and_does_not_go_back(wall: Wall) -> None:
    clock = RobotClock(10.0, 1.0, simulated=True)
    wall.now += 1.0
    assert clock.now() == pytest.approx(11.0)
    clock.update(10.5, 1.0, simulated=True)
    assert clock.now() == pytest.approx(11.0)
    wall.now += 0.4
    assert clock.now() == pytest.approx(11.0)
    wall.now += 0.2
    assert clock.now() == pytest.approx(11.1)


def test_a_restarted_simulation_is_followed_back(wall: Wall, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    clock = RobotClock(100.0, 1.0, simulated=True)
    wall.now += 1.0
    clock.update(0.02, 1.0, simulated=True)
    assert clock.now() == pytest.approx(0.02)
    assert "the robot's clock restarted" in caplog.text


samples = st.lists(st.tuples(st.floats(0, 2), st.floats(-0.09, 3), st.floats(0, 20)), max_size=30)


@given(samples)
def test_it_never_runs_backwards_unless_the_simulation_restarts(
    steps: list[tuple[float, float, float]],
) -> None:
    wall = Wall()
    with mock.patch.object(module, "time", wall):
        clock = RobotClock(0.0, 1.0, simulated=True)
        robot, seen = 0.0, [clock.now()]
        for passed, advance, rate in steps:
            wall.now += passed
            seen.append(clock.now())
            robot += advance
            clock.update(robot, rate, simulated=True)
            seen.append(clock.now())
    assert seen == sorted(seen)
    assert seen[-1] >= robot


BAD_READINGS = [
    (math.nan, 1.0),
    (math.inf, 1.0),
    (1e308, 1.0),
    (-1.0, 1.0),
    (1.0, math.nan),
    (1.0, math.inf),
    (1.0, 1e308),
    (1.0, -1.0),
]


@pytest.mark.parametrize(("time_", "rate"), BAD_READINGS)
def test_samples_that_no_clock_can_show_are_dropped_and_reported_once(
    wall: Wall, caplog: pytest.LogCaptureFixture, time_: float, rate: float
) -> None:
    clock = RobotClock(10.0, 2.0, simulated=True)
    for _ in range(3):
        clock.update(time_, rate, simulated=True)
    wall.now += 0.5
    assert (clock.now(), clock.rate) == (11.0, 2.0)
    assert caplog.text.count("dropped samples") == 1
    clock.update(11.0, 2.0, simulated=True)
    clock.update(time_, rate, simulated=True)
    assert caplog.text.count("dropped samples") == 2


@pytest.mark.parametrize(("time_", "rate"), BAD_READINGS)
def test_it_does_not_begin_with_what_no_clock_can_show(time_: float, rate: float) -> None:
    with pytest.raises(MarshalException, match="the robot's clock"):
        RobotClock(time_, rate, simulated=True)


def test_silence_is_reported_once_and_so_is_its_end(wall: Wall, caplog: pytest.LogCaptureFixture) -> None:
    clock = RobotClock(10.0, 2.0, simulated=True)
    wall.now += 0.9
    clock.now()
    assert caplog.messages == []
    for _ in range(3):
        wall.now += 0.5
        clock.now()
    assert clock.now() == pytest.approx(10.0 + 2.0 * 2.4)
    clock.update(15.0, 2.0, simulated=True)
    assert caplog.messages == [
        "no sample of the robot's clock for 1.4 s; continuing at its last rate, 2",
        "samples of the robot's clock arrive again",
    ]


def test_a_clock_that_is_set_by_hand_changes_its_pace_without_a_jump_and_misses_no_samples(
    wall: Wall, caplog: pytest.LogCaptureFixture
) -> None:
    clock = RobotClock(0.0, 0.0, simulated=True, silence=math.inf)
    wall.now += 5.0
    assert clock.now() == 0.0
    clock.update(5.0, 1000.0, simulated=True)
    assert clock.now() == 5.0
    wall.now += 5.0
    assert clock.now() == pytest.approx(5005.0)
    clock.update(clock.now(), 0.0, simulated=True)
    wall.now += 5.0
    assert clock.now() == pytest.approx(5005.0)
    assert caplog.messages == []


def asleep(function: Callable[[], object]) -> tuple[threading.Thread, list[object]]:
    """Run a function in a thread; return the thread and, once it has ended, what happened."""
    outcome: list[object] = []

    def run() -> None:
        try:
            outcome.append(function())
        except CommunicatorDestroyedException as error:
            outcome.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread, outcome


def join(thread: threading.Thread) -> None:
    thread.join(EVENT_LIMIT)
    assert not thread.is_alive()


@pytest.mark.slow
@at_once
def test_sleeps_scale_with_the_rate() -> None:
    slow = RobotClock(0.0, 0.1, simulated=True)
    slow.sleep(0.02)
    assert slow.now() >= 0.02  # one that slept in wall time would wake at 0.002 s
    slow.sleep(0.01)
    assert not slow.wait(threading.Event(), 0.01)
    assert slow.now() >= 0.04
    slow.sleep(-1.0)
    fast = RobotClock(0.0, 1e4, simulated=True)
    fast.sleep(FOREVER)


def test_an_event_ends_a_wait() -> None:
    clock = RobotClock(0.0, 1.0, simulated=True)
    event = threading.Event()
    thread, outcome = asleep(lambda: clock.wait(event, 60.0))
    event.set()
    join(thread)
    assert outcome == [True]


def test_a_change_of_rate_reaches_sleepers() -> None:
    clock = RobotClock(0.0, 0.0, simulated=True)
    event = threading.Event()
    sleepers = [asleep(lambda: clock.sleep(30.0)), asleep(lambda: clock.wait(event, 30.0))]
    clock.update(0.0, 1000.0, simulated=True)
    for thread, _ in sleepers:
        join(thread)
    assert clock.now() >= 30.0


@pytest.mark.parametrize("jump", [-10.0, 100.0], ids=["back", "ahead"])
def test_a_jump_wakes_sleepers(jump: float) -> None:
    clock = RobotClock(1000.0, 1.0, simulated=True)
    event = threading.Event()
    sleepers = [asleep(lambda: clock.sleep(60.0)), asleep(lambda: clock.wait(event, 60.0))]

    def awake() -> bool:
        clock.update(clock.now() + jump, 1.0, simulated=True)  # again, until both have begun to wait
        return all(outcome for _, outcome in sleepers)

    until(awake)
    for thread, _ in sleepers:
        join(thread)
    assert [outcome for _, outcome in sleepers] == [[None], [False]]


def test_closing_lets_sleepers_go() -> None:
    clock = RobotClock(0.0, 0.0, simulated=True)
    event = threading.Event()
    sleepers = [asleep(lambda: clock.sleep(60.0)), asleep(lambda: clock.wait(event, 60.0))]
    clock.close()
    for thread, outcome in sleepers:
        join(thread)
        assert isinstance(outcome[0], CommunicatorDestroyedException)
    assert clock.now() == 0.0
