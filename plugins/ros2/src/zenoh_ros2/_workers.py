"""The order of a node's callbacks, which Zenoh's threads must not wait for: pools run them."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from typing import Final, Generic, TypeVar

from zenoh_ice import BusyException
from zenoh_ice.objects.callbacks import notify_of_failure
from zenoh_ice.threads.pool import Pool

from .exceptions import RosError

END_LIMIT: Final = 2.0
"""The longest wait in s for the end of threads; callbacks that take longer are left behind, and reported."""

_logger = logging.getLogger(__name__)

Job = Callable[[], object]
_T = TypeVar("_T")


def make_pool(size: int, name: str) -> Pool:
    """Return a pool, which has its first thread; raises RosError where the system gives this process none."""
    try:
        return Pool(size, name)
    except BusyException as error:
        raise RosError(f"{name}: {error}") from error


class Line(Generic[_T]):
    """What waits for one subscription or service, to be handled one after another."""

    def __init__(self, name: str, pool: Pool, most: int, handle: Callable[[_T], object]) -> None:
        """Let a pool handle what is put, of which at most some wait; the name is for the log."""
        self._name: Final = name
        self._pool: Final = pool
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
        self._pool.submit(self._run)
        return dropped

    def _run(self) -> None:
        with self._lock:
            item = self._waiting.popleft()
        try:
            self._handle(item)
        except BaseException as error:
            _logger.exception("%s: a callback failed", self._name)
            notify_of_failure(error)
        with self._lock:
            self._running = bool(self._waiting)
        if self._running:
            self._pool.submit(self._run)  # behind the jobs of the others


def join_all(threads: Iterable[threading.Thread]) -> int:
    """Wait up to two seconds for the end of all threads except this one; return how many still run."""
    deadline = time.monotonic() + END_LIMIT
    others = [each for each in threads if each is not threading.current_thread()]
    for each in others:
        each.join(max(0.0, deadline - time.monotonic()))
    return sum(each.is_alive() for each in others)
