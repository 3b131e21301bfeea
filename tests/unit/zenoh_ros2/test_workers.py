"""Callbacks run on the node's threads, one after another for each line."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import partial

import pytest

from tests.support.limits import EVENT_LIMIT
from zenoh_ros2 import RosError
from zenoh_ros2._workers import Job, Line, Workers


def line_of(workers: Workers, most: int) -> Line[Job]:
    return Line(workers, most, lambda job: job())


def hold(held: threading.Event, free: threading.Event) -> None:
    held.set()
    free.wait(EVENT_LIMIT)


@pytest.fixture
def workers() -> Iterator[Workers]:
    made = Workers("test", most=2)
    yield made
    made.close()


def test_a_line_keeps_its_order(workers: Workers) -> None:
    line, seen, end = line_of(workers, 1000), list[int](), threading.Event()
    for number in range(500):
        line.put(partial(seen.append, number))
    line.put(end.set)
    assert end.wait(EVENT_LIMIT)
    assert seen == list(range(500))


def test_lines_run_beside_each_other(workers: Workers) -> None:
    held, free, passed = threading.Event(), threading.Event(), threading.Event()
    line_of(workers, 10).put(partial(hold, held, free))
    assert held.wait(EVENT_LIMIT)
    line_of(workers, 10).put(passed.set)
    assert passed.wait(EVENT_LIMIT)
    free.set()


def test_the_oldest_job_is_dropped(workers: Workers) -> None:
    line, held, free = line_of(workers, 2), threading.Event(), threading.Event()
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


def test_a_failing_job_ends_no_other(workers: Workers, caplog: pytest.LogCaptureFixture) -> None:
    line, end = line_of(workers, 10), threading.Event()
    line.put(lambda: 1 / 0)
    line.put(end.set)
    assert end.wait(EVENT_LIMIT)
    assert "a callback failed" in caplog.text


def test_after_the_end_nothing_runs(workers: Workers) -> None:
    workers.close()
    ran = threading.Event()
    workers.submit(ran.set)
    assert not ran.is_set()


def test_a_failing_job_ends_no_thread(workers: Workers, caplog: pytest.LogCaptureFixture) -> None:
    for _ in range(2):  # as many as there are threads
        workers.submit(lambda: 1 / 0)
    ran = threading.Event()
    workers.submit(ran.set)
    assert ran.wait(EVENT_LIMIT)
    assert "a callback failed" in caplog.text


@pytest.fixture
def no_threads() -> Iterator[pytest.MonkeyPatch]:
    """Let no thread start, until the patch is undone."""

    def fail(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threading.Thread, "start", fail)
        yield patch


def test_a_line_goes_on_when_there_is_a_thread_again(
    workers: Workers, no_threads: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    line, seen, end = line_of(workers, 10), list[int](), threading.Event()
    line.put(partial(seen.append, 1))
    assert "callbacks are late: can't start new thread" in caplog.text
    no_threads.undo()
    line.put(end.set)
    line_of(workers, 10).put(partial(seen.append, 2))
    assert end.wait(EVENT_LIMIT)
    assert seen[0] == 1


def test_a_thread_that_is_there_at_once_runs_jobs_when_there_is_no_other(
    request: pytest.FixtureRequest,
) -> None:
    workers, ran = Workers("test", 1, at_once=True), threading.Event()
    request.getfixturevalue("no_threads")
    line_of(workers, 10).put(ran.set)
    assert ran.wait(EVENT_LIMIT)
    workers.close()


@pytest.mark.usefixtures("no_threads")
def test_a_thread_that_cannot_be_there_at_once_is_an_error() -> None:
    with pytest.raises(RosError, match="test: can't start new thread"):
        Workers("test", at_once=True)


def test_a_callback_may_close_its_threads() -> None:
    workers, ran = Workers("test"), list[threading.Thread]()
    closed = threading.Event()

    def close() -> None:
        ran.append(threading.current_thread())
        workers.close()
        closed.set()

    workers.submit(close)
    assert closed.wait(EVENT_LIMIT)
    ran[0].join(EVENT_LIMIT)
    assert not ran[0].is_alive()
