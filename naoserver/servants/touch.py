"""Servant of the touch sensors."""

from __future__ import annotations

from typing import Final

from interfaces.nao import Touch, TouchReading
from naoserver.capabilities import SenseReading, Senses
from naoserver.servants.streaming import Changes
from zenoh_ice import Current


class TouchI(Touch):
    """Tell what is touched, in calls and as a stream."""

    def __init__(self, senses: Senses) -> None:
        self.device: Final = senses
        self._changes = Changes()

    def getTouchNames(self, current: Current) -> list[str]:  # noqa: ARG002
        """Return the names of the sensors."""
        return list(self.device.touch_names)

    def getTouchReading(self, current: Current) -> TouchReading:  # noqa: ARG002
        """Return what is touched."""
        return self._touch(self.device.read())

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getTouchReadingPublisher.listening

    def publish(self, reading: SenseReading) -> None:
        """Send what is touched to whoever listens, when it is news."""
        if self._changes.are_news(reading.touched, reading.time):
            self.getTouchReadingPublisher.publish(self._touch(reading), time=reading.time)

    def _touch(self, reading: SenseReading) -> TouchReading:
        touched = [name for name in self.device.touch_names if name in reading.touched]
        return TouchReading(time=reading.time, touched=touched)
