"""Virtual time for one thread: a clock that runs tasks as it advances, and one that passes by itself."""

from __future__ import annotations

import heapq
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from zenoh_ice import CommunicatorDestroyedException, VirtualClock

from .._timeline import Timeline
from ..coroutine import Coroutine, current_coroutine

_NANOSECONDS: Final = 1_000_000_000
NEVER: Final = 1 << 62
"""A time in ns that does not come."""
_POLL_PERIOD: Final = 10_000_000
"""Interval in ns at which a wait for an event checks again."""
MOVE_PERIOD: Final = 0.02
"""Wall seconds in which a paced clock moves at once: a reader sees it jump by no more."""
_LATENESS_LIMIT: Final = 0.1
"""Wall seconds that a paced clock makes up for at most, when the computer was too slow."""
_CHECK_PERIOD: Final = 1.0
"""The longest wait in wall seconds; any change ends it."""
_TASKS_LIMIT: Final = 0.5
"""The longest wait in wall seconds for the tasks of one moment to end."""


class TaskClock(VirtualClock):
    """A virtual clock that runs tasks at their times, in the thread that advances it.

    Tasks due at the same time run in the order in which they were added. A `Coroutine` that sleeps or waits
    by it is left where it does, and goes on at its time, after the tasks of that time. Elsewhere a sleep
    advances the clock, so that nothing ever waits for another thread.
    """

    def __init__(self) -> None:
        super().__init__()
        self.asleep: list[tuple[int, int, Coroutine]] = []
        """The code that sleeps, a heap: when it goes on in ns, a number in its order, and the code."""

    def call_at(self, when: float, task: Callable[[], None]) -> None:
        """Run a task once at a time in s, or at the next advance if that time has passed."""
        heapq.heappush(self._agenda, (round(when * _NANOSECONDS), True, next(self._numbers), task))

    def advance(self, seconds: float) -> None:
        """Move the time forward by a duration in s, and run the tasks that fall due, the end included.

        Code whose sleep ends before that goes on, too.
        """
        if seconds < 0 or current_coroutine() is None:
            super().advance(seconds)
            return
        end = self.moment + round(seconds * _NANOSECONDS)
        while self.moment < end:
            self.rest_until(end)

    def move_to(self, end: int) -> None:
        """Move the time forward to `end` in ns, as `advance` does; called by who drives the clock."""
        while True:
            due = self._agenda[0][0] if self._agenda else NEVER
            wake = self.asleep[0][0] if self.asleep else NEVER
            if due <= end and due <= wake:
                self._call_next()  # which may advance the time, even beyond the end
            elif wake < end:
                self._pass(wake)
                self.wake_due()
            else:
                break
        self._pass(end)

    def rest_until(self, when: int) -> None:
        """Let other code run until a time in ns, or until `wake`; called by a `Coroutine`."""
        code = current_coroutine()
        assert code is not None
        heapq.heappush(self.asleep, (when, next(self._numbers), code))
        code.wait()

    def wake(self, code: Coroutine) -> None:
        """Let code that sleeps go on now."""
        self.asleep = [each for each in self.asleep if each[2] is not code]
        heapq.heapify(self.asleep)
        code.go()

    def wake_due(self) -> None:
        """Let all code go on whose sleep has ended, but what sleeps again meanwhile."""
        number = next(self._numbers)
        while self.asleep and self.asleep[0][:2] < (self.moment, number):
            heapq.heappop(self.asleep)[2].go()

    def end_sleepers(self, error: type[BaseException]) -> None:
        """End all code that sleeps, by an exception where it does; what refuses to end never goes on."""
        asleep, self.asleep = self.asleep, []
        for _, _, code in asleep:
            code.close(error)
        self.asleep.clear()

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Move the time forward until a task sets an event, at most `timeout` s; return whether it is set."""
        return self.wait_for(event.is_set, timeout)

    def wait_for(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Move the time forward, task by task, until a condition holds; return whether it does."""
        end = self.moment + round(max(0.0, timeout) * _NANOSECONDS)
        while not condition():
            now = self.moment
            if now >= end:
                return False
            tasks = (due for due, is_task, _, _ in self._agenda if is_task)
            following = min(now + _POLL_PERIOD, end, max(now, min(tasks, default=NEVER)))
            if self.asleep and self.asleep[0][0] > now:
                following = min(following, self.asleep[0][0])
            if current_coroutine() is not None:
                self.rest_until(following)
            else:
                self.advance((following - now) / _NANOSECONDS)
                self.wake_due()
        return True


class TaskTimeline(Timeline):
    """Component time on a `TaskClock`, which never runs backwards: any thread may read it without a lock."""

    _clock: TaskClock

    def now(self) -> int:
        """Return the component time in ns."""
        paused_at = self._paused_at
        return self._clock.moment - self._zero if paused_at is None else paused_at

    _now = now


class PacedClock(TaskClock):
    """A clock with tasks that waits in wall time before it moves: `rate` seconds pass in a second.

    One thread drives it: all tasks run there. Others, which wait by it, wait until it has moved; after `end`
    they get CommunicatorDestroyedException, and the thread that drives it waits for nothing any more.
    """

    def __init__(self) -> None:
        super().__init__()
        self._speed = self.rate = 1.0
        self._driver: int | None = None
        self._changed = threading.Condition()
        self._paused = self._moving = self._interrupted = self._ended = False
        self._since = time.monotonic(), self.moment
        """A moment of wall time, and the time of this clock then."""

    def drive(self) -> None:
        """Let this thread drive the clock from now on."""
        with self._changed:
            self._driver = threading.get_ident()
            self._restart()

    def set_speed(self, speed: float) -> None:
        """Change the speed; in a pause, the change takes effect at its end."""
        with self._changed:
            self._speed = speed
            self._restart()

    def pause(self) -> None:
        """Let time stand still, once the tasks of this moment have ended."""
        with self._changed:
            self._paused = True
            self._restart()
            if threading.get_ident() != self._driver:
                self._changed.wait_for(lambda: not self._moving, _TASKS_LIMIT)

    def resume(self) -> None:
        """Let time continue."""
        with self._changed:
            self._paused = False
            self._restart()

    def end(self) -> None:
        """Wait for nothing any more."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def interrupt(self) -> None:
        """End a wait in `move`, or the next one."""
        with self._changed:
            self._interrupted = True
            self._changed.notify_all()

    def move(self, seconds: float) -> bool:
        """Wait until a duration may pass, and let it pass; false, without moving, after `interrupt`."""
        end = self.moment + round(seconds * _NANOSECONDS)
        with self._changed:
            while not self._interrupted and (left := self._left(end)) > 0:
                self._changed.wait(min(left, _CHECK_PERIOD))
            interrupted, self._interrupted = self._interrupted, False
        if not interrupted:
            with self.unpaced():
                super().advance(seconds)
        return not interrupted

    @contextmanager
    def unpaced(self) -> Iterator[None]:
        """Let time pass without waiting, in a `with` block."""
        with self._changed:
            before, self._moving = self._moving, True
        try:
            yield
        finally:
            with self._changed:
                self._moving = before
                self._changed.notify_all()

    def advance(self, seconds: float) -> None:
        """Let a duration pass: move, or wait for the thread that does."""
        if self._driver in (None, threading.get_ident()):
            super().advance(seconds)
            return
        with self._changed:
            end = self.moment + round(seconds * _NANOSECONDS)
            while self.moment < end:
                if self._ended:
                    raise CommunicatorDestroyedException("the execution has ended, and its time stands still")
                self._changed.wait(_CHECK_PERIOD)

    def wait_for(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait until a condition holds; a thread that does not drive the clock leaves its tasks alone."""
        if self._driver in (None, threading.get_ident()):
            return super().wait_for(condition, timeout)
        end = self.moment + round(max(0.0, timeout) * _NANOSECONDS)
        while not condition():
            now = self.moment
            if now >= end:
                return False
            self.advance(min(_POLL_PERIOD, end - now) / _NANOSECONDS)
        return True

    def _pass(self, when: int) -> None:
        while self.moment < when:
            step = when - self.moment if self._moving else round(MOVE_PERIOD * self._speed * _NANOSECONDS)
            following = min(when, self.moment + step)
            with self._changed:
                while (left := self._left(following)) > 0:
                    self._changed.wait(min(left, _CHECK_PERIOD))
            super()._pass(following)

    def _left(self, when: int) -> float:
        """Return the wall seconds until it may be a time of this clock, infinite in a pause."""
        if self._ended or self._moving:
            return 0.0
        if self._paused:
            return math.inf
        began, was = self._since
        left = (when - was) / _NANOSECONDS / self._speed - (time.monotonic() - began)
        if left < -_LATENESS_LIMIT:
            self._restart()
        return left

    def _restart(self) -> None:
        """Count wall time from now on; with the lock."""
        self._since = time.monotonic(), self.moment
        self.rate = 0.0 if self._paused else self._speed
        self._changed.notify_all()
