"""The pool of threads of a communicator.

    channel, channel, ... (sources, with files) --+-- epoll -- free threads
    put, submit -- queue (a source, with a bell) -+
                     |
                     +-- one free thread, while there are others: it waits in the queue itself

A thread that gets a job runs it itself: nothing is handed from one thread to another.
docs/decisions/0008-one-pool.md compares this design with others, and says what happens when no further
thread can be started.
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
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, Final

from zenoh_ice.data.exceptions import BusyException
from zenoh_ice.data.text import sentence
from zenoh_ice.threads._starting import Pulse, UserCodeThread, join, no_thread, repeat
from zenoh_ice.threads.limits import LIMITS, Limits

_FEWEST: Final = 2  # free threads that stay: one waits for jobs, and one for files
MOST_QUEUED: Final = 1024  # jobs of one line
MOST_LINES: Final = 256
_COMPLAINT_PERIOD: Final = 10.0  # s between two reports that no thread can be started

# Each event goes to one thread. That of a source comes again once another thread may have it; the bell of the
# queue wakes a thread each time that it is rung.
_ONCE: Final = select.EPOLLIN | select.EPOLLONESHOT
_RING: Final = select.EPOLLIN | select.EPOLLET

_logger = logging.getLogger(__name__)


class JobKind:
    """Remember whether the last job of a kind, such as the calls of one method, was quick."""

    __slots__ = ("quick", "refusable")

    def __init__(self, *, quick: bool = False, refusable: bool = False) -> None:
        self.quick = quick
        self.refusable: Final = refusable
        """Its jobs may be refused: such a job takes the reason as an argument, and does no more."""


Job = tuple[JobKind, Callable[..., object]]

_LONG_JOB: Final = JobKind()
_WAKE: Final = object()  # in the queue: its owner need not wait there


class Source(ABC):
    """A file from which jobs are taken whenever it is readable, by one thread at a time: its owner."""

    owner = 0
    """Identifier of the thread; 0 while the pool waits for the file."""
    busy_since = math.inf
    """When the owner began to run a job; infinite while it takes one."""
    is_awaited = False
    """The owner waits for the next job: other threads are free."""
    file = -1
    """Its descriptor, while the pool has it."""

    @abstractmethod
    def fileno(self) -> int:
        """Return the descriptor of the file."""

    @abstractmethod
    def next_job(self) -> Job | None:
        """Return the next job; None if there is none, or no more. It does not wait, and raises nothing."""


class _Queue(Source):
    """The jobs that were put into a pool. Its file is a bell, to be rung when nobody owns it."""

    def __init__(self, pool: Pool) -> None:
        self.jobs: Final[SimpleQueue[Any]] = SimpleQueue()
        self._pool: Final = pool
        self._bell: Final = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)

    def fileno(self) -> int:
        return self._bell

    def ring(self) -> None:
        """Wake a thread, which owns it then."""
        os.eventfd_write(self._bell, 1)

    def next_job(self) -> Job | None:
        """Return the next job; wait for it if the pool has other free threads."""
        while True:
            with self._pool._lock:
                self.is_awaited = len(self._pool._free) >= _FEWEST
            try:
                job = self.jobs.get(self.is_awaited)
            except Empty:
                return None
            if type(job) is tuple:
                return job
            if job is None:
                self._pool._end()
                return None
            if job is not _WAKE and (job := self._pool.place(job)) is not None:
                return job

    def close(self) -> None:
        os.close(self._bell)


class Pool:
    """A pool that grows from one thread to a limit and never makes its callers wait.

    Jobs are submitted, or come from sources in their order. Before a job, its thread, the source's owner,
    does what the last job of the same kind suggests:

        quick  keep the source: the job ends before another thread would wake
        long   let the others have the source, and start another thread if too few are free

    If a quick one takes long for once, its source is given to the others at the next check of the watch.

    If the system gives the process no further thread, the last free one refuses the jobs that may be refused,
    and so stays free for those that may not, such as a stop. It waits for files; jobs that are put, and not
    submitted, its watch then finds at its next check. If nobody takes jobs any more, `on_stall` says so, and
    so it does when somebody does again.

    A pool of no threads, for tests in virtual time, runs each job at once on the thread that submits it.

    A transport may also `put` other objects, which `place` turns into jobs in the order in which they came.
    """

    def __init__(self, size: int, name: str, limits: Limits = LIMITS) -> None:
        """Start the first thread; raises BusyException where the system gives this process none."""
        self.has_threads: Final = size > 0
        self.pulse: Final = Pulse()
        self.stalled = False
        """Jobs wait, and none was taken for two seconds in which the process ran."""
        self.on_stall: Callable[[], object] = lambda: None
        """Called on the pool's watch whenever `stalled` changes."""
        self.place: Callable[[Any], Job | None] = lambda job: job
        """Turns other objects that are put into jobs, or None; it raises nothing."""
        self.checks: tuple[Callable[[], object], ...] = ()
        """Further checks of the watch; they raise nothing."""
        self._limits: Final = limits
        self._limit = size + 1  # while one waits for jobs, another one waits for files
        self._name: Final = name
        self._lock: Final = threading.Lock()
        self._queue: Final = _Queue(self)
        self.put: Final[Callable[[Any], None]] = self._queue.jobs.put
        """Queues a job, or an object that `place` makes one of; C code."""
        self._epoll: Final = select.epoll()
        self._epoll.register(self._queue, _RING)
        self._sources: Final[dict[int, Source]] = {self._queue.fileno(): self._queue}  # by file
        self._threads: Final[set[threading.Thread]] = set()
        self._free: Final[set[int]] = set()  # identifiers of those without a long job
        self._serials: Final = itertools.count(1)
        self._shortage: RuntimeError | None = None  # why a thread that is needed could not be started
        self._taken = self._seen = 0  # jobs, now and at the last check
        self._closed = False
        self._ended = False
        self.lines: Final[dict[object, deque[Callable[[], object]]]] = {}
        """Lines with waiting or running jobs: later ones must not overtake them."""
        self._checks_without_job = 0
        self._complained_at = -math.inf
        self._stop_watch: Callable[[], object] | None = None
        with self._lock:
            if self.has_threads and not self._grow():
                self._closed = True
                self._close_files()
                raise BusyException(no_thread(self._shortage))

    def watched_put(self) -> Callable[[Any], None]:
        """Return `put`; the pool finds what is put from now on. Raises BusyException as `start`."""
        with self._lock:
            self._watch()
        return self.put

    def submit(self, run: Callable[[], object], kind: JobKind | None = None) -> None:
        """Run a job as soon as a thread is free; after `close` it is dropped."""
        if not self.has_threads:
            run()
            return
        self.put((kind or _LONG_JOB, run))
        if not self._queue.owner:
            with self._lock:
                self._arrange()

    def submit_in_line(self, line: object, job: Callable[[], object]) -> None:
        """Run a job after the earlier ones of the same line; raises BusyException for too many."""
        if not self.has_threads:
            job()
            return
        with self._lock:
            jobs = self.lines.get(line, deque[Callable[[], object]]())
            # The first job of each line runs.
            waiting, most = (len(jobs) - 1, MOST_QUEUED) if jobs else (len(self.lines), MOST_LINES)
            if waiting >= most:
                raise BusyException(
                    sentence(f"{line}: {waiting} calls are already waiting; this one was not executed")
                )
            jobs.append(job)
            if len(jobs) > 1:
                return
            self.lines[line] = jobs
        self.submit(partial(self._run_line, line))

    def reserve(self, threads: int) -> None:
        """Let the pool have more threads, or fewer with a negative number, if it needs them."""
        with self._lock:
            self._limit += threads
            self._arrange()

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
                        self._give_up(source, me)
            yield
        finally:
            self.reserve(-1)

    def kind(self, *, refusable: bool = False) -> JobKind:
        """Return a new kind of jobs, such as the calls of one method; raises BusyException as `start`."""
        with self._lock:
            self._watch()
        return JobKind(refusable=refusable)

    def attach(self, source: Source) -> None:
        """Take jobs from a source from now on; raises BusyException as `start`."""
        with self._lock:
            self._watch()
            if not self._closed:
                self._epoll.register(source, _ONCE)
                source.file = source.fileno()
                self._sources[source.file] = source

    def detach(self, source: Source) -> None:
        """Take no more jobs from a source; to be called before its file is closed.

        Another thread may be in its `next_job` until that returns.
        """
        with self._lock:
            file, source.file = source.file, -1
            if file >= 0:
                del self._sources[file]
                source.owner = 0
                if not self._closed:
                    self._epoll.unregister(file)

    def close(self, timeout: float) -> bool:
        """End the threads once their jobs are done; return whether all ended within `timeout` s.

        The calling thread, if it is one of them, ends after it has returned from its job.
        """
        with self._lock:
            if not self._closed:
                self._closed = True
                self.put(None)
                self._arrange()
                self._close_files()
            threads = tuple(self._threads)
        if self._stop_watch is not None:
            self._stop_watch()
        return join(threads, timeout)

    # The threads.

    def _work(self) -> None:
        me = threading.get_ident()
        poll = self._epoll.poll
        try:
            while not self._ended:
                events = poll(self._limits.idle_thread, 1)
                if events:
                    self._serve(events[0][0], me)
                elif self._is_surplus():
                    return
        except BaseException:
            name = threading.current_thread().name
            _logger.exception("internal error ends %s; another thread takes its place", name)
        finally:
            with self._lock:
                self._threads.discard(threading.current_thread())
                self._free.discard(me)
                self._arrange()
                self._close_files()

    def _is_surplus(self) -> bool:
        """Return whether a free thread may end, which is then counted no more."""
        with self._lock:
            if len(self._free) <= _FEWEST:
                return False
            self._free.discard(threading.get_ident())
            return True

    def _serve(self, file: int, me: int) -> None:
        """Run the jobs that a source has, until one takes long, or other sources have waited."""
        with self._lock:
            source = self._sources.get(file)
            if source is None or source.owner:  # the event was late
                return
            source.owner = me
        began = time.monotonic()
        try:
            while (job := source.next_job()) is not None:
                kind, run = job
                self._taken += 1  # not exact, and need not be
                refusal: BusyException | None = None
                source.busy_since = start = time.monotonic()
                if not kind.quick:
                    with self._lock:
                        if not self._give_up(source, me) and kind.refusable and self._shortage is not None:
                            refusal = BusyException(no_thread(self._shortage))
                try:
                    run() if refusal is None else run(refusal)
                except BaseException:
                    _logger.exception("internal error in %s", threading.current_thread().name)
                if refusal is None and kind is not _LONG_JOB:
                    kind.quick = time.monotonic() - start < self._limits.quick_job
                del job, run  # frees what they hold, a query for instance, before the next wait
                with self._lock:
                    if source.owner != me:
                        break
                    if source.busy_since - began > self._limits.check_period and not source.is_awaited:
                        break
                    source.busy_since = math.inf
        finally:
            with self._lock:
                if source.owner == me:
                    self._release(source)
                self._free.add(me)
                if not self._queue.owner:
                    self._arrange()

    def _run_line(self, line: object) -> None:
        jobs = self.lines[line]
        try:
            with self.blocked():
                jobs[0]()
        finally:
            with self._lock:
                jobs.popleft()
                if not jobs:
                    del self.lines[line]
            if jobs:
                self.submit(partial(self._run_line, line))

    def _end(self) -> None:
        """Wake all threads that wait, so that they end."""
        with self._lock:
            self._ended = True
            self._epoll.modify(self._queue, select.EPOLLIN)
            self._queue.ring()

    # Who waits for what; with the lock.

    def _arrange(self) -> bool:
        """Let one free thread wait for files, and another one for jobs; return whether any is free.

        Starts the threads that are missing. A single one waits for files.
        """
        self._shortage = None
        while len(self._free) < _FEWEST and self._grow():
            pass
        queue = self._queue
        if len(self._free) >= _FEWEST:
            if not queue.owner:
                queue.ring()
        elif queue.is_awaited:
            queue.is_awaited = False
            self.put(_WAKE)
        elif self._free and not queue.owner and not queue.jobs.empty():
            queue.ring()
        return bool(self._free)

    def _grow(self) -> bool:
        """Start another thread; return whether one was started.

        At the limit, the next free thread is that whose job ends.
        """
        if len(self._threads) >= self._limit or self._closed or not self.has_threads:
            return False
        name = f"{self._name}-{next(self._serials)}"
        thread = UserCodeThread(target=self._work, name=name, daemon=True)
        try:
            thread.start()
        except RuntimeError as error:
            self._shortage = error
            return False
        self._threads.add(thread)
        assert thread.ident is not None  # it was started
        self._free.add(thread.ident)
        return True

    def _give_up(self, source: Source, thread: int) -> bool:
        """Let others have the source of a thread that is busy; return whether a thread is free."""
        self._free.discard(thread)
        if source.owner == thread:  # otherwise the watch was faster
            self._release(source)
        return self._arrange()

    def _release(self, source: Source) -> None:
        source.owner = 0
        source.busy_since = math.inf
        source.is_awaited = False
        if source.file >= 0 and not self._closed:
            self._epoll.modify(source.file, _ONCE)

    def _close_files(self) -> None:
        """Close the files after the last thread."""
        if self._closed and not self._threads:
            self._epoll.close()
            self._queue.close()

    # The watch.

    def _watch(self) -> None:
        """Begin to watch over the threads; with the lock."""
        if self._stop_watch is None and self.has_threads and not self._closed:
            self.pulse.beat()
            self._stop_watch = repeat(self._limits.check_period, self._check, f"{self._name} watch")

    def _check(self) -> None:
        self.pulse.beat()
        now = time.monotonic()
        with self._lock:
            for source in self._sources.values():
                if source.owner and now - source.busy_since > self._limits.check_period:
                    self._give_up(source, source.owner)
            self._arrange()  # also after a thread could not be started, or died
            shortage = self._shortage
        for check in self.checks:
            check()
        if shortage is not None and now - self._complained_at >= _COMPLAINT_PERIOD:
            self._complained_at = now
            _logger.error("%s refuses calls that may take long: %s", self._name, no_thread(shortage))
        self._check_for_stall()

    def _check_for_stall(self) -> None:
        # Counted in checks: there are none in a process that stands still, or waits for the interpreter.
        before = self._seen
        self._seen = self._taken
        waits = self._seen == before and self._jobs_wait()
        self._checks_without_job = self._checks_without_job + 1 if waits else 0
        stalled = self._checks_without_job >= self._limits.stalled_checks
        if stalled != self.stalled:
            self.stalled = stalled
            self.on_stall()

    def _jobs_wait(self) -> bool:
        """Return whether there are jobs, in the queue or, while no thread is free, in another source."""
        if not self._queue.jobs.empty():
            return True
        with self._lock:
            if self._free or len(self._sources) == 1:
                return False
            waiting = select.poll()
            for source in self._sources.values():
                if source is not self._queue:
                    waiting.register(source, select.POLLIN)
            return bool(waiting.poll(0))
