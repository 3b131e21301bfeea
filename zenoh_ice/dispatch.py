"""Threads that run callbacks and calls within the process: a bounded pool, and lanes that keep an order."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Final

from .exceptions import BusyException, ObjectNotExistException

__all__ = ["Dispatcher", "Lane", "is_marked_thread", "mark_thread"]

Job = Callable[[], object]

_logger = logging.getLogger(__name__)


class _Context(threading.local):
    """What the current thread is."""

    dispatcher: Dispatcher | None = None
    runs_user_code = False


_context: Final = _Context()


def mark_thread() -> None:
    """Note that the current thread is one of a communicator's that runs user code."""
    _context.runs_user_code = True


def is_marked_thread() -> bool:
    """Return whether the current thread is one of a communicator's that runs user code."""
    return _context.runs_user_code


class Dispatcher:
    """A pool that grows from none to `max_threads` threads and never makes its callers wait."""

    def __init__(self, max_threads: int, name: str) -> None:
        self._limit = max_threads
        self._name: Final = name
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._threads: set[threading.Thread] = set()
        self._idle = 0
        self._started = 0
        self._closed = False
        self._grow()

    def submit(self, job: Job) -> None:
        """Run a job on one of the threads, as soon as one is free; after `close` it is dropped."""
        self._jobs.put(job)

    @contextmanager
    def blocked(self) -> Iterator[None]:
        """Let the pool have one thread more while one of its own waits for another."""
        if not self.is_own_thread():
            yield
            return
        with self._lock:
            self._limit += 1
        self._grow()
        try:
            yield
        finally:
            with self._lock:
                self._limit -= 1

    def is_own_thread(self) -> bool:
        """Return whether the current thread belongs to the pool."""
        return _context.dispatcher is self

    def close(self, timeout: float) -> bool:
        """End the threads once their current jobs are done; return whether all ended within `timeout` s.

        The calling thread, if it is one of them, ends after it has returned from its job.
        """
        with self._lock:
            self._closed = True
            threads = [thread for thread in self._threads if thread is not threading.current_thread()]
        self._jobs.put(None)
        deadline = time.monotonic() + timeout
        for thread in threads:
            thread.join(max(0.0, deadline - time.monotonic()))
        busy = [thread.name for thread in threads if thread.is_alive()]
        if busy:
            _logger.error("%s still busy after %g s", ", ".join(busy), timeout)
        return not busy

    def _grow(self) -> None:
        """Start a thread if none is idle and the limit allows: somebody always waits for the next job."""
        with self._lock:
            if self._closed or self._idle > 0 or len(self._threads) >= self._limit:
                return
            self._started += 1
            thread = threading.Thread(target=self._work, name=f"{self._name}-{self._started}", daemon=True)
            thread.start()  # first: if Ctrl-C strikes here, what was not started must not be waited for
            self._threads.add(thread)
            self._idle += 1

    def _work(self) -> None:
        _context.dispatcher = self
        mark_thread()
        try:
            while True:
                job = self._jobs.get()
                if job is None:
                    self._jobs.put(None)  # for the next thread
                    return
                with self._lock:
                    self._idle -= 1
                    grow = self._idle == 0
                if grow:
                    self._grow()
                try:
                    job()
                except BaseException:
                    _logger.exception("internal error in %s", threading.current_thread().name)
                job = None  # frees what it holds, a query for instance, before the next wait
                with self._lock:
                    if len(self._threads) > self._limit and self._idle > 0:
                        return
                    self._idle += 1
        finally:
            with self._lock:
                self._threads.discard(threading.current_thread())


class Lane:
    """The calls of one servant from this process: `width` at a time, in order, at most `depth` waiting."""

    def __init__(self, dispatcher: Dispatcher, name: str, *, width: int = 1, depth: int = 64) -> None:
        self._dispatcher: Final = dispatcher
        self._name: Final = name
        self._width: Final = width
        self._depth: Final = depth
        self._condition = threading.Condition()
        self._waiting: deque[tuple[Job, Job | None]] = deque()
        self._running = 0
        self._closed = False

    def submit(self, job: Job, dropped: Job | None = None) -> None:
        """Run a job after those before it, or `dropped` if it is still waiting when `drop` is called.

        Raises BusyException when too many wait, ObjectNotExistException after `close`.
        """
        with self._condition:
            if self._closed:
                raise ObjectNotExistException(f"{self._name} is no longer served")
            if self._running >= self._width:
                if len(self._waiting) >= self._depth:
                    raise BusyException(
                        f"{self._name}: {len(self._waiting)} calls wait already; this one was not executed"
                    )
                self._waiting.append((job, dropped))
                return
            self._running += 1
        self._dispatcher.submit(lambda: self._run(job))

    def close(self, timeout: float, *, expected: int = 0) -> bool:
        """Take no more jobs, run those that wait, and return whether all but `expected` ended in time."""
        with self._condition:
            self._closed = True
            return self._condition.wait_for(lambda: self._running <= expected, timeout)

    def drop(self) -> None:
        """Forget the jobs that wait."""
        with self._condition:
            waiting, self._waiting = self._waiting, deque()
        for _, dropped in waiting:
            if dropped is not None:
                dropped()

    def _run(self, job: Job) -> None:
        try:
            job()
        finally:
            with self._condition:
                following = self._waiting.popleft()[0] if self._waiting else None
                if following is None:
                    self._running -= 1
                    if self._closed:
                        self._condition.notify_all()
            if following is not None:
                # Through the pool's queue again, so that other servants get their turn in between.
                self._dispatcher.submit(lambda: self._run(following))
