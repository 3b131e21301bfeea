"""The threads of a communicator: a pool, and a pulse.

All jobs of the pool go into one queue. If a thread takes a job and no other thread is waiting for the next,
it first starts one, up to a limit that counts every servant that may be busy: a slow servant thus delays no
other. Idle threads end. docs/decisions/0008-one-pool.md compares this design with a thread for each
servant, and says what happens when no further thread can be started.
"""

from __future__ import annotations

import itertools
import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from queue import SimpleQueue
from typing import Any, Final

from .exceptions import BusyException

PULSE_PERIOD: Final = 0.02  # s between checks of the threads and of the clock

_IDLE_LIMIT: Final = 5.0  # s after which a thread ends that has nothing to do
_SPARE: Final = 1  # idle threads that stay beside the one that leads
_MOST_QUEUED: Final = 1024  # jobs of one line
_MOST_LINES: Final = 256
_QUICK: Final = 0.0005  # s that a job takes at most while its thread leads
_CAUTION: Final = 1000  # jobs that count as long after one that was
_STALLED: Final = 100  # looks, 2 s, in which jobs wait and none is taken
_COMPLAINT_PERIOD: Final = 10.0  # s between two reports that no thread can be started
_STANDSTILL: Final = 0.5  # s without a beat: more than a busy machine makes of the period
_AFTERMATH: Final = 1.0  # s until all that waited has been read

# The clock that runs while the machine is suspended, where the system has one.
_CLOCK: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)

_logger = logging.getLogger(__name__)


class Kind:
    """Remember whether jobs of a kind, such as the calls of one method, were quick."""

    __slots__ = ("caution", "refusable")

    def __init__(self, caution: float = 1, *, refusable: bool = False) -> None:
        self.caution = caution
        """Number of further jobs that count as long; each quick one reduces it."""
        self.refusable: Final = refusable
        """Whether its jobs may be refused: such a job takes the reason as an argument, and does no more."""


Job = tuple[Kind, Callable[..., object]]

_LONG_JOB: Final = Kind(math.inf)


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
    """A pool that grows from one thread to a limit and never makes its callers wait.

    One of them leads: it alone takes jobs out of the queue. Before it runs a job that may take long, it wakes
    another thread to lead. If jobs of the same kind were quick so far, it keeps the lead instead: waking a
    thread would take longer. If such a job takes long for once, the lead is handed on within PULSE_PERIOD.

    If the system gives the process no further thread, the leader refuses the jobs that may be refused, and so
    stays free for those that may not, such as a stop. A spare thread stays idle: until it is busy, nothing is
    refused. If nobody takes jobs any more, `on_stall` says so, and so it does when somebody does again.

    A pool of no threads, for tests in virtual time, runs each job at once on the thread that submits it.

    `jobs.put` takes a job; a transport may also put other objects there, which `place` turns into jobs: the
    `put` of the queue is C code, the cheapest that Zenoh's receiving thread can run.
    """

    def __init__(self, size: int, name: str) -> None:
        """Start the first thread; raises BusyException where the system gives this process none."""
        self.jobs: Final[SimpleQueue[Any]] = SimpleQueue()
        self.has_threads: Final = size > 0
        self.pulse: Final = Pulse()
        self.stalled = False
        """Whether jobs wait, and none was taken for two seconds in which the process ran."""
        self.on_stall: Callable[[], object] = lambda: None
        """Called on the pool's watch whenever `stalled` changes."""
        self.place: Callable[[Any], Job | None] = lambda job: job
        """Turns other objects in the queue into jobs, or None, in the queue's order; it raises nothing."""
        self._limit = size
        self._name: Final = name
        self._lock: Final = threading.Lock()
        self._lead: Final = threading.Lock()  # of the thread that takes jobs
        self._leader = 0  # its identifier; 0: nobody leads, or a thread is about to
        self._began = 0.0  # the start of the job that it runs; 0: it waits for one
        self._idle: Final[set[int]] = set()  # identifiers of threads
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
        with self._lock:
            started = self._has_successor()
        if not started:
            raise BusyException(_no_thread(self._shortage))

    def submit(self, run: Callable[[], object], kind: Kind | None = None) -> None:
        """Run a job as soon as a thread is free; after `close` it is dropped."""
        if self.has_threads:
            self.jobs.put((kind or _LONG_JOB, run))
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
                self._has_successor()

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
                    self._has_successor()
                    self._step_down()  # without one, too: the next thread that is free will lead
            yield
        finally:
            self.reserve(-1)

    def kind(self, *, refusable: bool = False) -> Kind:
        """Return a new kind of jobs, such as the calls of one method; raises BusyException as `start`."""
        with self._lock:
            if self._stop_watch is None and self.has_threads and not self._closed:
                self.pulse.beat()
                self._stop_watch = repeat(PULSE_PERIOD, self._look, f"{self._name} watch")
        return Kind(refusable=refusable)

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

    def _has_successor(self) -> bool:
        """Return whether a thread can lead after the one that does; start it if none is idle. With the lock.

        At the limit, that is the next thread whose job ends.
        """
        at_limit = len(self._threads) >= self._limit
        if self._idle or at_limit or self._closed or not self.has_threads:
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
        assert thread.ident is not None  # it was started
        self._idle.add(thread.ident)
        return True

    def _step_down(self) -> None:
        """Let another thread lead; with the lock."""
        if self._leader:
            self._leader, self._began = 0, 0.0
            self._lead.release()

    def _look(self) -> None:
        self.pulse.beat()
        with self._lock:
            if self._began and time.monotonic() - self._began > _QUICK:
                self._step_down()
            # The spare thread, or one that could not be started or died.
            self._has_successor()
            shortage = self._shortage
        now = time.monotonic()
        if shortage is not None and now - self._complained_at >= _COMPLAINT_PERIOD:
            self._complained_at = now
            _logger.error("%s refuses calls that may take long: %s", self._name, _no_thread(shortage))
        self._look_for_stall()

    def _look_for_stall(self) -> None:
        # Counted in looks: in a process that stands still, or waits for the interpreter, nobody looks either.
        before = self._seen
        self._seen = self._taken
        waits = not self.jobs.empty()
        self._looks_without_job = self._looks_without_job + 1 if waits and self._seen == before else 0
        stalled = self._looks_without_job >= _STALLED
        if stalled != self.stalled:
            self.stalled = stalled
            self.on_stall()

    def _work(self) -> None:
        me = threading.get_ident()
        lock = self._lock
        get = self.jobs.get
        try:
            while self._leader == me or self._take_lead(me):
                job = get()
                if job is None:  # the end, for the next thread, too
                    self.jobs.put(None)
                    return
                self._taken += 1
                if type(job) is not tuple and (job := self.place(job)) is None:
                    continue
                kind, run = job
                refusal: BusyException | None = None
                began = time.monotonic()
                with lock:
                    if not kind.caution:
                        self._began = began
                    elif not self._has_successor() and kind.refusable:
                        refusal = BusyException(_no_thread(self._shortage))
                    else:
                        self._step_down()
                try:
                    run() if refusal is None else run(refusal)
                except BaseException:
                    _logger.exception("internal error in %s", threading.current_thread().name)
                del job, run  # frees what they hold, a query for instance, before the next wait
                if refusal is not None:
                    continue
                if time.monotonic() - began > _QUICK:
                    kind.caution = max(kind.caution, _CAUTION)
                elif kind.caution:
                    kind.caution -= 1
                with lock:
                    if self._leader == me:
                        self._began = 0.0
                    else:
                        self._idle.add(me)
        except BaseException:
            name = threading.current_thread().name
            _logger.exception("internal error ends %s; another thread takes its place", name)
        finally:
            with lock:
                self._threads.discard(threading.current_thread())
                self._idle.discard(me)
                if self._leader == me:
                    self._step_down()
                    self._has_successor()

    def _take_lead(self, me: int) -> bool:
        """Wait until this thread leads; return false if it is not needed any more."""
        while True:
            leads = self._lead.acquire(timeout=_IDLE_LIMIT)
            with self._lock:
                if leads:
                    self._leader = me
                elif not self._leader or len(self._idle) <= _SPARE:  # this one may be about to lead
                    continue
                self._idle.discard(me)
                return leads

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
