"""Callbacks run on the node's threads, one after another for each line."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import partial

import pytest

from tests.support.limits import EVENT_LIMIT
from zenoh_ice.objects import callbacks
from zenoh_ice.threads.pool import Pool
from zenoh_ros2 import RosError
from zenoh_ros2._workers import Job, Line, make_pool


def line_of(pool: Pool, most: int) -> Line[Job]:
    return Line("/topic", pool, most, lambda job: job())


def hold(held: threading.Event, free: threading.Event) -> None:
    held.set()
    free.wait(EVENT_LIMIT)


@pytest.fixture
def pool() -> Iterator[Pool]:
    made = make_pool(2, "test")
    yield made
    assert made.close(EVENT_LIMIT)


def test_a_line_keeps_its_order(pool: Pool) -> None:
    line, seen, end = line_of(pool, 1000), list[int](), threading.Event()
    for number in range(500):
        line.put(partial(seen.append, number))
    line.put(end.set)
    assert end.wait(EVENT_LIMIT)
    assert seen == list(range(500))


def test_lines_run_beside_each_other(pool: Pool) -> None:
    held, free, passed = threading.Event(), threading.Event(), threading.Event()
    line_of(pool, 10).put(partial(hold, held, free))
    assert held.wait(EVENT_LIMIT)
    line_of(pool, 10).put(passed.set)
    assert passed.wait(EVENT_LIMIT)
    free.set()


def test_the_oldest_job_is_dropped(pool: Pool) -> None:
    line, held, free = line_of(pool, 2), threading.Event(), threading.Event()
    seen: list[str] = []
    line.put(partial(hold, held, free))
    assert held.wait(EVENT_LIMIT)
    jobs: list[Job] = [lambda: seen.append("old"), lambda: seen.append("newer"), free.set]
    end = threading.Event()
    assert line.put(jobs[0]) is None
    assert line.put(jobs[1]) is None
    assert line.put(end.set) is jobs[0]
    free.set()
    assert end.wait(EVENT_LIMIT)
    assert seen == ["newer"]


@pytest.mark.parametrize("error", [ZeroDivisionError, SystemExit])
def test_a_failing_job_ends_no_other_and_who_watches_is_told(
    pool: Pool,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
    error: type[BaseException],
) -> None:
    line, end, failures = line_of(pool, 10), threading.Event(), list[BaseException]()
    monkeypatch.setattr(callbacks, "failure_watchers", [failures.append])

    def fail() -> None:
        raise error

    line.put(fail)
    line.put(end.set)
    assert end.wait(EVENT_LIMIT)
    assert "/topic: a callback failed" in caplog.text
    assert error.__name__ in caplog.text
    assert [type(failure) for failure in failures] == [error]


def test_after_the_end_nothing_runs(pool: Pool) -> None:
    assert pool.close(EVENT_LIMIT)
    ran = threading.Event()
    line_of(pool, 10).put(ran.set)
    assert not ran.is_set()


@pytest.fixture
def no_threads() -> Iterator[pytest.MonkeyPatch]:
    """Let no thread start, until the patch is undone."""

    def fail(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threading.Thread, "start", fail)
        yield patch


def test_the_first_thread_runs_jobs_when_there_is_no_other(
    pool: Pool, request: pytest.FixtureRequest
) -> None:
    request.getfixturevalue("no_threads")
    ran = threading.Event()
    line_of(pool, 10).put(ran.set)
    assert ran.wait(EVENT_LIMIT)


@pytest.mark.usefixtures("no_threads")
def test_a_thread_that_cannot_be_there_is_an_error() -> None:
    with pytest.raises(RosError, match="test: can't start new thread"):
        make_pool(8, "test")


def test_a_callback_may_close_its_threads() -> None:
    pool, ran = make_pool(8, "test"), list[threading.Thread]()
    closed = threading.Event()

    def close() -> None:
        ran.append(threading.current_thread())
        pool.close(EVENT_LIMIT)
        closed.set()

    pool.submit(close)
    assert closed.wait(EVENT_LIMIT)
    ran[0].join(EVENT_LIMIT)
    assert not ran[0].is_alive()
