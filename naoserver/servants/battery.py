"""Servant of the battery."""

from __future__ import annotations

from typing import Final

from interfaces.nao import Battery, BatteryReading
from naoserver.capabilities import SenseReading, Senses
from zenoh_ice import Current

_INTERVAL: Final = 0.5
"""Robot seconds between two samples: a battery changes slowly."""


class BatteryI(Battery):
    """Tell the state of the battery, in calls and as a stream."""

    def __init__(self, senses: Senses) -> None:
        self.device: Final = senses
        self._due = 0.0

    def getBatteryReading(self, current: Current) -> BatteryReading:  # noqa: ARG002
        """Return the newest reading."""
        return _battery(self.device.read())

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getBatteryReadingPublisher.listening

    def publish(self, reading: SenseReading) -> None:
        """Send a reading to whoever listens, when one is due."""
        if not self._due - _INTERVAL <= reading.time < self._due:  # due, or the clock began anew
            self._due = reading.time + _INTERVAL
            self.getBatteryReadingPublisher.publish(_battery(reading), time=reading.time)


def _battery(reading: SenseReading) -> BatteryReading:
    battery = reading.battery
    return BatteryReading(
        time=reading.time,
        charge=battery.charge,
        current=battery.current,
        temperature=battery.temperature,
        plugged=battery.plugged,
    )
