"""Clocks, by which a component sleeps and measures time.

`WallClock` is steady, `VirtualClock` stands still until it is advanced, `RobotClock` follows another clock.
"""

from __future__ import annotations

import heapq
import itertools
import logging
import threading
import time
from collections.abc import Callable, Iterator
from typing import Final, Protocol, runtime_checkable

from zenoh_ice.data.exceptions import CommunicatorDestroyedException, MarshalException

_NANOSECONDS: Final = 1_000_000_000

# Limits of a robot's clock, in s of wall time but for the second.
_SILENCE: Final = 1.0  # time without a sample after which a warning is logged
_RESTART: Final = 0.1  # a smaller step back is a correction, a larger one a simulation that restarted
_LONGEST_NAP: Final = 0.05  # samples do not end the wait for an event

_logger = logging.getLogger(__name__)


@runtime_checkable
class Clock(Protocol):
    """A source of time, and waits by it."""

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

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s; return whether it is set."""
        return event.wait(max(0.0, timeout))


WALL: Final = WallClock()


class VirtualClock:
    """A clock for one thread: it moves when `advance` is called, or at a wait on it.

    Programs thus run the same way every time, as fast as the processor allows.
    """

    rate = 1.0
    simulated: Final = True

    def __init__(self, start: float = 0.0) -> None:
        self.moment = round(start * _NANOSECONDS)
        """The time in ns."""
        self._agenda: list[tuple[int, bool, int, Callable[[], None]]] = []
        """The coming calls: the time in ns, whether it is no tick, a number in their order, and the call."""
        self._numbers = itertools.count()

    def now(self) -> float:
        """Return the time in s."""
        return self.moment / _NANOSECONDS

    def advance(self, seconds: float) -> None:
        """Move the time forward by a duration in s; raises ValueError for a negative one."""
        if seconds < 0:
            raise ValueError(f"a clock does not run backwards: advance({seconds})")
        self.move_to(self.moment + round(seconds * _NANOSECONDS))

    def call_every(self, period: float, tick: Callable[[], None]) -> Callable[[], None]:
        """Call `tick` every `period` s of this clock, at that time and before anything else that is due then.

        It runs in the thread that advances the clock, which it must not do itself. Returns a function that
        ends the calls.
        """
        number, ended, interval = next(self._numbers), threading.Event(), round(period * _NANOSECONDS)

        def plan(due: int) -> None:
            heapq.heappush(self._agenda, (due, False, number, lambda: call(due)))

        def call(due: int) -> None:
            if not ended.is_set():
                plan(due + interval)
                tick()

        plan(self.moment + interval)
        return ended.set

    def move_to(self, end: int) -> None:
        """Move the time forward to `end` in ns, and call what is due on the way, the end included."""
        while self._agenda and self._agenda[0][0] <= end:
            self._call_next()
        self._pass(end)

    def _call_next(self) -> None:
        """Make the next of the coming calls, at its time."""
        due, _, _, call = heapq.heappop(self._agenda)
        self._pass(due)
        call()

    def _pass(self, when: int) -> None:
        """Let time pass up to a time in ns, if it is to come."""
        self.moment = max(self.moment, when)

    def sleep(self, seconds: float) -> None:
        """Move the time forward by a duration in s; a negative one is none."""
        self.advance(max(0.0, seconds))

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Move the time forward by `timeout` s unless an event is set; return whether it is."""
        if not event.is_set():
            self.sleep(timeout)
        return event.is_set()


class RobotClock:
    """Follow a clock by the samples given to `update`.

    Between samples the time runs on at the rate of the last one, and also when samples stop, which is logged
    after `silence` s. It never runs backwards: if an estimate was ahead, it stands still until the other
    clock has caught up. Only when that clock restarts, more than 0.1 s behind its last sample, does the time
    jump with it, and all sleepers wake at once.

    Raises MarshalException for an initial time or rate that no clock can have.
    """

    def __init__(self, time_: float, rate: float, simulated: bool, silence: float = _SILENCE) -> None:
        if not _plausible(time_, rate):
            raise MarshalException(f"the robot's clock shows {time_!r} s at a rate of {rate!r}")
        self.rate = rate
        """Seconds of this clock that pass in a second of wall time; 0 while it is paused."""
        self.simulated = simulated
        """The time is that of a simulation."""
        self._longest_silence = silence
        self._sample = self._newest = time_
        self._arrival = time.monotonic()
        self._restarts = 0
        self._silence_logged = self._nonsense_logged = self._closed = False
        self._changed = threading.Condition()

    def now(self) -> float:
        """Return the time in s."""
        with self._changed:
            silence = time.monotonic() - self._arrival
            if silence > self._longest_silence and not self._silence_logged and not self._closed:
                self._silence_logged = True
                _logger.warning(
                    "no sample of the robot's clock for %.1f s; continuing at its last rate, %g",
                    silence,
                    self.rate,
                )
            self._newest = max(self._newest, self._sample + self.rate * silence)
            return self._newest

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s of this clock, or until the followed clock restarts.

        Raises CommunicatorDestroyedException after `close`.
        """
        with self._changed:
            for nap in self._naps(seconds):
                self._changed.wait(nap)

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event, for at most `timeout` s of this clock, or until the followed clock restarts.

        Returns whether the event is set. Raises CommunicatorDestroyedException after `close`.
        """
        return event.is_set() or any(map(event.wait, self._naps(timeout)))

    def update(self, time_: float, rate: float, simulated: bool) -> None:
        """Take a sample of the followed clock that has just arrived.

        An impossible sample is dropped, which is logged once until a good one arrives.
        """
        arrival = time.monotonic()
        with self._changed:
            if not _plausible(time_, rate):
                if not self._nonsense_logged:
                    _logger.warning("dropped samples of the robot's clock: time %r s, rate %r", time_, rate)
                self._nonsense_logged = True
                return
            if self._silence_logged:
                _logger.warning("samples of the robot's clock arrive again")
            self._silence_logged = self._nonsense_logged = False
            if time_ < self._sample - _RESTART:
                _logger.info("the robot's clock restarted: from %.3f s back to %.3f s", self._newest, time_)
                self._newest = time_
                self._restarts += 1
            self._sample = time_
            self._arrival = arrival
            self.rate = rate
            self.simulated = simulated
            self._changed.notify_all()

    def close(self) -> None:
        """Wake every sleeper: no further sample will arrive."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _naps(self, seconds: float) -> Iterator[float]:
        """Yield waits in s of wall time, until a duration of this clock is over."""
        with self._changed:
            end, restarts = self.now() + seconds, self._restarts
        while self.now() < end and restarts == self._restarts:
            if self._closed:
                raise CommunicatorDestroyedException("the communicator whose clock this is was destroyed")
            with self._changed:
                # Not from `now` on: the time may stand still first, where it was ahead.
                left = end - self._sample - self.rate * (time.monotonic() - self._arrival)
                nap = min(left / self.rate, _LONGEST_NAP) if self.rate > 0.0 else _LONGEST_NAP
            yield nap


def _plausible(time_: float, rate: float) -> bool:
    """Return whether a clock may show a time, exact to some 20 us, and have a rate; false for nan, too."""
    return 0.0 <= time_ <= 1e11 and 0.0 <= rate <= 1e6
