"""Clocks: what a component sleeps by and measures time with.

`WallClock` is steady wall time, `VirtualClock` stands still until a test advances it, `RobotClock` follows
the robot's time by samples.
"""

from __future__ import annotations

import logging
import threading
import time
from typing import Final, NamedTuple, Protocol, runtime_checkable

from .exceptions import CommunicatorDestroyedException, MarshalException, ZenohIceError
from .transport import Served

__all__ = ["Clock", "ClockStalledException", "RobotClock", "VirtualClock", "WallClock"]

_POLL: Final = 0.002  # s of wall time between looks at what cannot notify us: events, and threads that end
_NANOSECONDS: Final = 1_000_000_000

# Of a robot's clock.
_SILENCE: Final = 1.0  # s of wall time without a sample after which the estimate is worth a warning
_RESTART: Final = 0.1  # s: a smaller step back is a correction, a larger one a simulation that restarted
_LONGEST_WAIT: Final = 0.5  # s of wall time after which a sleeper looks at the clock anyway
_EVENT_POLL: Final = 0.05  # s of wall time; an event cannot tell us that the rate has changed
_NOTABLE_ERROR: Final = 0.0005  # s of wall time by which a correction must change a sleep to be told at once
_LATEST: Final = 1e11  # s: beyond every clock, and still exact to some 20 us
_FASTEST: Final = 1e6  # s/s: beyond every simulation

_logger = logging.getLogger(__name__)


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
        """Return the time in s; it never runs backwards, except when a simulation restarts."""

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


class _Reading(NamedTuple):
    """What was known of the other clock when the newest sample arrived."""

    time: float
    rate: float
    simulated: bool
    arrival: float

    def at(self, monotonic: float) -> float:
        """Return what the other clock shows at a moment of steady wall time."""
        return self.time + self.rate * (monotonic - self.arrival)


class RobotClock:
    """Follow a clock by the samples given to `update`.

    Between samples the time runs on at the rate of the last one, and so it does when samples stop: that is
    logged after 1 s. It never runs backwards: where an estimate was ahead it stands still until the other
    clock has caught up. Only when that clock restarts, more than 0.1 s behind its last sample, the time jumps
    with it and all sleepers wake at once.

    Raises MarshalException when it is to begin with a time or a rate that no clock has.
    """

    def __init__(self, time_: float, rate: float, simulated: bool) -> None:
        if not _plausible(time_, rate):
            raise MarshalException(f"the robot's clock shows {time_!r} s at a rate of {rate!r}")
        self._reading = _Reading(time_, rate, simulated, time.monotonic())
        self._newest = time_
        self._beginnings = 0
        self._silence_told = False
        self._nonsense_told = False
        self._closed = False
        self._changed = threading.Condition()
        self._following: Served | None = None

    @property
    def rate(self) -> float:
        """Return the seconds of this clock that pass in a second of wall time; 0 while it is paused."""
        return self._reading.rate

    @property
    def simulated(self) -> bool:
        """Return whether the time is that of a simulation."""
        return self._reading.simulated

    def now(self) -> float:
        """Return the time in s."""
        with self._changed:
            return self._now()

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s of this clock.

        Raises CommunicatorDestroyedException after `close`.
        """
        self.sleep_until(self.now() + seconds)

    def sleep_until(self, when: float) -> None:
        """Wait until a time in s, or until the followed clock restarts.

        Raises CommunicatorDestroyedException after `close`.
        """
        with self._changed:
            beginnings = self._beginnings
            while (left := when - self._now()) > 0.0 and beginnings == self._beginnings:
                self._check_open()
                self._changed.wait(self._wall_time(left, _LONGEST_WAIT))

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event, for at most `timeout` s of this clock, or until the followed clock restarts.

        Returns whether the event is set. Raises CommunicatorDestroyedException after `close`.
        """
        with self._changed:
            beginnings = self._beginnings
            end = self._now() + timeout
        while not event.is_set():
            with self._changed:
                left = end - self._now()
                if left <= 0.0 or beginnings != self._beginnings:
                    break
                self._check_open()
                wall_time = self._wall_time(left, _EVENT_POLL)
            event.wait(wall_time)
        return event.is_set()

    def update(self, time_: float, rate: float, simulated: bool) -> None:
        """Take a sample of the followed clock that has just arrived.

        A sample that no clock can show is dropped, which is logged once until a good one comes.
        """
        arrival = time.monotonic()
        with self._changed:
            if not _plausible(time_, rate):
                if not self._nonsense_told:
                    self._nonsense_told = True
                    _logger.warning("dropped samples of the robot's clock: time %r s, rate %r", time_, rate)
                return
            self._nonsense_told = False
            last, self._reading = self._reading, _Reading(time_, rate, simulated, arrival)
            if self._silence_told:
                self._silence_told = False
                _logger.warning("the robot's clock is heard again")
            if time_ < last.time - _RESTART:
                _logger.info("the robot's clock restarted: from %.3f s back to %.3f s", self._newest, time_)
                self._newest = time_
                self._beginnings += 1
            elif rate == last.rate and abs(time_ - last.at(arrival)) < _NOTABLE_ERROR * rate:
                return  # sleepers wake at the right time anyway
            self._changed.notify_all()

    def follow(self, samples: Served) -> None:
        """Take what brings the samples; it is closed with the clock."""
        self._following = samples

    def close(self) -> None:
        """Let every sleeper go: no sample will come any more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._following is not None:
            self._following.close()

    def _now(self) -> float:
        monotonic = time.monotonic()
        silence = monotonic - self._reading.arrival
        if silence > _SILENCE and not self._silence_told and not self._closed:
            self._silence_told = True
            _logger.warning(
                "nothing heard of the robot's clock for %.1f s; going on at its last rate, %g",
                silence,
                self.rate,
            )
        self._newest = max(self._newest, self._reading.at(monotonic))
        return self._newest

    def _wall_time(self, duration: float, longest: float) -> float:
        """Return how long to wait in s of wall time before a duration of this clock may have passed."""
        # Where the estimate is ahead of the followed clock, the time stands still first.
        ahead = self._newest - self._reading.at(time.monotonic())
        rate = self._reading.rate
        return min((duration + ahead) / rate, longest) if rate > 0.0 else longest

    def _check_open(self) -> None:
        if self._closed:
            raise CommunicatorDestroyedException("the communicator whose clock this is was destroyed")


def _plausible(time_: float, rate: float) -> bool:
    # False for nan, too.
    return 0.0 <= time_ <= _LATEST and 0.0 <= rate <= _FASTEST
