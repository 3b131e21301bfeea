"""The pool of threads, and the lines in it."""

from __future__ import annotations

import logging
import threading
import time
from functools import partial
from pathlib import Path

import pytest

from tests.support.limited import limited
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.waiting import until
from zenoh_ice import BusyException
from zenoh_ice.threads._starting import UserCodeThread
from zenoh_ice.threads.pool import MOST_LINES, MOST_QUEUED, Job, Pool


def test_jobs_run_at_once_up_to_the_limit(pool: Pool) -> None:
    together = threading.Barrier(5)
    for _ in range(4):
        pool.submit(lambda: together.wait(EVENT_LIMIT))
    together.wait(EVENT_LIMIT)
    assert pool_threads() <= 5


def test_pool_grows_while_its_threads_wait_for_each_other(pool: Pool) -> None:
    done = threading.Event()

    def nest(depth: int) -> None:
        if depth == 0:
            done.set()
            return
        inner = threading.Event()
        pool.submit(lambda: (nest(depth - 1), inner.set()))  # type: ignore[func-returns-value]
        with pool.blocked():
            inner.wait(FOREVER)

    pool.submit(lambda: nest(10))
    assert done.wait(EVENT_LIMIT)


@pytest.mark.parametrize("error", [RuntimeError("job"), SystemExit(1)])
def test_failing_job_is_logged_and_ends_no_thread(
    pool: Pool, caplog: pytest.LogCaptureFixture, error: BaseException
) -> None:
    def fail() -> None:
        raise error

    done = threading.Event()
    with caplog.at_level(logging.ERROR, "zenoh_ice"):
        for _ in range(10):
            pool.submit(fail)
        pool.submit(done.set)
        assert done.wait(EVENT_LIMIT)
    assert type(error).__name__ in caplog.text


def test_close_runs_what_was_submitted_and_may_come_from_a_job() -> None:
    pool = Pool(2, "pool")
    closed = threading.Event()
    order: list[int] = []

    def close() -> None:
        order.append(1)
        pool.close(EVENT_LIMIT)
        closed.set()

    pool.submit(close)
    pool.submit(lambda: order.append(2))
    assert closed.wait(EVENT_LIMIT)
    assert order == [1, 2]


def test_close_runs_all_that_was_submitted_however_long_it_takes() -> None:
    pool = Pool(2, "pool")
    done: list[int] = []

    def run(number: int) -> None:
        time.sleep(0.002)
        done.append(number)

    for number in range(30):
        pool.submit(partial(run, number))
    assert pool.close(EVENT_LIMIT)
    assert sorted(done) == list(range(30))
    pool.submit(partial(run, 30))
    assert len(done) == 30, "after the end, jobs are dropped"


def test_a_thread_that_stays_longer_than_close_waits_ends_well(caplog: pytest.LogCaptureFixture) -> None:
    before = files()
    pool = Pool(2, "pool")
    entered, leave = threading.Event(), threading.Event()
    pool.submit(lambda: (entered.set(), leave.wait(FOREVER)))  # type: ignore[func-returns-value]
    assert entered.wait(EVENT_LIMIT)
    assert not pool.close(0.01)
    assert not pool.close(0.01)
    pool.submit(lambda: None)
    leave.set()
    until(lambda: pool_threads() == 0)
    assert "internal error" not in caplog.text
    assert files() == before


def test_a_closed_pool_has_no_open_file(starts: Starts) -> None:
    before = files()
    with_threads, without = Pool(2, "pool"), Pool(0, "pool")
    starts.fail = True
    with pytest.raises(BusyException):
        Pool(2, "pool")
    assert with_threads.close(EVENT_LIMIT)
    assert without.close(EVENT_LIMIT)
    assert files() == before


def test_close_reports_threads_that_stay(caplog: pytest.LogCaptureFixture) -> None:
    pool = Pool(1, "pool")
    entered, leave = threading.Event(), threading.Event()
    busy: list[threading.Thread] = []

    def stay() -> None:
        busy.append(threading.current_thread())
        entered.set()
        leave.wait(FOREVER)

    pool.submit(stay)
    assert entered.wait(EVENT_LIMIT)
    closed = pool.close(0.01)
    leave.set()
    busy[0].join(EVENT_LIMIT)
    assert not closed
    assert f"{busy[0].name} still busy" in caplog.text


def test_a_line_keeps_the_order_one_at_a_time(pool: Pool) -> None:
    order: list[int] = []
    done = threading.Event()
    for number in range(100):
        pool.submit_in_line("servant", lambda number=number: order.append(number))  # type: ignore[misc]
    pool.submit_in_line("servant", done.set)
    assert done.wait(EVENT_LIMIT)
    assert order == list(range(100))


def test_a_line_is_held_until_its_last_job_has_ended(pool: Pool) -> None:
    entered, leave = threading.Event(), threading.Event()
    pool.submit_in_line("servant", lambda: (entered.set(), leave.wait(FOREVER)))  # type: ignore[func-returns-value]
    assert entered.wait(EVENT_LIMIT)
    assert "servant" in pool.lines
    assert "other" not in pool.lines
    leave.set()
    until(lambda: "servant" not in pool.lines)


def test_a_busy_line_leaves_the_pool_to_others(pool: Pool) -> None:
    leave, done = threading.Event(), threading.Event()
    for _ in range(20):
        pool.submit_in_line("busy", lambda: leave.wait(FOREVER))
    pool.submit_in_line("other", done.set)
    assert done.wait(EVENT_LIMIT)
    leave.set()


def test_a_line_goes_on_after_a_job_that_failed(pool: Pool, caplog: pytest.LogCaptureFixture) -> None:
    done = threading.Event()

    def fail() -> None:
        raise RuntimeError("job")

    pool.submit_in_line("servant", fail)
    pool.submit_in_line("servant", done.set)
    assert done.wait(EVENT_LIMIT)
    until(lambda: "RuntimeError" in caplog.text)


def test_a_full_line_refuses(pool: Pool) -> None:
    leave = threading.Event()
    for _ in range(1 + MOST_QUEUED):
        pool.submit_in_line("servant", lambda: leave.wait(FOREVER))
    with pytest.raises(BusyException, match="servant: 1024 calls are already waiting"):
        pool.submit_in_line("servant", leave.set)
    leave.set()


def test_too_many_lines_are_refused(pool: Pool) -> None:
    leave = threading.Event()
    for line in range(MOST_LINES):
        pool.submit_in_line(line, lambda: leave.wait(FOREVER))
    with pytest.raises(BusyException, match="c: 256 calls are already waiting"):
        pool.submit_in_line("c", leave.set)
    leave.set()


@limited(idle_thread=0.01)
def test_threads_that_have_nothing_to_do_end_but_two(pool: Pool) -> None:
    together = threading.Barrier(4)
    for _ in range(3):
        pool.submit(lambda: together.wait(EVENT_LIMIT))
    together.wait(EVENT_LIMIT)
    until(lambda: pool_threads() == 2)
    done = threading.Event()
    pool.submit(done.set)
    assert done.wait(EVENT_LIMIT)


def test_a_reservation_lets_the_pool_grow(pool: Pool) -> None:
    pool.reserve(2)
    together = threading.Barrier(7)
    for _ in range(6):
        pool.submit(lambda: together.wait(EVENT_LIMIT))
    together.wait(EVENT_LIMIT)
    pool.reserve(-2)


class Query:
    """Something that becomes a job."""


def test_jobs_are_made_of_the_objects_of_a_type_in_the_order_of_the_queue(pool: Pool) -> None:
    placed: list[Query] = []
    executed = threading.Semaphore(0)

    def execute() -> None:
        time.sleep(0.001)  # so that several threads take jobs
        executed.release()

    kind = pool.kind()

    def place(query: Query) -> Job | None:
        time.sleep(0.0002)  # lets others take theirs meanwhile
        placed.append(query)
        return None if len(placed) % 10 == 0 else (kind, execute)

    pool.place = place
    queries = [Query() for _ in range(200)]
    for query in queries:
        pool.put(query)
        pool.submit(execute)
    for _ in range(180 + 200):
        assert executed.acquire(timeout=EVENT_LIMIT)
    until(lambda: len(placed) == 200)
    assert placed == queries


@limited(quick_job=FOREVER)  # also on a busy machine
def test_quick_jobs_of_a_kind_run_on_one_thread(pool: Pool) -> None:
    kind, threads, done = pool.kind(), list[str](), threading.Semaphore(0)
    pool.submit(lambda: None, kind)
    until(lambda: kind.quick)  # the first of a kind counts as long until it has ended
    for _ in range(100):
        pool.submit(lambda: threads.append(threading.current_thread().name), kind)
        pool.submit(done.release, kind)
        assert done.acquire(timeout=EVENT_LIMIT)
    assert len(set(threads)) == 1


def test_a_job_that_takes_long_for_once_leaves_the_pool_to_others(pool: Pool) -> None:
    kind, leave, done = pool.kind(), threading.Event(), threading.Event()
    kind.quick = True
    pool.submit(lambda: leave.wait(FOREVER), kind)
    pool.submit(done.set, kind)
    assert done.wait(EVENT_LIMIT)
    leave.set()


def test_jobs_of_a_kind_that_took_long_run_beside_a_thread_that_takes_the_next(pool: Pool) -> None:
    kind, done = pool.kind(), threading.Event()
    kind.quick = True
    pool.submit(lambda: time.sleep(0.01), kind)
    pool.submit(done.set)
    assert done.wait(EVENT_LIMIT)
    until(lambda: not kind.quick)  # the first may end after the second


@limited(look_period=FOREVER)
def test_a_thread_that_waits_for_another_lets_others_have_the_queue(pool: Pool) -> None:
    kind, inner, done = pool.kind(), threading.Event(), threading.Event()
    kind.quick = True

    def wait() -> None:
        pool.submit(inner.set, kind)
        with pool.blocked():
            assert inner.wait(EVENT_LIMIT)
        done.set()

    pool.submit(wait, kind)
    assert done.wait(EVENT_LIMIT)


def test_a_pool_of_no_threads_runs_jobs_at_once() -> None:
    pool = Pool(0, "pool")
    threads: list[threading.Thread] = []
    pool.submit(lambda: threads.append(threading.current_thread()))
    pool.submit_in_line("servant", lambda: threads.append(threading.current_thread()))
    assert threads == [threading.current_thread()] * 2
    assert not pool.has_threads
    assert pool.close(0)


class Starts:
    """Let no thread of a pool start while `fail` is set, as at a limit of threads or of memory."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.fail = False
        start = UserCodeThread.start

        def start_or_fail(thread: UserCodeThread) -> None:
            if self.fail:
                raise RuntimeError("can't start new thread")
            start(thread)

        monkeypatch.setattr(UserCodeThread, "start", start_or_fail)


@pytest.fixture
def starts(monkeypatch: pytest.MonkeyPatch) -> Starts:
    return Starts(monkeypatch)


class Task:
    """A job that may be refused."""

    def __init__(self, leave: threading.Event | None = None) -> None:
        self.began = threading.Event()
        self.ended = threading.Event()
        self.refusal: BusyException | None = None
        self._leave = leave

    def __call__(self, refusal: BusyException | None = None) -> None:
        self.refusal = refusal
        self.began.set()
        if refusal is None and self._leave is not None:
            self._leave.wait(FOREVER)
        self.ended.set()


def test_a_thread_that_cannot_start_ends_nothing(pool: Pool, starts: Starts) -> None:
    starts.fail = True
    for _ in range(20):
        done = threading.Event()
        pool.submit(done.set)
        assert done.wait(EVENT_LIMIT)
    starts.fail = False
    together = threading.Barrier(4)
    for _ in range(3):
        pool.submit(lambda: together.wait(EVENT_LIMIT))
    together.wait(EVENT_LIMIT)


def test_while_no_thread_can_start_long_jobs_are_refused_and_urgent_ones_run(
    pool: Pool, starts: Starts, caplog: pytest.LogCaptureFixture
) -> None:
    kind, leave = pool.kind(refusable=True), threading.Event()
    until(lambda: pool_threads() == 3)  # with the watch, which starts the second one: both are free
    starts.fail = True
    occupying, refused, urgent = Task(leave), Task(), Task()
    pool.submit(occupying, kind)
    assert occupying.began.wait(EVENT_LIMIT)
    assert occupying.refusal is None, "another one is free"
    pool.submit(refused, kind)
    assert refused.ended.wait(EVENT_LIMIT)
    assert "can't start new thread: raise the process's limit of threads" in str(refused.refusal)
    pool.submit(urgent, pool.kind())
    assert urgent.ended.wait(EVENT_LIMIT)
    assert urgent.refusal is None
    until(lambda: "refuses calls that may take long: can't start" in caplog.text)
    starts.fail = False
    executed = Task()
    pool.submit(executed, kind)
    assert executed.ended.wait(EVENT_LIMIT)
    assert executed.refusal is None
    leave.set()


def die(query: object) -> Job | None:
    """Break the promise of `place` to raise nothing."""
    raise SystemExit(str(query))


def test_threads_that_die_while_they_take_jobs_are_replaced_as_soon_as_one_can_start(
    pool: Pool, starts: Starts, caplog: pytest.LogCaptureFixture
) -> None:
    pool.place = die
    pool.kind()  # starts its watch
    until(lambda: pool_threads() == 3)
    starts.fail = True
    for _ in range(2):
        pool.put(Query())
    until(lambda: pool_threads() == 1)
    assert "internal error ends pool-1; another thread takes its place" in caplog.text
    done = threading.Event()
    pool.submit(done.set)
    starts.fail = False
    assert done.wait(EVENT_LIMIT)


def test_threads_that_die_leave_a_whole_pool(pool: Pool, caplog: pytest.LogCaptureFixture) -> None:
    pool.place = die
    pool.kind()
    with caplog.at_level(logging.CRITICAL, "zenoh_ice"):
        for _ in range(20):
            pool.put(Query())
        for _ in range(3):
            together = threading.Barrier(6)
            for _ in range(5):
                pool.submit(lambda together=together: together.wait(EVENT_LIMIT))  # type: ignore[misc]
            together.wait(EVENT_LIMIT)
    assert pool_threads() <= 6  # with the watch


@limited(stalled_looks=5)
def test_a_pool_that_takes_no_jobs_says_so_and_when_it_takes_them_again(pool: Pool, starts: Starts) -> None:
    pool.kind()
    stalls: list[bool] = []
    pool.on_stall = lambda: stalls.append(pool.stalled)
    leave, done = threading.Event(), threading.Event()
    pool.submit(lambda: None)
    until(lambda: pool_threads() == 3)  # with the watch
    starts.fail = True
    for _ in range(2):
        pool.submit(lambda: leave.wait(FOREVER))
    pool.submit(done.set)
    until(lambda: stalls == [True])
    leave.set()
    assert done.wait(EVENT_LIMIT)
    until(lambda: stalls == [True, False])


def test_a_pool_without_its_first_thread_is_refused(starts: Starts) -> None:
    starts.fail = True
    with pytest.raises(BusyException, match="can't start new thread"):
        Pool(4, "pool")


def pool_threads() -> int:
    return sum(thread.name.startswith("pool") for thread in threading.enumerate())


def files() -> list[str]:
    """Return what the descriptors of pools stand for."""
    names = [str(file.readlink()) for file in Path("/proc/self/fd").iterdir() if file.is_symlink()]
    return sorted(name for name in names if "event" in name)
