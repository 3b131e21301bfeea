"""The files from which a pool takes jobs, and what happens to them without threads."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from typing import Any, Final

import pytest

from tests.support.limited import limited
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.waiting import until
from zenoh_ice import BusyException
from zenoh_ice.threads._starting import PULSE_PERIOD, UserCodeThread
from zenoh_ice.threads.limits import Limits
from zenoh_ice.threads.pool import Job, JobKind, Pool, Source

WATCH = 1  # thread of a pool


class Feed(Source):
    """A source of jobs: numbers that are sent to it."""

    def __init__(self, kind: JobKind, run: Callable[..., object]) -> None:
        self.kind = kind
        self.taken: list[int] = []
        self.most_takers = 0
        self.before_taking: Callable[[], object] = lambda: None
        self._run = run
        self._takers = 0
        self._client, self._server = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._server.setblocking(False)

    def send(self, *numbers: int) -> None:
        for number in numbers:
            self._client.send(b"%d" % number)

    def fileno(self) -> int:
        return self._server.fileno()

    def next_job(self) -> Job | None:
        self._takers += 1
        self.most_takers = max(self.most_takers, self._takers)
        try:
            self.before_taking()
            number = int(self._server.recv(8))
        except BlockingIOError:
            return None
        finally:
            self._takers -= 1
        self.taken.append(number)
        return self.kind, partial(self._run, number)

    def close(self) -> None:
        self._client.close()
        self._server.close()


MakeFeed = Callable[..., Feed]


@pytest.fixture
def feed(pool: Pool) -> Iterator[MakeFeed]:
    """Attach sources to the pool, and close them at the end."""
    with ExitStack() as end:

        def make(run: Callable[..., object], *, quick: bool = False, refusable: bool = False) -> Feed:
            made = Feed(pool.kind(refusable=refusable), run)
            made.kind.quick = quick
            pool.attach(made)
            end.callback(made.close)
            end.callback(pool.detach, made)
            return made

        yield make


UNWATCHED: Final[dict[str, Any]] = {"check_period": FOREVER}
"""Let the watches of pools never look."""
ALL_QUICK: Final[dict[str, Any]] = {"quick_job": FOREVER}
"""Let jobs count as quick on a busy machine, too."""


def wait_for(executed: threading.Semaphore, jobs: int) -> None:
    for _ in range(jobs):
        assert executed.acquire(timeout=EVENT_LIMIT)


def test_jobs_of_a_source_are_taken_in_their_order_by_one_thread_at_a_time(feed: MakeFeed) -> None:
    executed = threading.Semaphore(0)

    def execute(number: int) -> None:
        time.sleep(0.001)  # so that several threads take jobs
        executed.release()

    source = feed(execute)
    source.before_taking = lambda: time.sleep(0.0002)  # lets others come meanwhile
    source.send(*range(100))
    wait_for(executed, 100)
    assert source.taken == list(range(100))
    assert source.most_takers == 1


@limited(**ALL_QUICK)
def test_a_thread_that_takes_a_job_slowly_keeps_the_source(feed: MakeFeed) -> None:
    executed = threading.Semaphore(0)
    source = feed(lambda number: executed.release(), quick=True)
    source.before_taking = lambda: time.sleep(3 * PULSE_PERIOD if len(source.taken) % 2 else 0)
    source.send(1, 2, 3, 4)
    wait_for(executed, 4)
    assert source.most_takers == 1


@limited(**ALL_QUICK, **UNWATCHED)
def test_quick_jobs_keep_their_source(feed: MakeFeed) -> None:
    threads: list[int] = []
    sent, done = threading.Event(), threading.Event()

    def execute(number: int) -> None:
        sent.wait(FOREVER)
        threads.append(threading.get_ident())
        if number == 99:
            done.set()

    source = feed(execute, quick=True)
    source.send(*range(100))
    sent.set()
    assert done.wait(EVENT_LIMIT)
    assert len(set(threads)) == 1


def test_a_quick_job_that_takes_long_for_once_gives_up_its_source(feed: MakeFeed) -> None:
    done = threading.Event()
    source = feed(lambda number: done.wait(FOREVER) if number == 1 else done.set(), quick=True)
    source.send(1, 2)
    assert done.wait(EVENT_LIMIT)


@limited(**UNWATCHED)
def test_a_job_that_is_not_known_as_quick_gives_up_its_source_at_once(feed: MakeFeed) -> None:
    done = threading.Event()
    source = feed(lambda number: done.wait(FOREVER) if number == 1 else done.set())
    source.send(1, 2)
    assert done.wait(EVENT_LIMIT)


@limited(**UNWATCHED)
def test_a_thread_that_waits_for_another_gives_up_its_source(pool: Pool, feed: MakeFeed) -> None:
    inner, done = threading.Event(), threading.Event()

    def execute(number: int) -> None:
        if number == 2:
            inner.set()
            return
        with pool.blocked():
            inner.wait(FOREVER)
        done.set()

    source = feed(execute, quick=True)
    source.send(1, 2)
    assert done.wait(EVENT_LIMIT)


def test_a_detached_source_gives_no_jobs(pool: Pool, feed: MakeFeed) -> None:
    done = threading.Event()
    detached, other = feed(lambda number: None), feed(lambda number: done.set())
    pool.detach(detached)
    detached.send(1)
    other.send(1)
    assert done.wait(EVENT_LIMIT)
    assert detached.taken == []


def test_a_source_that_is_detached_during_a_job_gives_no_further_one() -> None:
    pool = Pool(4, "pool", Limits(**ALL_QUICK, **UNWATCHED))
    entered, leave = threading.Event(), threading.Event()

    def execute(number: int) -> None:
        entered.set()
        leave.wait(FOREVER)

    source = Feed(JobKind(quick=True), execute)
    pool.attach(source)
    source.send(1)
    assert entered.wait(EVENT_LIMIT)
    pool.detach(source)
    source.send(2)
    leave.set()
    assert pool.close(EVENT_LIMIT)
    source.close()
    assert source.taken == [1]


def test_a_thread_with_a_long_job_of_a_source_that_was_detached_is_not_free(
    feed: MakeFeed, pool: Pool
) -> None:
    pool.reserve(-3)  # leaves two threads
    entered, leave, submitted, done = (threading.Event() for _ in range(4))

    def stay(number: int) -> None:
        entered.set()
        leave.wait(FOREVER)

    source, other = feed(stay), feed(lambda number: done.set())
    source.before_taking = lambda: pool.detach(source)
    source.send(1)
    assert entered.wait(EVENT_LIMIT)
    pool.submit(submitted.set)
    assert submitted.wait(EVENT_LIMIT)
    other.send(1)  # nobody would notice while the other thread waits in the queue
    assert done.wait(EVENT_LIMIT)
    leave.set()


def test_events_of_a_closed_file_do_no_harm_to_the_next_of_its_number(pool: Pool) -> None:
    numbers: set[int] = set()
    for _ in range(100):
        executed = threading.Semaphore(0)
        source = Feed(pool.kind(), lambda number, executed=executed: executed.release())
        numbers.add(source.fileno())
        pool.attach(source)
        source.send(1)
        wait_for(executed, 1)
        source.send(2)  # this event may come late
        pool.detach(source)
        source.close()
    assert len(numbers) < 100


@limited(**ALL_QUICK)
def test_many_sources_need_few_threads(pool: Pool, feed: MakeFeed) -> None:
    pool.reserve(200)
    executed = threading.Semaphore(0)
    sources = [feed(lambda number: executed.release(), quick=True) for _ in range(100)]
    for number in range(10):
        for source in sources:
            source.send(number)
    wait_for(executed, 1000)
    assert [source.taken for source in sources] == [list(range(10))] * 100
    assert pool_threads() < 20


def test_closing_ignores_what_comes_later(pool: Pool) -> None:
    source = Feed(pool.kind(), lambda number: None)
    pool.attach(source)
    assert pool.close(EVENT_LIMIT)
    late = Feed(JobKind(), lambda number: None)
    pool.attach(late)
    pool.detach(late)
    pool.detach(source)
    for each in (source, late):
        each.send(1)
        each.close()
        assert each.taken == []


# With two threads and no further one.


@pytest.fixture
def no_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no thread start any more that runs jobs."""

    def fail(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(UserCodeThread, "start", fail)


@pytest.fixture(params=["limit", "shortage"])
def scarce(request: pytest.FixtureRequest, pool: Pool) -> Pool:
    """A pool of two threads and a watch, at its limit, or in a process that gets no further thread."""
    pool.kind()
    until(lambda: pool_threads() == 2 + WATCH)
    if request.param == "limit":
        pool.reserve(-3)
    else:
        request.getfixturevalue("no_starts")
    return pool


def occupy_one(feed: MakeFeed, leave: threading.Event) -> None:
    """Let one of the threads that wait for files run a job, which is not over until `leave` is set."""
    entered = threading.Event()

    def stay(number: int) -> None:
        entered.set()
        leave.wait(FOREVER)

    feed(stay).send(1)
    assert entered.wait(EVENT_LIMIT)


def test_the_last_free_thread_serves_files_submitted_and_other_jobs(scarce: Pool, feed: MakeFeed) -> None:
    executed, leave = threading.Semaphore(0), threading.Event()
    scarce.place = lambda query: (JobKind(), executed.release)
    source = feed(lambda number: executed.release())
    occupy_one(feed, leave)
    for number in range(5):
        source.send(number)
        wait_for(executed, 1)
        scarce.submit(executed.release)
        wait_for(executed, 1)
        scarce.put(object())
        wait_for(executed, 1)
    leave.set()


@limited(**ALL_QUICK)
def test_a_source_whose_quick_jobs_never_end_leaves_the_last_thread_to_others(
    scarce: Pool, feed: MakeFeed
) -> None:
    executed, leave = threading.Semaphore(0), threading.Event()
    busy: list[Feed] = []

    def go_on(number: int) -> None:
        if not leave.is_set():
            busy[0].send(number)

    busy.append(feed(go_on, quick=True))
    source = feed(lambda number: executed.release(), quick=True)
    occupy_one(feed, leave)
    busy[0].send(0)
    for number in range(3):
        source.send(number)
        scarce.submit(executed.release)
        wait_for(executed, 2)
    leave.set()


@limited(**ALL_QUICK)
def test_a_queue_whose_quick_jobs_never_end_leaves_the_last_thread_to_files(
    scarce: Pool, feed: MakeFeed
) -> None:
    executed, leave = threading.Semaphore(0), threading.Event()
    kind = scarce.kind()
    kind.quick = True

    def go_on() -> None:
        if not leave.is_set():
            scarce.submit(go_on, kind)

    source = feed(lambda number: executed.release(), quick=True)
    occupy_one(feed, leave)
    go_on()
    for number in range(3):
        source.send(number)
        wait_for(executed, 1)
    leave.set()


def test_both_threads_are_used_after_one_was_busy(scarce: Pool, feed: MakeFeed) -> None:
    for _ in range(3):
        leave, together = threading.Event(), threading.Barrier(3)
        occupy_one(feed, leave)
        leave.set()
        job = partial(together.wait, EVENT_LIMIT)
        feed(lambda number, job=job: job()).send(1)
        scarce.submit(job)
        together.wait(EVENT_LIMIT)


@pytest.mark.parametrize("scarce", ["shortage"], indirect=True)
def test_the_last_free_thread_refuses_long_jobs_of_a_source_and_runs_others(
    scarce: Pool, feed: MakeFeed
) -> None:
    leave = threading.Event()
    outcomes: list[str] = []
    answered = threading.Semaphore(0)

    def answer(number: int, refusal: BusyException | None = None) -> None:
        outcomes.append("run" if refusal is None else str(refusal))
        answered.release()
        if refusal is None:
            leave.wait(FOREVER)

    source = feed(answer, refusable=True)
    urgent = feed(lambda number: answered.release())
    source.send(1)
    wait_for(answered, 1)
    assert outcomes == ["run"], "another thread is free"
    for number in (2, 3):
        source.send(number)
        wait_for(answered, 1)
        assert outcomes[-1].startswith("can't start new thread: raise the process's limit of threads")
        urgent.send(number)
        wait_for(answered, 1)
    leave.set()


@pytest.mark.parametrize("scarce", ["limit"], indirect=True)
def test_at_the_limit_nothing_is_refused(scarce: Pool, feed: MakeFeed) -> None:
    leave, run = threading.Event(), threading.Semaphore(0)

    def answer(number: int, refusal: BusyException | None = None) -> None:
        assert refusal is None
        run.release()
        leave.wait(FOREVER)

    source = feed(answer, refusable=True)
    source.send(1, 2, 3)
    wait_for(run, 2)
    leave.set()
    wait_for(run, 1)


@limited(stalled_checks=5)
def test_a_pool_whose_files_nobody_watches_says_so_and_when_somebody_does_again(
    scarce: Pool, feed: MakeFeed
) -> None:
    stalls: list[bool] = []
    scarce.on_stall = lambda: stalls.append(scarce.stalled)
    leave, done = threading.Event(), threading.Event()
    source = feed(lambda number: done.set())
    for _ in range(2):
        occupy_one(feed, leave)
    source.send(1)
    until(lambda: stalls == [True])
    leave.set()
    assert done.wait(EVENT_LIMIT)
    until(lambda: stalls == [True, False])


def pool_threads() -> int:
    return sum(thread.name.startswith("pool") for thread in threading.enumerate())
