"""Threads that run the callbacks of a node, which Zenoh's threads must not wait for."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from queue import SimpleQueue
from typing import Final, Generic, TypeVar

from ._refusals import Refusals
from .exceptions import RosError

_JOIN_LIMIT: Final = 2.0  # s

_logger = logging.getLogger(__name__)

Job = Callable[[], object]
_T = TypeVar("_T")


class Workers:
    """A few threads, started when needed, that run the jobs of all lines.

    Where the system gives the process no further thread, jobs wait for those that run, or for the next try.
    """

    def __init__(self, name: str, most: int = 8, *, at_once: bool = False) -> None:
        """Have at most `most` threads; with `at_once` the first one now, or raise RosError."""
        self.name: Final = name
        self._most: Final = most
        self._jobs: Final[SimpleQueue[Job | None]] = SimpleQueue()
        self._lock: Final = threading.Lock()
        self._threads: Final[list[threading.Thread]] = []
        self._unfinished = 0  # jobs that wait or run
        self._shortage: Final = Refusals(name, "callbacks are late")
        self._closed = False
        if at_once:
            try:
                self._start()
            except RuntimeError as error:
                raise RosError(f"{name}: {error}") from error

    def submit(self, job: Job) -> None:
        """Run a job as soon as a thread is free; after `close` it is dropped."""
        with self._lock:
            if self._closed:
                return
            self._unfinished += 1
            if len(self._threads) < min(self._unfinished, self._most):
                try:
                    self._start()
                except RuntimeError as error:
                    self._shortage.add(error)
        self._jobs.put(job)

    def close(self) -> None:
        """End the threads; callbacks that take longer than two seconds are left behind, and reported."""
        with self._lock:
            self._closed = True
            threads = [*self._threads]
        for _ in threads:
            self._jobs.put(None)
        if busy := join_all(threads):
            _logger.error("%s: %d callbacks are still busy after %g s", self.name, busy, _JOIN_LIMIT)

    def call(self, job: Job) -> None:
        """Run a job on this thread; its exception is logged, and must not end the thread."""
        try:
            job()
        except Exception:
            _logger.exception("%s: a callback failed", self.name)

    def _start(self) -> None:
        thread = threading.Thread(target=self._work, name=self.name, daemon=True)
        thread.start()
        self._threads.append(thread)  # not earlier: one that could not be started cannot be joined

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None and not self._closed:
            self.call(job)
            with self._lock:
                self._unfinished -= 1


class Line(Generic[_T]):
    """What waits for one subscription or service, to be handled one after another."""

    def __init__(self, workers: Workers, most: int, handle: Callable[[_T], object]) -> None:
        self._workers: Final = workers
        self._most: Final = most
        self._handle: Final = handle
        self._waiting: Final[deque[_T]] = deque()
        self._lock: Final = threading.Lock()
        self._running = False

    def put(self, item: _T) -> _T | None:
        """Add an item; when too many wait, return the oldest one, which will not be handled."""
        with self._lock:
            dropped = self._waiting.popleft() if len(self._waiting) >= self._most else None
            self._waiting.append(item)
            if self._running:
                return dropped
            self._running = True
        self._workers.submit(self._run)
        return dropped

    def _run(self) -> None:
        with self._lock:
            item = self._waiting.popleft()
        self._workers.call(partial(self._handle, item))
        with self._lock:
            self._running = bool(self._waiting)
        if self._running:
            self._workers.submit(self._run)  # behind the jobs of the others


def join_all(threads: Iterable[threading.Thread]) -> int:
    """Wait up to two seconds for the end of all threads except this one; return how many still run."""
    deadline = time.monotonic() + _JOIN_LIMIT
    others = [each for each in threads if each is not threading.current_thread()]
    for each in others:
        each.join(max(0.0, deadline - time.monotonic()))
    return sum(each.is_alive() for each in others)
