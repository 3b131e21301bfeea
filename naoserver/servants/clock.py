"""Servant of the robot's clock."""

from __future__ import annotations

from interfaces.nao import Clock as ClockServant
from interfaces.nao import ClockReading
from zenoh_ice import Clock, Current


class ClockI(ClockServant):
    """Tell the robot's time, in calls and as a stream."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def getTime(self, current: Current) -> ClockReading:  # noqa: ARG002
        """Return the robot's time."""
        return self._reading()

    def publish(self) -> None:
        """Send the time to whoever listens."""
        if self.getTimePublisher.listening:
            reading = self._reading()
            self.getTimePublisher.publish(reading, time=reading.time)

    def _reading(self) -> ClockReading:
        return ClockReading(time=self._clock.now(), rate=self._clock.rate, simulated=self._clock.simulated)
