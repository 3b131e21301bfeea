"""Servant of the pressure under the feet."""

from __future__ import annotations

from typing import Final

from interfaces.nao import FeetReading, FootPressure, FootReading
from naoserver.body import H25
from naoserver.capabilities import FootReading as Pressures
from naoserver.capabilities import SenseReading, Senses
from zenoh_ice import Current

_PLACES: Final = {
    side: [H25.facts["fsr"][side][sensor] for sensor in ("FrontLeft", "FrontRight", "RearLeft", "RearRight")]
    for side in ("left", "right")
}
"""Where the sensors of each sole are in the foot's frame in m."""


class FootPressureI(FootPressure):
    """Tell what presses on the soles, in calls and as a stream."""

    def __init__(self, senses: Senses) -> None:
        self.device: Final = senses

    def getFeetReading(self, current: Current) -> FeetReading:  # noqa: ARG002
        """Return the newest reading."""
        return _feet(self.device.read())

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getFeetReadingPublisher.listening

    def publish(self, reading: SenseReading) -> None:
        """Send a reading to whoever listens."""
        self.getFeetReadingPublisher.publish(_feet(reading), time=reading.time)


def _feet(reading: SenseReading) -> FeetReading:
    return FeetReading(
        time=reading.time, left=_foot(reading.left_foot, "left"), right=_foot(reading.right_foot, "right")
    )


def _foot(foot: Pressures, side: str) -> FootReading:
    total = foot.total
    pressures = (foot.front_left, foot.front_right, foot.rear_left, foot.rear_right)
    x, y = (
        sum(pressure * place[axis] for pressure, place in zip(pressures, _PLACES[side], strict=True)) / total
        if total > 0.0
        else 0.0
        for axis in (0, 1)
    )
    return FootReading(
        frontLeft=foot.front_left,
        frontRight=foot.front_right,
        rearLeft=foot.rear_left,
        rearRight=foot.rear_right,
        total=total,
        centerX=x,
        centerY=y,
    )
