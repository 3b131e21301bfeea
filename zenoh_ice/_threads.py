"""The threads of a communicator: a pool, and a pulse.

All threads of a pool wait in one epoll, for jobs and for files that become readable; the kernel gives each
event to one of them, which takes what is there and runs it. docs/decisions/0033-local-calls.md compares this
design with others, and says what happens when no further thread can be started.
"""

from __future__ import annotations

import itertools
import logging
import math
import os
import select
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from queue import SimpleQueue
from typing import Any, Final

from .exceptions import BusyException

PULSE_PERIOD: Final = 0.02  # s between checks of the threads and of the clock

_IDLE_LIMIT: Final = 5.0  # s after which a thread ends that has nothing to do
_FEWEST: Final = 2  # threads that stay: while one is busy, another one waits
_MOST_QUEUED: Final = 1024  # jobs of one line
_MOST_LINES: Final = 256
_QUICK: Final = 0.0005  # s that a job takes at most while its thread keeps the source that it came from
_STALLED: Final = 100  # looks, 2 s, in which jobs wait and none is taken
_COMPLAINT_PERIOD: Final = 10.0  # s between two reports that no thread can be started
_STANDSTILL: Final = 0.5  # s without a beat: more than a busy machine makes of the period
_AFTERMATH: Final = 1.0  # s until all that waited has been read

# The clock that runs while the machine is suspended, where the system has one.
_CLOCK: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)

_ONCE: Final = select.EPOLLIN | select.EPOLLONESHOT
_EDGE: Final = select.EPOLLIN | select.EPOLLET

_logger = logging.getLogger(__name__)


class Kind:
    """Remember whether the last job of a kind, such as the calls of one method, was quick."""

    __slots__ = ("quick", "refusable")

    def __init__(self, *, quick: bool = False, refusable: bool = False) -> None:
        self.quick = quick
        self.refusable: Final = refusable
        """Whether its jobs may be refused: such a job takes the reason as an argument, and does no more."""


Job = tuple[Kind, Callable[..., object]]

_LONG_JOB: Final = Kind()


class Source(ABC):
    """A file from which jobs are taken, by one thread at a time, whenever it is readable."""

    owner = 0
    """Identifier of the thread that takes jobs from it; 0 while the pool waits for it."""
    owned_since = math.inf
    """When that thread began a job of it; never while it asks for one."""

    @abstractmethod
    def fileno(self) -> int: ...

    @abstractmethod
    def take(self) -> Job | None:
        """Return the next job; None if there is none, or no more. It does not wait, and raises nothing."""

    def look(self, now: float) -> None:  # noqa: B027 - few have anything to do then
        """Notice what depends on time alone; called every PULSE_PERIOD."""


class _Queue(Source):
    """The jobs that were submitted: one thread waits in it for the next, and others for its bell."""

    def __init__(self, pool: Pool) -> None:
        self.jobs: Final[SimpleQueue[Any]] = SimpleQueue()
        self._pool: Final = pool
        self._bell: Final = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)  # rung when nobody owns it

    def fileno(self) -> int:
        return self._bell

    def look(self, now: float) -> None:
        """Notice what depends on time alone; called every PULSE_PERIOD."""

    def ring(self) -> None:
        """Let a thread own it that waits in the pool's epoll."""
        os.eventfd_write(self._bell, 1)

    def take(self) -> Job | None:
        """Wait for the next job; return None at the end."""
        while True:
            job = self.jobs.get()
            if job is None:
                self.jobs.put(None)
                return None
            if type(job) is tuple or (job := self._pool.place(job)) is not None:
                return job

    def close(self) -> None:
        os.close(self._bell)


class UserCodeThread(threading.Thread):
    """A thread of a communicator that runs user code."""


def start(thread: threading.Thread) -> None:
    """Start a thread; raises BusyException where the system gives this process no more."""
    try:
        thread.start()
    except RuntimeError as error:
        raise BusyException(_no_thread(error)) from error


def _no_thread(error: RuntimeError | None) -> str:
    return f"{error}: raise the process's limit of threads (ulimit -u, TasksMax=, pids.max) or of memory"


class Pool:
    """A pool that grows from two threads to a limit and never makes its callers wait.

    Jobs are submitted, or taken from sources in their order. A thread that takes a job that may be long first
    lets the others have its source, and starts another thread if none waits any more. If the last job of the
    same kind was quick, it does neither: that would take longer than the job. If such a job takes long for
    once, its source is given to the others within PULSE_PERIOD.

    If the system gives the process no further thread, the last that waits refuses the jobs that may be
    refused, and so stays free for those that may not, such as a stop. If nobody takes jobs any more,
    `on_stall` says so, and so it does when somebody does again.

    A pool of no threads, for tests in virtual time, runs each job at once on the thread that submits it.

    A transport may also `put` other objects, which `place` turns into jobs in the order in which they came.
    """

    def __init__(self, size: int, name: str) -> None:
        """Start the first thread; raises BusyException where the system gives this process none."""
        self.has_threads: Final = size > 0
        self.pulse: Final = Pulse()
        self.stalled = False
        """Whether jobs wait, and none was taken for two seconds in which the process ran."""
        self.on_stall: Callable[[], object] = lambda: None
        """Called on the pool's watch whenever `stalled` changes."""
        self.place: Callable[[Any], Job | None] = lambda job: job
        """Turns other objects into jobs, or None; it raises nothing."""
        self._limit = size + 1  # one waits in the queue
        self._name: Final = name
        self._lock: Final = threading.Lock()
        self._queue: Final = _Queue(self)
        self.put: Final[Callable[[Any], None]] = self._queue.jobs.put
        """Queues a job, or an object that `place` makes one of; C code."""
        self._sources: Final[dict[int, Source]] = {}  # by file
        self._epoll: Final = select.epoll()
        self._end: Final = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)  # wakes all threads
        self._epoll.register(self._end, select.EPOLLIN)
        self._waiting = 0  # threads that wait for a source
        self._threads: Final[set[threading.Thread]] = set()
        self._serials: Final = itertools.count(1)
        self._shortage: RuntimeError | None = None  # why the last start of a thread failed
        self._taken = self._seen = 0  # jobs, now and at the last look
        self._closed = False
        self.lines: Final[dict[object, deque[Callable[[], object]]]] = {}
        """Lines with waiting or running jobs: later ones must not overtake them."""
        self._looks_without_job = 0
        self._complained_at = -math.inf
        self._stop_watch: Callable[[], object] | None = None
        self._sources[self._queue.fileno()] = self._queue
        self._epoll.register(self._queue, _EDGE)
        with self._lock:
            started = self._grow()
        if not started:
            raise BusyException(_no_thread(self._shortage))

    def submit(self, run: Callable[[], object], kind: Kind | None = None) -> None:
        """Run a job as soon as a thread is free; after `close` it is dropped."""
        if self.has_threads:
            self.put((kind or _LONG_JOB, run))
        else:
            run()

    def submit_in_line(self, line: object, job: Callable[[], object]) -> None:
        """Run a job after the earlier ones of the same line; raises BusyException for too many."""
        if not self.has_threads:
            job()
            return
        with self._lock:
            jobs = self.lines.get(line, deque[Callable[[], object]]())
            # The first job of each line runs.
            waiting, most = (len(jobs) - 1, _MOST_QUEUED) if jobs else (len(self.lines), _MOST_LINES)
            if waiting >= most:
                raise BusyException(f"{line}: {waiting} calls are already waiting; this one was not executed")
            jobs.append(job)
            if len(jobs) == 1:
                self.lines[line] = jobs
                self.submit(partial(self._run_line, line))

    def reserve(self, threads: int) -> None:
        """Let the pool have more threads, or fewer with a negative number, if it needs them."""
        with self._lock:
            self._limit += threads
            if not self._waiting:
                self._grow()

    @contextmanager
    def blocked(self) -> Iterator[None]:
        """Give the pool one more thread while one of its threads waits for another."""
        if threading.current_thread() not in self._threads:
            yield
            return
        me = threading.get_ident()
        self.reserve(1)
        try:
            with self._lock:
                for source in self._sources.values():
                    if source.owner == me:
                        self._release(source)
            yield
        finally:
            self.reserve(-1)

    def kind(self, *, refusable: bool = False) -> Kind:
        """Return a new kind of jobs, such as the calls of one method; raises BusyException as `start`."""
        with self._lock:
            self._watch()
        return Kind(refusable=refusable)

    def attach(self, source: Source) -> None:
        """Take jobs from a source from now on; raises BusyException as `start`."""
        with self._lock:
            self._watch()
            if not self._closed:
                self._sources[source.fileno()] = source
                self._epoll.register(source, _ONCE)

    def detach(self, source: Source) -> None:
        """Take no more jobs from a source; to be called before its file is closed."""
        with self._lock:
            if self._sources.get(source.fileno()) is source:
                del self._sources[source.fileno()]
                if not self._closed:
                    self._epoll.unregister(source)

    def close(self, timeout: float) -> bool:
        """End the threads once their jobs are done; return whether all ended within `timeout` s.

        The calling thread, if it is one of them, ends after it has returned from its job.
        """
        with self._lock:
            self._closed = True
            threads = tuple(self._threads)
        if self._stop_watch is not None:
            self._stop_watch()
        self.put(None)
        os.eventfd_write(self._end, 1)
        ended = _join(threads, timeout)
        self._queue.close()
        os.close(self._end)
        self._epoll.close()
        return ended

    def _watch(self) -> None:
        """Begin to look after the threads; with the lock."""
        if self._stop_watch is None and self.has_threads and not self._closed:
            self.pulse.beat()
            self._stop_watch = repeat(PULSE_PERIOD, self._look, f"{self._name} watch")

    def _grow(self) -> bool:
        """Start another thread; return whether one waits now, or will soon. With the lock.

        At the limit, that is the next thread whose job ends.
        """
        if len(self._threads) >= self._limit or self._closed or not self.has_threads:
            return True
        name = f"{self._name}-{next(self._serials)}"
        thread = UserCodeThread(target=self._work, name=name, daemon=True)
        try:
            thread.start()
        except RuntimeError as error:
            self._shortage = error
            return False
        self._shortage = None
        self._threads.add(thread)
        self._waiting += 1
        return True

    def _release(self, source: Source) -> None:
        """Let any thread take the next job from a source; with the lock."""
        source.owner = 0
        if self._sources.get(source.fileno()) is source and not self._closed:
            if source is self._queue:
                self._queue.ring()
            else:
                self._epoll.modify(source.fileno(), _ONCE)

    def _look(self) -> None:
        self.pulse.beat()
        now = time.monotonic()
        with self._lock:
            for source in self._sources.values():
                if source.owner and now - source.owned_since > PULSE_PERIOD:
                    self._release(source)
            # The spare thread, or one that could not be started or died.
            if not self._waiting or len(self._threads) < _FEWEST:
                self._grow()
            shortage, sources = self._shortage, list(self._sources.values())
        for source in sources:
            source.look(now)
        if shortage is not None and now - self._complained_at >= _COMPLAINT_PERIOD:
            self._complained_at = now
            _logger.error("%s refuses calls that may take long: %s", self._name, _no_thread(shortage))
        self._look_for_stall()

    def _look_for_stall(self) -> None:
        # Counted in looks: in a process that stands still, or waits for the interpreter, nobody looks either.
        before = self._seen
        self._seen = self._taken
        waits = not self._queue.jobs.empty()
        self._looks_without_job = self._looks_without_job + 1 if waits and self._seen == before else 0
        stalled = self._looks_without_job >= _STALLED
        if stalled != self.stalled:
            self.stalled = stalled
            self.on_stall()

    def _work(self) -> None:
        me = threading.get_ident()
        poll = self._epoll.poll
        try:
            self._serve(self._queue, me)
            while not self._closed:
                events = poll(_IDLE_LIMIT, 1)
                if not events:
                    if self._is_surplus():
                        return
                elif (source := self._sources.get(events[0][0])) is not None:
                    self._serve(source, me)
            self._serve(self._queue, me)
        except BaseException:
            name = threading.current_thread().name
            _logger.exception("internal error ends %s; another thread takes its place", name)
        finally:
            with self._lock:
                self._waiting -= 1
                self._threads.discard(threading.current_thread())
                for source in self._sources.values():
                    if source.owner == me:
                        self._release(source)
                if not self._waiting:
                    self._grow()

    def _is_surplus(self) -> bool:
        with self._lock:
            return self._waiting > _FEWEST

    def _serve(self, source: Source, me: int) -> None:
        """Run the jobs that a source has, until one takes long."""
        with self._lock:
            if source.owner:
                return
            source.owner = me
            source.owned_since = math.inf  # the watch lets nobody else in while it is asked for a job
            self._waiting -= 1
            if source is self._queue and not self._waiting:
                self._grow()
        while (job := source.take()) is not None:
            kind, run = job
            refusal: BusyException | None = None
            began = time.monotonic()
            with self._lock:
                self._taken += 1
                source.owned_since = began
                if not kind.quick:
                    self._release(source)
                    if not self._waiting and not self._grow() and kind.refusable:
                        refusal = BusyException(_no_thread(self._shortage))
            try:
                run() if refusal is None else run(refusal)
            except BaseException:
                _logger.exception("internal error in %s", threading.current_thread().name)
            del job, run  # frees what they hold, a query for instance, before the next wait
            if refusal is None and kind is not _LONG_JOB:
                kind.quick = time.monotonic() - began < _QUICK
            with self._lock:
                if source.owner != me:
                    break
                source.owned_since = math.inf
        with self._lock:
            self._waiting += 1
            if source.owner == me:
                self._release(source)

    def _run_line(self, line: object) -> None:
        jobs = self.lines[line]
        try:
            with self.blocked():
                jobs[0]()
        finally:
            with self._lock:
                jobs.popleft()
                if jobs:
                    self.submit(partial(self._run_line, line))
                else:
                    del self.lines[line]


class Pulse:
    """Notice from missing beats that the process stood still.

    A process that was stopped (SIGSTOP, a debugger, a suspended machine) finds calls in the system's buffers
    whose callers gave up long ago. They look as if they had just arrived; only this class knows better.
    """

    def __init__(self) -> None:
        self.running_since = time.monotonic()
        """Data received now arrived after this moment of the monotonic clock, usually within 0.1 s."""
        self._last = math.inf
        self._doubtful_until = 0.0

    def beat(self) -> None:
        """Note that the process runs; to be called every PULSE_PERIOD s."""
        moment = time.clock_gettime(_CLOCK)
        pause, self._last = moment - self._last, moment
        if pause > _STANDSTILL:
            _logger.info("this process stood still for %.1f s", pause)
            self.running_since = time.monotonic() - pause
            self._doubtful_until = moment + _AFTERMATH
        elif moment >= self._doubtful_until:
            self.running_since = time.monotonic()


def repeat(period: float, job: Callable[[], object], name: str) -> Callable[[], object]:
    """Run a job every `period` s on a thread, also after it failed; return a function that ends it.

    Raises BusyException as `start` does.
    """
    end = threading.Event()

    def run() -> None:
        while not end.wait(period):
            try:
                job()
            except Exception:
                _logger.exception("internal error in %s", name)

    thread = threading.Thread(target=run, name=name, daemon=True)
    start(thread)

    def close() -> None:
        end.set()
        _join([thread], 2.0)

    return close


def _join(threads: Sequence[threading.Thread], timeout: float) -> bool:
    """Wait for the end of threads, but not of the current one; return whether they ended, or log an error."""
    deadline = time.monotonic() + timeout
    others = [thread for thread in threads if thread is not threading.current_thread()]
    for thread in others:
        thread.join(max(0.0, deadline - time.monotonic()))
    busy = [thread.name for thread in others if thread.is_alive()]
    if busy:
        _logger.error("%s still busy after %g s", ", ".join(busy), timeout)
    return not busy
