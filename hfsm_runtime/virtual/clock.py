"""Virtual time for one thread: a clock that runs tasks when they fall due as it advances."""

from __future__ import annotations

import heapq
import itertools
import threading
from collections.abc import Callable
from typing import Final

from zenoh_ice import VirtualClock

_NANOSECONDS: Final = 1_000_000_000
_POLL: Final = 10_000_000
"""Interval in ns at which a wait for an event checks again."""


class TaskClock(VirtualClock):
    """A virtual clock that runs tasks at their times, in the thread that advances it.

    A sleep advances the clock, so that nothing ever waits for another thread. Tasks due at the same time run
    in the order in which they were added.
    """

    def __init__(self) -> None:
        super().__init__()
        self._tasks: list[tuple[int, int, Callable[[], None]]] = []
        self._numbers = itertools.count()

    def call_at(self, when: float, task: Callable[[], None]) -> None:
        """Run a task once at a time in s, or at the next advance if that time has passed."""
        heapq.heappush(self._tasks, (round(when * _NANOSECONDS), next(self._numbers), task))

    def advance(self, seconds: float) -> None:
        """Move the time forward by a duration in s, and run the tasks that fall due, the end included."""
        if seconds < 0:
            raise ValueError(f"a clock does not run backwards: advance({seconds})")
        end = self._now + round(seconds * _NANOSECONDS)
        while self._tasks and self._tasks[0][0] <= end:
            when, _, task = heapq.heappop(self._tasks)
            self._move_to(when)
            task()  # which may advance the time, even beyond the end
        self._move_to(end)

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Move the time forward until a task sets an event, at most `timeout` s; return whether it is set."""
        return self.wait_for(event.is_set, timeout)

    def wait_for(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Move the time forward, task by task, until a condition holds; return whether it does."""
        end = self._now + round(max(0.0, timeout) * _NANOSECONDS)
        while not condition():
            now = self._now
            if now >= end:
                return False
            following = self._tasks[0][0] if self._tasks else end
            self.advance(max(0, min(following, now + _POLL, end) - now) / _NANOSECONDS)
        return True
