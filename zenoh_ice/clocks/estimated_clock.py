"""A clock that knows the time of another only by samples, and estimates it in between."""

from __future__ import annotations

import logging
import threading
import time
from typing import Final, NamedTuple

from ..exceptions import CommunicatorDestroyedException, MarshalException

__all__ = ["EstimatedClock"]

_SILENCE: Final = 1.0  # s of wall time without a sample after which the estimate is worth a warning
_RESTART: Final = 0.1  # s: a smaller step back is a correction, a larger one a simulation that began anew
_LONGEST_WAIT: Final = 0.5  # s of wall time after which a sleeper looks at the clock anyway
_EVENT_POLL: Final = 0.05  # s of wall time; an event cannot tell us that the rate has changed
_NOTABLE_ERROR: Final = 0.0005  # s of wall time by which a correction must change a sleep to be told at once
_LATEST: Final = 1e11  # s: beyond every clock, and still exact to some 20 us
_FASTEST: Final = 1e6  # s/s: beyond every simulation

_logger = logging.getLogger(__name__)


class _Reading(NamedTuple):
    """What was known of the other clock when the newest sample arrived."""

    time: float
    rate: float
    simulated: bool
    arrival: float

    def at(self, monotonic: float) -> float:
        """Return what the other clock shows at a moment of steady wall time."""
        return self.time + self.rate * (monotonic - self.arrival)


class EstimatedClock:
    """Follow a clock by the samples given to `update`.

    Between samples the time runs on at the rate of the last one, and so it does when samples stop: that is
    logged after 1 s. It never runs backwards: where an estimate was ahead it stands still until the other
    clock has caught up. Only when that clock begins anew, more than 0.1 s behind its last sample, the time
    jumps with it and whoever sleeps wakes at once.

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
        """Wait until a time in s, or until the followed clock begins anew.

        Raises CommunicatorDestroyedException after `close`.
        """
        with self._changed:
            beginnings = self._beginnings
            while (left := when - self._now()) > 0.0 and beginnings == self._beginnings:
                self._check_open()
                self._changed.wait(self._wall_time(left, _LONGEST_WAIT))

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event, for at most `timeout` s of this clock, or until the followed clock begins anew.

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
                _logger.info("the robot's clock began anew: from %.3f s back to %.3f s", self._newest, time_)
                self._newest = time_
                self._beginnings += 1
            elif rate == last.rate and abs(time_ - last.at(arrival)) < _NOTABLE_ERROR * rate:
                return  # sleepers wake at the right time anyway
            self._changed.notify_all()

    def close(self) -> None:
        """Let every sleeper go: no sample will come any more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

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
