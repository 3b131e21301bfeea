"""Clocks: what a component sleeps by and measures time with.

`WallClock` is steady wall time, `VirtualClock` stands still until a test advances it, and
`zenoh_ice.clocks.robot_clock.RobotClock` follows the robot's time.
"""

from __future__ import annotations

import threading
import time
from typing import Final, Protocol, runtime_checkable

from ..exceptions import ZenohIceError

__all__ = ["Clock", "ClockStalledException", "VirtualClock", "WallClock"]

_POLL: Final = 0.002  # s of wall time between looks at what cannot notify us: events, and threads that end
_NANOSECONDS: Final = 1_000_000_000


class ClockStalledException(ZenohIceError):
    """Nobody advances a virtual clock that a thread waits on, or a woken thread does not come back to it."""


@runtime_checkable
class Clock(Protocol):
    """Tell the time and wait by it."""

    @property
    def rate(self) -> float:
        """Return the seconds of this clock that pass in a second of wall time."""

    @property
    def simulated(self) -> bool:
        """Return whether the time is that of a simulation."""

    def now(self) -> float:
        """Return the time in s; it never runs backwards, except when a simulation starts anew."""

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s; a negative one is none."""

    def sleep_until(self, when: float) -> None:
        """Wait until the clock shows a time in s; a past one returns at once."""

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s of this clock; return whether it is set."""


class WallClock:
    """Steady wall time in s, from an arbitrary start: changes of the system's date do not move it."""

    rate: Final = 1.0
    simulated: Final = False

    def now(self) -> float:
        """Return the time in s."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s."""
        time.sleep(max(0.0, seconds))

    def sleep_until(self, when: float) -> None:
        """Wait until a time in s."""
        self.sleep(when - self.now())

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s; return whether it is set."""
        return event.wait(max(0.0, timeout))


class VirtualClock:
    """A clock for tests: it stands still until `advance` moves it.

    Threads that wait on it are woken in the order of their times (equal times: in the order in which they
    began to wait), one at a time: the next is woken, and the time moves on, only when the last one waits on
    the clock again or has ended. So a program runs the same way every time, as fast as the processor.

    `rate` is only what the clock tells of itself. `limit` bounds every wait in s of wall time: one that
    nobody ends raises ClockStalledException.
    """

    simulated: Final = True

    def __init__(self, start: float = 0.0, *, rate: float = 1.0, limit: float = 10.0) -> None:
        self.rate = rate
        self._now = _nanoseconds(start)
        self._limit = limit
        self._changed = threading.Condition()
        self._waiters: list[_Waiter] = []

    def now(self) -> float:
        """Return the time in s."""
        return self._now / _NANOSECONDS

    @property
    def waiting(self) -> int:
        """Return how many threads wait on this clock."""
        with self._changed:
            return len(self._waiters)

    def wait_for_waiters(self, count: int) -> None:
        """Wait until at least `count` threads wait on this clock.

        Raises ClockStalledException after the limit.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: len(self._waiters) >= count, self._limit):
                raise ClockStalledException(
                    f"{len(self._waiters)} threads wait on the virtual clock after {self._limit:g} s, "
                    f"not {count}"
                )

    def sleep(self, seconds: float) -> None:
        """Wait until another thread has advanced the clock by a duration in s."""
        self._wait(self._now + _nanoseconds(seconds), None)

    def sleep_until(self, when: float) -> None:
        """Wait until another thread has advanced the clock to a time in s."""
        self._wait(_nanoseconds(when), None)

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event, or until the clock has advanced by `timeout` s; return whether it is set."""
        self._wait(self._now + _nanoseconds(timeout), event)
        return event.is_set()

    def advance(self, seconds: float) -> None:
        """Move the time forward by a duration in s, waking those whose time comes.

        Raises ValueError for a negative duration, and ClockStalledException, naming the thread, when a woken
        thread neither waits on the clock again nor ends within the limit.
        """
        if seconds < 0:
            raise ValueError(f"a clock does not run backwards: advance({seconds})")
        with self._changed:
            end = self._now + _nanoseconds(seconds)
            while (waiter := self._next_due(end)) is not None:
                self._now = max(self._now, waiter.due if not waiter.is_set() else self._now)
                self._run(waiter)
            self._now = end

    def _next_due(self, end: int) -> _Waiter | None:
        """Return the waiter that wakes next until `end`, if any: one whose event is set wakes at once."""
        ready = [waiter for waiter in self._waiters if waiter.is_set() or waiter.due <= end]
        return min(ready, key=lambda waiter: (not waiter.is_set(), waiter.due), default=None)

    def _run(self, waiter: _Waiter) -> None:
        """Wake a thread and wait until it waits again or ends."""
        waiter.woken = True
        if waiter in self._waiters:
            self._waiters.remove(waiter)
        self._changed.notify_all()
        deadline = time.monotonic() + self._limit
        while waiter.thread.is_alive() and not any(w.thread is waiter.thread for w in self._waiters):
            if time.monotonic() > deadline:
                raise ClockStalledException(
                    f"thread {waiter.thread.name!r} did not come back to the virtual clock within "
                    f"{self._limit:g} s after it was woken at {self.now():g} s"
                )
            self._changed.wait(_POLL)

    def _wait(self, due: int, event: threading.Event | None) -> None:
        with self._changed:
            if due <= self._now or (event is not None and event.is_set()):
                return
            waiter = _Waiter(due, event, threading.current_thread())
            self._waiters.append(waiter)
            self._changed.notify_all()
            deadline = time.monotonic() + self._limit
            try:
                while not waiter.woken and not waiter.is_set():
                    left = deadline - time.monotonic()
                    if left <= 0:
                        raise ClockStalledException(
                            f"nobody advanced the virtual clock from {self.now():g} s to "
                            f"{due / _NANOSECONDS:g} s within {self._limit:g} s"
                        )
                    self._changed.wait(left if event is None else min(left, _POLL))
            finally:
                if waiter in self._waiters:
                    self._waiters.remove(waiter)
                self._changed.notify_all()


class _Waiter:
    """A thread that waits on a virtual clock."""

    __slots__ = ("due", "event", "thread", "woken")

    def __init__(self, due: int, event: threading.Event | None, thread: threading.Thread) -> None:
        self.due = due
        self.event = event
        self.thread = thread
        self.woken = False

    def is_set(self) -> bool:
        """Return whether the event it waits for has come."""
        return self.event is not None and self.event.is_set()


def _nanoseconds(seconds: float) -> int:
    return round(seconds * _NANOSECONDS)
