"""A virtual clock that wakes the threads of a test one at a time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

from zenoh_ice import VirtualClock, ZenohIceError

__all__ = ["ClockStalledException", "SteppedClock"]

_POLL: Final = 0.002  # s of wall time between checks of what notifies nobody: events, and threads that end
_NANOSECONDS: Final = 1_000_000_000


class ClockStalledException(ZenohIceError):
    """A stepped clock on which a thread waits is not advanced, or a woken thread does not return to it."""


class SteppedClock(VirtualClock):
    """A virtual clock for several threads, which moves only with `advance`.

    Threads that wait on it are woken in the order of their times (equal times: in the order in which they
    began to wait), one at a time: the next is woken, and the time moves on, only when the last one waits on
    the clock again or has ended. So a program runs the same way every time, as fast as the processor.

    `limit` bounds every wait in s of wall time: one that nobody ends raises ClockStalledException.
    """

    def __init__(self, start: float = 0.0, *, limit: float = 10.0) -> None:
        super().__init__(start)
        self.limit = limit
        self._changed = threading.Condition()
        self._waiters: dict[threading.Thread, tuple[int, threading.Event]] = {}
        """The times at which waiting threads are due, and the events that wake them earlier, in order."""

    @property
    def waiting(self) -> int:
        """Return the number of threads that wait on this clock."""
        return len(self._waiters)

    def wait_for_waiters(self, count: int) -> None:
        """Wait until at least `count` threads wait on this clock.

        Raises ClockStalledException after the limit.
        """
        with self._changed:
            self._wait_until(
                lambda: self.waiting >= count, lambda: f"{self.waiting} threads wait on it, not {count}"
            )

    def sleep(self, seconds: float) -> None:
        """Wait until another thread has advanced the clock by a duration in s."""
        self.wait(threading.Event(), seconds)

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event, or until the clock has advanced by `timeout` s; return whether it is set."""
        thread = threading.current_thread()
        with self._changed:
            due = self.moment + _nanoseconds(timeout)
            if due > self.moment and not event.is_set():
                self._waiters[thread] = due, event
                self._changed.notify_all()
                try:
                    self._wait_until(
                        lambda: thread not in self._waiters or event.is_set(),
                        lambda: f"nobody advanced it to {due / _NANOSECONDS:g} s",
                    )
                finally:
                    self._waiters.pop(thread, None)
        return event.is_set()

    def advance(self, seconds: float) -> None:
        """Advance the time by a duration in s, and wake the threads that are due.

        Raises ValueError for a negative duration, and ClockStalledException, naming the thread, when a woken
        thread neither waits on the clock again nor ends within the limit.
        """
        if seconds < 0:
            raise ValueError(f"a clock does not run backwards: advance({seconds})")
        with self._changed:
            end = self.moment + _nanoseconds(seconds)
            while (thread := min(self._waiters, key=self._due, default=None)) and self._due(thread) <= end:
                self.move_to(self._due(thread))
                del self._waiters[thread]
                self._changed.notify_all()
                self._wait_until(
                    lambda: thread in self._waiters or not thread.is_alive(),
                    lambda: f"thread {thread.name!r} did not come back after it was woken",
                )
            self.move_to(end)

    def _due(self, thread: threading.Thread) -> int:
        due, event = self._waiters[thread]
        return self.moment if event.is_set() else due

    def _wait_until(self, condition: Callable[[], bool], problem: Callable[[], str]) -> None:
        deadline = time.monotonic() + self.limit
        while not condition():
            if time.monotonic() > deadline:
                raise ClockStalledException(
                    f"stepped clock at {self.now():g} s: {problem()} within {self.limit:g} s"
                )
            self._changed.wait(_POLL)


def _nanoseconds(seconds: float) -> int:
    return round(seconds * _NANOSECONDS)
