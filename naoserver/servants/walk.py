"""Servants of the walk, JdeRobot's `Motors` in m/s and rad/s both ways, and of its odometry, `Encoders`."""

from __future__ import annotations

import math
from typing import Final

from interfaces.jderobot import Encoders, EncodersData, Motors
from naoserver.capabilities import Odometry
from naoserver.servants.shared import StateStream, refusals_raised, require_finite
from naoserver.walk_guard import WalkGuard
from zenoh_ice import Current


class MotorsI(Motors):
    """Walk at velocities that must be renewed, each by itself."""

    def __init__(self, walk: WalkGuard) -> None:
        self._walk = walk

    def getV(self, current: Current) -> float:
        """Return the commanded forward velocity in m/s."""
        return self._walk.commanded().forward

    def setV(self, v: float, current: Current) -> int:
        """Walk forwards at a velocity in m/s; returns 1 when it was limited, else 0.

        Raises InvalidValueException, also when the robot cannot walk now, or CommandRefusedException.
        """
        require_finite(v=v)
        return self._drive("forward", v, current)

    def getW(self, current: Current) -> float:
        """Return the commanded turning velocity in rad/s."""
        return self._walk.commanded().turn

    def setW(self, w: float, current: Current) -> int:
        """Turn to the left at a velocity in rad/s; as setV."""
        require_finite(w=w)
        return self._drive("turn", w, current)

    def getL(self, current: Current) -> float:
        """Return the commanded sideways velocity in m/s."""
        return self._walk.commanded().left

    def setL(self, l: float, current: Current) -> int:  # noqa: E741  (the name in the interface)
        """Walk to the left at a velocity in m/s; as setV."""
        require_finite(l=l)
        return self._drive("left", l, current)

    def stop(self, current: Current) -> None:
        """End the walk, on both feet."""
        self._walk.stop()

    def _drive(self, kind: str, velocity: float, current: Current) -> int:
        with refusals_raised():
            return 1 if self._walk.drive({kind: velocity}, current.client) else 0


class EncodersI(Encoders):
    """Report where the robot believes to be, in calls and as a stream."""

    def __init__(self, walk: WalkGuard) -> None:
        self.stream: Final = StateStream(walk.read, self.getEncodersDataPublisher, _data)

    def getEncodersData(self, current: Current) -> EncodersData:
        """Return the newest odometry."""
        return self.stream.now()


def _data(odometry: Odometry) -> EncodersData:
    return EncodersData(
        robotx=odometry.x,
        roboty=odometry.y,
        robottheta=odometry.heading,
        robotcos=math.cos(odometry.heading),
        robotsin=math.sin(odometry.heading),
    )
