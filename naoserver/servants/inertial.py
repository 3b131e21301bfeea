"""Servant of the inertial unit."""

from __future__ import annotations

from typing import Final

from interfaces.nao import InertialReading, InertialUnit, Vector3
from naoserver.capabilities import SenseReading, Senses
from zenoh_ice import Current


class InertialUnitI(InertialUnit):
    """Tell how the torso is accelerated, turned and tilted, in calls and as a stream."""

    def __init__(self, senses: Senses) -> None:
        self.device: Final = senses

    def getInertialReading(self, current: Current) -> InertialReading:  # noqa: ARG002
        """Return the newest reading."""
        return _inertial(self.device.read())

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getInertialReadingPublisher.listening

    def publish(self, reading: SenseReading) -> None:
        """Send a reading to whoever listens."""
        self.getInertialReadingPublisher.publish(_inertial(reading), time=reading.time)


def _inertial(reading: SenseReading) -> InertialReading:
    inertial = reading.inertial
    return InertialReading(
        time=reading.time,
        acceleration=Vector3(*inertial.acceleration),
        angularVelocity=Vector3(*inertial.angular_velocity),
        roll=inertial.roll,
        pitch=inertial.pitch,
    )
