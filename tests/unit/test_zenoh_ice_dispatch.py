"""The pool of threads and the lanes on it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator

import pytest

from tests.support.limits import LIMIT
from zenoh_ice import BusyException, ObjectNotExistException
from zenoh_ice.dispatch import Dispatcher, Lane


@pytest.fixture
def dispatcher() -> Iterator[Dispatcher]:
    dispatcher = Dispatcher(4, "pool")
    yield dispatcher
    assert dispatcher.close(LIMIT)


def test_jobs_run_at_once_up_to_the_limit(dispatcher: Dispatcher) -> None:
    together = threading.Barrier(5)
    for _ in range(4):
        dispatcher.submit(lambda: together.wait(LIMIT))
    together.wait(LIMIT)
    assert sum(thread.name.startswith("pool") for thread in threading.enumerate()) <= 4


def test_pool_grows_while_its_threads_wait_for_each_other(dispatcher: Dispatcher) -> None:
    done = threading.Event()

    def nest(depth: int) -> None:
        if depth == 0:
            done.set()
            return
        inner = threading.Event()
        dispatcher.submit(lambda: (nest(depth - 1), inner.set()))  # type: ignore[func-returns-value]
        with dispatcher.blocked():
            inner.wait(LIMIT)

    dispatcher.submit(lambda: nest(10))
    assert done.wait(LIMIT)


@pytest.mark.parametrize("error", [RuntimeError("job"), SystemExit(1)])
def test_failing_job_is_logged_and_ends_no_thread(
    dispatcher: Dispatcher, caplog: pytest.LogCaptureFixture, error: BaseException
) -> None:
    def fail() -> None:
        raise error

    done = threading.Event()
    with caplog.at_level(logging.ERROR, "zenoh_ice"):
        for _ in range(10):
            dispatcher.submit(fail)
        dispatcher.submit(done.set)
        assert done.wait(LIMIT)
    assert type(error).__name__ in caplog.text


def test_close_runs_what_was_submitted_and_may_come_from_a_job() -> None:
    dispatcher = Dispatcher(2, "pool")
    closed = threading.Event()
    order: list[int] = []

    def close() -> None:
        order.append(1)
        dispatcher.close(LIMIT)
        closed.set()

    dispatcher.submit(close)
    dispatcher.submit(lambda: order.append(2))
    assert closed.wait(LIMIT)
    assert order == [1, 2]


def test_close_tells_of_threads_that_stay(caplog: pytest.LogCaptureFixture) -> None:
    dispatcher = Dispatcher(1, "pool")
    entered, leave = threading.Event(), threading.Event()
    dispatcher.submit(lambda: (entered.set(), leave.wait(LIMIT)))  # type: ignore[func-returns-value]
    assert entered.wait(LIMIT)
    assert not dispatcher.close(0.01)
    assert "pool-1 still busy" in caplog.text
    leave.set()


def test_lane_keeps_the_order_one_at_a_time(dispatcher: Dispatcher) -> None:
    lane = Lane(dispatcher, "servant", depth=200)
    order: list[int] = []
    for number in range(100):
        lane.submit(lambda number=number: order.append(number))  # type: ignore[misc]
    assert lane.close(LIMIT)
    assert order == list(range(100))


def test_busy_lane_leaves_the_pool_to_others(dispatcher: Dispatcher) -> None:
    busy, other = Lane(dispatcher, "busy"), Lane(dispatcher, "other")
    leave, done = threading.Event(), threading.Event()
    for _ in range(20):
        busy.submit(lambda: leave.wait(LIMIT))
    other.submit(done.set)
    assert done.wait(LIMIT)
    leave.set()
    assert busy.close(LIMIT)


def test_full_lane_refuses(dispatcher: Dispatcher) -> None:
    lane = Lane(dispatcher, "servant", depth=2)
    leave = threading.Event()
    for _ in range(3):
        lane.submit(lambda: leave.wait(LIMIT))
    with pytest.raises(BusyException, match="servant: 2 calls wait already"):
        lane.submit(leave.set)
    leave.set()
    assert lane.close(LIMIT)


def test_closed_lane_refuses(dispatcher: Dispatcher) -> None:
    lane = Lane(dispatcher, "servant")
    assert lane.close(0)
    with pytest.raises(ObjectNotExistException, match="servant"):
        lane.submit(lambda: None)
