"""Servant of the sonar."""

from __future__ import annotations

from typing import Final

from interfaces.nao import Sonar, SonarLimits, SonarReading
from naoserver.capabilities import SenseReading, Senses
from naoserver.servants.streaming import Changes
from zenoh_ice import Current


class SonarI(Sonar):
    """Tell what is near in front of the chest, in calls and as a stream."""

    def __init__(self, senses: Senses) -> None:
        self.device: Final = senses
        self._changes = Changes()

    def getSonarReading(self, current: Current) -> SonarReading:  # noqa: ARG002
        """Return the newest reading."""
        return _sonar(self.device.read())

    def getSonarLimits(self, current: Current) -> SonarLimits:  # noqa: ARG002
        """Return how the sonar sees."""
        nearest, farthest = self.device.sonar_range
        return SonarLimits(nearest=nearest, farthest=farthest, cone=self.device.sonar_cone)

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getSonarReadingPublisher.listening

    def publish(self, reading: SenseReading) -> None:
        """Send a reading to whoever listens, when it is news: the sonar measures seldom."""
        if self._changes.are_news(reading.sonar, reading.time):
            self.getSonarReadingPublisher.publish(_sonar(reading), time=reading.time)


def _sonar(reading: SenseReading) -> SonarReading:
    return SonarReading(time=reading.time, left=reading.sonar.left, right=reading.sonar.right)
