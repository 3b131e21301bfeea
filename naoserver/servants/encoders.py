"""Servant of the odometry: JdeRobot's `Encoders`."""

from __future__ import annotations

import math
from typing import Final

from interfaces.jderobot import Encoders, EncodersData
from naoserver.capabilities import Odometry
from naoserver.walk_guard import WalkGuard
from zenoh_ice import Current


class EncodersI(Encoders):
    """Tell where the robot believes to be, in calls and as a stream."""

    def __init__(self, walk: WalkGuard) -> None:
        self.device: Final = walk

    def getEncodersData(self, current: Current) -> EncodersData:  # noqa: ARG002
        """Return the newest odometry."""
        return _data(self.device.read())

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getEncodersDataPublisher.listening

    def publish(self, reading: Odometry) -> None:
        """Send a reading to whoever listens."""
        self.getEncodersDataPublisher.publish(_data(reading), time=reading.time)


def _data(odometry: Odometry) -> EncodersData:
    return EncodersData(
        robotx=odometry.x,
        roboty=odometry.y,
        robottheta=odometry.heading,
        robotcos=math.cos(odometry.heading),
        robotsin=math.sin(odometry.heading),
    )
