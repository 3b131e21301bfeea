"""The clock of tested behaviors runs what is due, in one thread."""

from __future__ import annotations

import threading

import pytest

from hfsm_runtime.virtual.clock import PacedClock, TaskClock
from tests.support.limits import EVENT_LIMIT, FOREVER
from zenoh_ice import CommunicatorDestroyedException


@pytest.fixture
def clock() -> TaskClock:
    return TaskClock()


def test_tasks_run_at_their_times_in_their_order(clock: TaskClock) -> None:
    seen: list[tuple[str, float]] = []
    for name, when in (("late", 2.0), ("first", 1.0), ("second", 1.0), ("too late", 3.1)):
        clock.call_at(when, lambda name=name: seen.append((name, clock.now())))  # type: ignore[misc]
    clock.advance(3.0)
    assert seen == [("first", 1.0), ("second", 1.0), ("late", 2.0)]
    assert clock.now() == 3.0


def test_what_is_called_at_regular_times_comes_before_the_tasks_of_the_time(clock: TaskClock) -> None:
    seen: list[str] = []
    clock.call_at(1.0, lambda: seen.append("task"))
    clock.call_every(1.0, lambda: seen.append("tick"))
    clock.advance(1.0)
    assert seen == ["tick", "task"]


def test_a_task_at_the_end_of_the_move_belongs_to_it(clock: TaskClock) -> None:
    seen: list[float] = []
    clock.call_at(0.3, lambda: seen.append(clock.now()))
    clock.advance(0.1)
    clock.advance(0.2)
    assert seen == [0.3]


def test_a_task_may_give_further_tasks(clock: TaskClock) -> None:
    seen: list[float] = []

    def tick() -> None:
        seen.append(clock.now())
        clock.call_at(clock.now() + 0.1, tick)

    clock.call_at(0.1, tick)
    clock.advance(0.35)
    assert seen == pytest.approx([0.1, 0.2, 0.3])


def test_a_task_that_sleeps_moves_the_time_beyond_the_end(clock: TaskClock) -> None:
    clock.call_at(1.0, lambda: clock.sleep(5.0))
    clock.advance(2.0)
    assert clock.now() == 6.0


def test_who_waits_for_an_event_wakes_when_a_task_sets_it(clock: TaskClock) -> None:
    event = threading.Event()
    clock.call_at(0.5, event.set)
    assert clock.wait(event, 2.0)
    assert clock.now() == pytest.approx(0.5, abs=0.011)
    assert not clock.wait(threading.Event(), 1.0)
    assert clock.now() == pytest.approx(1.5, abs=0.011)


def test_the_time_never_runs_backwards(clock: TaskClock) -> None:
    with pytest.raises(ValueError, match="backwards"):
        clock.advance(-1.0)
    clock.sleep(-1.0)
    assert clock.now() == 0.0


def test_who_waits_by_a_paced_clock_that_hangs_looks_seldom_and_ends_with_it() -> None:
    clock = PacedClock()
    driving, released, ended = threading.Event(), threading.Event(), threading.Event()
    looks = 0

    def drive() -> None:
        clock.drive()
        driving.set()
        released.wait(FOREVER)

    def look() -> bool:
        nonlocal looks
        looks += 1
        return False

    def wait() -> None:
        with pytest.raises(CommunicatorDestroyedException):
            clock.wait_for(look, 1.0)
        ended.set()

    driver, waiter = threading.Thread(target=drive), threading.Thread(target=wait, daemon=True)
    driver.start()
    assert driving.wait(EVENT_LIMIT)
    clock.call_at(0.0, lambda: None)  # overdue while the code of the driver hangs
    waiter.start()
    try:
        assert not ended.wait(0.1)
        clock.end()
        assert ended.wait(EVENT_LIMIT)
        assert looks == 1
    finally:
        released.set()
        driver.join(EVENT_LIMIT)
