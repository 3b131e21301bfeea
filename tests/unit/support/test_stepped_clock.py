"""The clock that wakes the threads of a test one at a time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial

import pytest

from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.stepped_clock import ClockStalledException, SteppedClock


def start(function: Callable[[], object], name: str | None = None) -> threading.Thread:
    thread = threading.Thread(target=function, name=name, daemon=True)
    thread.start()
    return thread


def join(*threads: threading.Thread) -> None:
    for thread in threads:
        thread.join(EVENT_LIMIT)
        assert not thread.is_alive()


def test_it_stands_still_until_it_is_advanced() -> None:
    clock = SteppedClock(5.0)
    assert clock.now() == 5.0
    time.sleep(0.005)
    assert clock.now() == 5.0
    clock.advance(0.25)
    assert clock.now() == 5.25
    with pytest.raises(ValueError, match="backwards"):
        clock.advance(-0.1)


@pytest.mark.slow
def test_it_does_not_drift() -> None:
    clock = SteppedClock()
    for _ in range(100_000):
        clock.advance(0.1)
    assert clock.now() == 10_000.0


def test_it_wakes_sleepers_in_order_of_time() -> None:
    clock = SteppedClock()
    log = []

    def tick(name: str, period: float, count: int) -> None:
        for _ in range(count):
            clock.sleep(period)
            log.append((name, clock.now()))

    threads: list[threading.Thread] = []
    for number, (name, period, count) in enumerate([("a", 0.3, 2), ("b", 0.2, 3), ("c", 0.2, 1)], start=1):
        threads.append(start(partial(tick, name, period, count)))
        clock.wait_for_waiters(number)
    clock.advance(1.0)
    join(*threads)
    # At 0.6 s "a" comes first: it began to wait at 0.3 s, "b" at 0.4 s.
    assert log == [("b", 0.2), ("c", 0.2), ("a", 0.3), ("b", 0.4), ("a", 0.6), ("b", 0.6)]
    assert clock.now() == 1.0
    assert clock.waiting == 0


def test_it_wakes_a_waiter_by_event_or_by_time() -> None:
    clock = SteppedClock()
    event = threading.Event()
    results = []
    thread = start(lambda: results.append((clock.wait(event, 1.0), clock.now())))
    clock.wait_for_waiters(1)
    clock.advance(1.0)
    join(thread)
    thread = start(lambda: results.append((clock.wait(event, 1.0), clock.now())))
    clock.wait_for_waiters(1)
    clock.advance(0.5)
    event.set()
    join(thread)
    assert results == [(False, 1.0), (True, 1.5)]
    assert clock.wait(event, 1.0)


def test_a_sleeper_that_nobody_wakes_is_reported() -> None:
    with pytest.raises(ClockStalledException, match="nobody advanced"):
        SteppedClock(limit=0.02).sleep(1.0)


def test_a_woken_thread_that_hangs_is_named() -> None:
    clock = SteppedClock(limit=EVENT_LIMIT)
    release = threading.Event()

    def hang() -> None:
        clock.sleep(1.0)
        release.wait(FOREVER)

    thread = start(hang, name="culprit")
    clock.wait_for_waiters(1)
    clock.limit = 0.05
    with pytest.raises(ClockStalledException, match="'culprit'"):
        clock.advance(2.0)
    release.set()
    join(thread)


def test_past_times_do_not_wait() -> None:
    clock = SteppedClock(10.0)
    clock.sleep(0.0)
    clock.sleep(-1.0)
    assert not clock.wait(threading.Event(), 0.0)
