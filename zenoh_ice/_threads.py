"""The threads of a communicator: a pool, an event loop for coroutines, and a pulse.

All jobs of the pool go into one queue. If a thread takes a job and no other thread is waiting for the next,
it first starts one, up to a limit that counts every servant that may be busy: a slow servant thus delays no
other. Idle threads end. docs/decisions/0008-one-pool.md compares this design with a thread for each
servant.
"""

from __future__ import annotations

import itertools
import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Coroutine, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Final, TypeVar

from .exceptions import BusyException, CommunicatorDestroyedException

if TYPE_CHECKING:  # imported where it is needed: it loads slowly, and most programs have no coroutines
    import asyncio

V = TypeVar("V")

PULSE_PERIOD: Final = 0.02  # s between checks of the threads and of the clock

_IDLE_LIMIT: Final = 5.0  # s after which a thread ends that has nothing to do, unless it is the last
_MOST_QUEUED: Final = 1024  # jobs of one line
_MOST_LINES: Final = 256
_QUICK: Final = 0.0005  # s that a job takes at most while its thread leads
_CAUTION: Final = 1000  # jobs that count as long after one that was
_STANDSTILL: Final = 0.5  # s without a beat: more than a busy machine makes of the period
_AFTERMATH: Final = 1.0  # s until all that waited has been read

# The clock that runs while the machine is suspended, where the system has one.
_CLOCK: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)

_logger = logging.getLogger(__name__)


class Kind:
    """Remember whether jobs of a kind, such as the calls of one method, were quick."""

    __slots__ = ("caution",)

    def __init__(self, caution: float = 1) -> None:
        self.caution = caution
        """Number of further jobs that count as long; each quick one reduces it."""


Job = tuple[Kind, Callable[[], object]]

_LONG: Final = Kind(math.inf)


class UserCodeThread(threading.Thread):
    """A thread of a communicator that runs user code."""


class Pool:
    """A pool that grows from one thread to a limit and never makes its callers wait.

    One of them leads: it alone takes jobs out of the queue. Before it runs a job that may take long, it wakes
    another thread to lead. If jobs of the same kind were quick so far, it keeps the lead instead: waking a
    thread would take longer. If such a job takes long for once, the lead is handed on within PULSE_PERIOD.

    A pool of no threads, for tests in virtual time, runs each job at once on the thread that submits it.

    `jobs.put` takes a job; a transport may also put other objects there, which `place` turns into jobs: the
    `put` of the queue is C code, the cheapest that Zenoh's receiving thread can run.
    """

    def __init__(self, size: int, name: str) -> None:
        self.jobs: Final[SimpleQueue[Any]] = SimpleQueue()
        self.has_threads: Final = size > 0
        self.pulse: Final = Pulse()
        self._limit = size
        self._name: Final = name
        self.place: Callable[[Any], Job | None] = lambda job: job
        """Turns other objects in the queue into jobs, or None, in the queue's order; it raises nothing."""
        self._lock: Final = threading.Lock()
        self._lead: Final = threading.Lock()  # of the thread that takes jobs
        self._leader = 0  # its identifier; 0: nobody leads, or a thread is about to
        self._began = 0.0  # the start of the job that it runs; 0: it waits for one
        self._idle = 0
        self._threads: Final[set[threading.Thread]] = set()
        self._serials: Final = itertools.count(1)
        self._closed = False
        self.lines: Final[dict[object, deque[Callable[[], object]]]] = {}
        """Lines with waiting or running jobs: later ones must not overtake them."""
        self._stop_watch: Callable[[], object] | None = None
        self._hand_on()

    def submit(self, run: Callable[[], object], kind: Kind | None = None) -> None:
        """Run a job as soon as a thread is free; after `close` it is dropped."""
        if self.has_threads:
            self.jobs.put((kind or _LONG, run))
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
            if not self._leader:
                self._hand_on()

    @contextmanager
    def blocked(self) -> Iterator[None]:
        """Give the pool one more thread while one of its threads waits for another."""
        if threading.current_thread() not in self._threads:
            yield
            return
        self.reserve(1)
        try:
            with self._lock:
                if self._leader == threading.get_ident():
                    self._hand_on()
            yield
        finally:
            self.reserve(-1)

    def kind(self) -> Kind:
        """Return a new kind of jobs, such as the calls of one method."""
        with self._lock:
            if self._stop_watch is None and self.has_threads and not self._closed:
                self.pulse.beat()
                self._stop_watch = repeat(PULSE_PERIOD, self._look, f"{self._name} watch")
        return Kind()

    def close(self, timeout: float) -> bool:
        """End the threads once their jobs are done; return whether all ended within `timeout` s.

        The calling thread, if it is one of them, ends after it has returned from its job.
        """
        with self._lock:
            self._closed = True
            threads = tuple(self._threads)
        if self._stop_watch is not None:
            self._stop_watch()
        self.jobs.put(None)
        return _join(threads, timeout)

    def _hand_on(self) -> None:
        """Let another thread lead, a new one if none is idle and the limit allows; with the lock."""
        if self._leader:
            self._leader, self._began = 0, 0.0
            self._lead.release()
        if self._idle > 0 or self._closed or not self.has_threads or len(self._threads) >= self._limit:
            return
        name = f"{self._name}-{next(self._serials)}"
        thread = UserCodeThread(target=self._work, name=name, daemon=True)
        thread.start()
        self._threads.add(thread)
        self._idle += 1

    def _look(self) -> None:
        self.pulse.beat()
        with self._lock:
            if self._began and time.monotonic() - self._began > _QUICK:
                self._hand_on()

    def _work(self) -> None:
        me, lock, get = threading.get_ident(), self._lock, self.jobs.get
        try:
            while True:
                if self._leader != me:
                    leads = self._lead.acquire(timeout=_IDLE_LIMIT)
                    with lock:
                        if leads:
                            self._leader = me
                        elif not self._leader:  # a thread is about to lead: this one, if no other
                            continue
                        self._idle -= 1
                        if not leads:
                            return
                job = get()
                if job is None:  # the end, for the next thread, too
                    self.jobs.put(None)
                    self._lead.release()
                    return
                if type(job) is not tuple and (job := self.place(job)) is None:
                    continue
                kind, run = job
                began = time.monotonic()
                with lock:
                    if kind.caution:
                        self._hand_on()
                    else:
                        self._began = began
                try:
                    run()
                except BaseException:
                    _logger.exception("internal error in %s", threading.current_thread().name)
                del job, run  # frees what they hold, a query for instance, before the next wait
                if time.monotonic() - began > _QUICK:
                    kind.caution = max(kind.caution, _CAUTION)
                elif kind.caution:
                    kind.caution -= 1
                with lock:
                    if self._leader == me:
                        self._began = 0.0
                    else:
                        self._idle += 1
        finally:
            with lock:
                self._threads.discard(threading.current_thread())

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


class Coroutines:
    """Run coroutines on one thread, which starts with the first of them."""

    def __init__(self, name: str) -> None:
        self._name: Final = name
        self._lock: Final = threading.Lock()
        self._running: tuple[asyncio.AbstractEventLoop, threading.Thread] | None = None
        self._closed = False

    def run(self, coroutine: Coroutine[Any, Any, V]) -> Future[V]:
        """Begin a coroutine and return the future of its outcome.

        Raises CommunicatorDestroyedException after `close`.
        """
        import asyncio

        with self._lock:
            if self._closed:
                coroutine.close()  # otherwise Python warns that it was never awaited
                raise CommunicatorDestroyedException("the communicator was destroyed")
            if self._running is None:
                runner = asyncio.Runner(loop_factory=asyncio.new_event_loop)
                thread = UserCodeThread(target=self._work, args=(runner,), name=self._name, daemon=True)
                self._running = runner.get_loop(), thread
                thread.start()
            return asyncio.run_coroutine_threadsafe(coroutine, self._running[0])

    def close(self, timeout: float) -> None:
        """Cancel the coroutines that run and end the thread; log an error after `timeout` s."""
        with self._lock:
            self._closed, running = True, self._running
        if running is not None:
            loop, thread = running
            loop.call_soon_threadsafe(loop.stop)
            _join([thread], timeout)

    def _work(self, runner: asyncio.Runner) -> None:
        with runner:  # at its end it cancels what still runs
            while not self._closed:
                try:
                    runner.get_loop().run_forever()
                except BaseException:  # one that exits must not end all the others
                    _logger.exception("a coroutine tried to stop %s", self._name)


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
    """Run a job every `period` s on a thread; return a function that ends it."""
    end = threading.Event()

    def run() -> None:
        while not end.wait(period):
            job()

    thread = threading.Thread(target=run, name=name, daemon=True)
    thread.start()

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
