"""The threads of a communicator: a pool that runs calls, callbacks and the settling of futures.

Jobs go into one queue. A thread that takes one and leaves nobody to wait for the next starts another thread
first, up to a limit that counts every servant that may be busy: so a slow servant delays no other. Threads
that have nothing to do end. docs/decisions/0008-one-pool.md compares this with a thread for each servant.
"""

from __future__ import annotations

import itertools
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, Final

from .exceptions import BusyException

__all__ = ["Job", "Pool", "is_marked_thread", "mark_thread"]

Job = Callable[[], object]

_IDLE_LIMIT: Final = 5.0  # s after which a thread ends that has nothing to do, unless it is the last
_MOST_QUEUED: Final = 1024  # jobs of one line
_MOST_LINES: Final = 256

_logger = logging.getLogger(__name__)


class _Context(threading.local):
    """What the current thread is."""

    pool: Pool | None = None
    runs_user_code = False


_context: Final = _Context()


def mark_thread() -> None:
    """Note that the current thread is one of a communicator's that runs user code."""
    _context.runs_user_code = True


def is_marked_thread() -> bool:
    """Return whether the current thread is one of a communicator's that runs user code."""
    return _context.runs_user_code


class Pool:
    """Threads that grow from one to a limit and never make their callers wait.

    A pool of no threads, for tests in virtual time, runs each job at once on the thread that submits it.

    `jobs.put` takes a job; a transport may put other objects there, too, of which `place` makes jobs: the
    `put` of the queue is C code, the cheapest that Zenoh's receiving thread can run.
    """

    def __init__(self, size: int, name: str) -> None:
        self.jobs: Final[SimpleQueue[Any]] = SimpleQueue()
        self._limit = size
        self._inline: Final = size == 0
        self._name: Final = name
        self._places: Final[dict[type, Callable[[Any], Job | None]]] = {}
        self._order: Final = threading.Lock()
        self._numbers: Final = itertools.count()
        self._next = 0
        self._early: Final[dict[int, Callable[[], Job | None] | None]] = {}
        self._lock: Final = threading.Lock()
        self._threads: set[threading.Thread] = set()
        self._idle = 0
        self._started = 0
        self._closed = False
        self._lines: dict[object, deque[Job]] = {}
        self._grow()

    @property
    def has_threads(self) -> bool:
        """Whether jobs run on threads of the pool."""
        return not self._inline

    def place(self, kind: type, place: Callable[[Any], Job | None]) -> None:
        """Let a function make jobs, or None, of the objects of a type that are put among the jobs.

        It is called in the order in which they were put, whichever threads run the jobs.
        """
        self._places[kind] = place

    def submit(self, job: Job) -> None:
        """Run a job as soon as a thread is free; after `close` it is dropped."""
        if self._inline:
            job()
        else:
            self.jobs.put(job)

    def submit_in_line(self, line: object, job: Job) -> None:
        """Run a job after those that were submitted in the same line; raises BusyException for too many."""
        if self._inline:
            job()
            return
        with self._lock:
            queue = self._lines.get(line)
            if queue is None:
                if len(self._lines) >= _MOST_LINES:
                    raise BusyException(
                        f"{line}: {_MOST_LINES} others wait already; this call was not executed"
                    )
                self._lines[line] = deque()
            elif len(queue) >= _MOST_QUEUED:
                raise BusyException(f"{line}: {_MOST_QUEUED} calls wait already; this one was not executed")
            else:
                queue.append(job)
                return
        self.jobs.put(lambda: self._run_line(line, job))

    def holds_line(self, line: object) -> bool:
        """Return whether jobs of a line wait or run: later ones must not overtake them."""
        return line in self._lines

    def reserve(self, threads: int) -> None:
        """Let the pool have more threads, or fewer with a negative number, if it needs them."""
        with self._lock:
            self._limit += threads
        if threads > 0:
            self._grow()

    @contextmanager
    def blocked(self) -> Iterator[None]:
        """Let the pool have one thread more while one of its own waits for another."""
        if _context.pool is not self:
            yield
            return
        self.reserve(1)
        try:
            yield
        finally:
            self.reserve(-1)

    def close(self, timeout: float) -> bool:
        """End the threads once their jobs are done; return whether all ended within `timeout` s.

        The calling thread, if it is one of them, ends after it has returned from its job.
        """
        with self._lock:
            self._closed = True
            threads = [thread for thread in self._threads if thread is not threading.current_thread()]
        self.jobs.put(None)
        deadline = time.monotonic() + timeout
        for thread in threads:
            thread.join(max(0.0, deadline - time.monotonic()))
        busy = [thread.name for thread in threads if thread.is_alive()]
        if busy:
            _logger.error("%s still busy after %g s", ", ".join(busy), timeout)
        return not busy

    def _grow(self) -> None:
        """Start a thread if none is idle and the limit allows."""
        with self._lock:
            if self._closed or self._inline or self._idle > 0 or len(self._threads) >= self._limit:
                return
            self._started += 1
            thread = threading.Thread(target=self._work, name=f"{self._name}-{self._started}", daemon=True)
            thread.start()
            self._threads.add(thread)
            self._idle += 1

    def _work(self) -> None:
        _context.pool = self
        mark_thread()
        jobs, lock = self.jobs, self._lock
        # One step of C code takes a job and its number: no other thread gets the interpreter in between, so
        # the numbers are in the order of the queue. `slice` makes the pair.
        take = map(slice, iter(partial(jobs.get, timeout=_IDLE_LIMIT), self), self._numbers).__next__
        try:
            while True:
                try:
                    taken = take()
                except Empty:
                    with lock:
                        if self._idle > 1:
                            self._idle -= 1
                            return
                    continue
                job = self._in_order(taken.stop, taken.start)
                if taken.start is None:
                    jobs.put(None)  # for the next thread
                    return
                with lock:
                    self._idle -= 1
                    grow = self._idle == 0
                if grow:
                    self._grow()
                try:
                    if job is not None:
                        job()
                except BaseException:
                    _logger.exception("internal error in %s", threading.current_thread().name)
                del job, taken  # frees what they hold, a query for instance, before the next wait
                with lock:
                    self._idle += 1
        finally:
            with lock:
                self._threads.discard(threading.current_thread())

    def _in_order(self, number: int, taken: Any) -> Job | None:  # noqa: ANN401 - a job, or what becomes one
        """Return the job of what was taken; None where that has to wait for what was put before it."""
        place = self._places.get(type(taken))
        with self._order:
            if number != self._next:
                # Another thread has what comes before it, and goes on with it.
                self._early[number] = None if place is None else partial(place, taken)
                return taken if place is None else None
            self._next += 1
            job: Job | None = taken if place is None else place(taken)
            while self._next in self._early:
                following = self._early.pop(self._next)
                self._next += 1
                if following is not None and (late := following()) is not None:
                    self.jobs.put(late)
        return job

    def _run_line(self, line: object, job: Job) -> None:
        try:
            with self.blocked():
                job()
        finally:
            with self._lock:
                queue = self._lines[line]
                following = queue.popleft() if queue else None
                if following is None:
                    del self._lines[line]
            if following is not None:
                after = following
                self.jobs.put(lambda: self._run_line(line, after))
