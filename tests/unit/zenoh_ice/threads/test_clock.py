"""Clocks: the wall clock, and the manual one."""

from __future__ import annotations

import threading
import time

import pytest

from zenoh_ice.threads.clock import Clock, VirtualClock, WallClock


@pytest.mark.parametrize("clock", [WallClock(), VirtualClock()])
def test_clocks_fulfill_the_protocol(clock: Clock) -> None:
    assert isinstance(clock, Clock)
    assert clock.rate == 1.0


def test_wall_clock_waits_at_least_as_long_as_asked() -> None:
    clock = WallClock()
    start_time = clock.now()
    clock.sleep(0.02)
    clock.sleep(0.02)
    assert not clock.wait(threading.Event(), 0.01)
    assert clock.now() - start_time >= 0.05
    clock.sleep(-1.0)


def test_wall_clock_ends_a_wait_with_its_event() -> None:
    event = threading.Event()
    event.set()
    assert WallClock().wait(event, 60.0)


def test_virtual_clock_stands_still_until_it_is_advanced() -> None:
    clock = VirtualClock(5.0)
    assert clock.now() == 5.0
    time.sleep(0.005)
    assert clock.now() == 5.0
    clock.advance(0.25)
    assert clock.now() == 5.25
    with pytest.raises(ValueError, match="backwards"):
        clock.advance(-0.1)


def test_virtual_clock_does_not_drift() -> None:
    clock = VirtualClock()
    for _ in range(100_000):
        clock.advance(0.1)
    assert clock.now() == 10_000.0


def test_who_waits_on_a_virtual_clock_moves_it() -> None:
    clock = VirtualClock(5.0)
    clock.sleep(0.25)
    clock.sleep(0.75)
    event = threading.Event()
    assert not clock.wait(event, 1.0)
    event.set()
    assert clock.wait(event, 1.0)
    assert clock.now() == 7.0


def test_past_times_do_not_wait() -> None:
    clock = VirtualClock(10.0)
    clock.sleep(0.0)
    clock.sleep(-1.0)
    assert not clock.wait(threading.Event(), 0.0)
    assert clock.now() == 10.0


def test_a_virtual_clock_calls_what_is_due_on_its_way() -> None:
    clock = VirtualClock(5.0)
    times: list[float] = []
    end = clock.call_every(0.25, lambda: times.append(clock.now()))
    clock.advance(0.6)
    assert (times, clock.now()) == ([5.25, 5.5], 5.6)
    clock.sleep(0.15)
    assert times == [5.25, 5.5, 5.75]
    end()
    clock.advance(1.0)
    assert (times, clock.now()) == ([5.25, 5.5, 5.75], 6.75)


def test_calls_of_two_periods_follow_the_time() -> None:
    clock = VirtualClock()
    calls: list[str] = []
    clock.call_every(0.3, lambda: calls.append(f"slow {clock.now():g}"))
    clock.call_every(0.2, lambda: calls.append(f"fast {clock.now():g}"))
    clock.advance(0.6)
    assert calls == ["fast 0.2", "slow 0.3", "fast 0.4", "slow 0.6", "fast 0.6"]
