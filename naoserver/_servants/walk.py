"""Servants of the walk: JdeRobot's `Motors` in m/s and rad/s both ways, odometry, and walks to a place."""

from __future__ import annotations

import math
from typing import Final

from interfaces.jderobot import Encoders, EncodersData, Motors
from interfaces.nao import ActionState, Walk
from naoserver._servants.shared import (
    StateStream,
    action_stream,
    refusals_raised,
    require_finite,
    require_within,
)
from naoserver._walk import WalkGuard, WalkTo
from naoserver._way import way_to
from naoserver.capabilities import Odometry
from zenoh_ice import Current

_FARTHEST_PLACE: Final = 100.0
"""Largest distance in m along x and y of a place to walk to."""


class MotorsI(Motors):
    """Walk at velocities, each of which must be renewed."""

    def __init__(self, walk: WalkGuard) -> None:
        self._walk = walk

    def getV(self, current: Current) -> float:
        return self._walk.commanded().forward

    def setV(self, v: float, current: Current) -> int:
        require_finite(v=v)
        return self._drive("forward", v, current)

    def getW(self, current: Current) -> float:
        return self._walk.commanded().turn

    def setW(self, w: float, current: Current) -> int:
        require_finite(w=w)
        return self._drive("turn", w, current)

    def getL(self, current: Current) -> float:
        return self._walk.commanded().left

    def setL(self, l: float, current: Current) -> int:  # noqa: E741  (the name in the interface)
        require_finite(l=l)
        return self._drive("left", l, current)

    def stop(self, current: Current) -> None:
        self._walk.stop()

    def _drive(self, kind: str, velocity: float, current: Current) -> int:
        with refusals_raised():
            return 1 if self._walk.drive({kind: velocity}, current.client) else 0


class WalkI(Walk):
    """Walk to places."""

    def __init__(self, walk: WalkGuard, walk_to: WalkTo) -> None:
        self._walk = walk
        self._walk_to = walk_to
        self.stream: Final = action_stream(walk_to.state, self.getWalkStatePublisher)

    def walkTo(self, x: float, y: float, heading: float, current: Current) -> None:
        require_within(-_FARTHEST_PLACE, _FARTHEST_PLACE, x=x, y=y)
        require_within(-math.tau, math.tau, heading=heading)
        with refusals_raised():
            way = way_to((x, y, heading), self._walk.read(), self._walk.limits, self._walk.lag)
            self._walk_to.begin(way, current.client)

    def stop(self, current: Current) -> None:
        self._walk_to.stop()

    def getWalkState(self, current: Current) -> ActionState:
        return self._walk_to.state()


class EncodersI(Encoders):
    """Report where the robot believes it is, in calls and as a stream."""

    def __init__(self, walk: WalkGuard) -> None:
        self.stream: Final = StateStream(walk.read, self.getEncodersDataPublisher, _data)

    def getEncodersData(self, current: Current) -> EncodersData:
        return self.stream.now()


def _data(odometry: Odometry) -> EncodersData:
    return EncodersData(
        robotx=odometry.x,
        roboty=odometry.y,
        robottheta=odometry.heading,
        robotcos=math.cos(odometry.heading),
        robotsin=math.sin(odometry.heading),
    )
