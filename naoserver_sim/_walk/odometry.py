"""The robot's odometry, from its joints and its inertial unit.

Loaded soles do not move on the floor, so the torso moves by the opposite of their motion below it; each sole
counts by its load. The heading is the integrated turning rate, because soles slip when they turn; the reading
of a gyrometer while the robot stands still is its offset.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from naoserver.capabilities import InertialReading, Vector
from naoserver_sim._walk.kinematics import Legs

_LEFT: Final = 1.0
_RIGHT: Final = -1.0
_STILL: Final = 0.1
"""Turning rate in rad/s about each axis below which a resting robot stands still."""
_LARGEST_DELAY: Final = 5
"""Largest delay of the sensors in ticks."""
_STANDING_TICKS: Final = 500
"""Ticks of standing still over which the offset of the gyrometer is the mean."""


class Odometer:
    """Integrate the place of the torso on the floor, in the frame of its start."""

    def __init__(self, legs: Legs) -> None:
        self._legs = legs
        self._soles: tuple[Vector, Vector] | None = None
        self._unsure = 0  # ticks for which the soles do not count
        self._offset = 0.0  # of the yaw rate
        self._still = 0  # ticks over which that is the mean
        self.pose = (0.0, 0.0, 0.0)
        """x and y in m, and the heading in rad within (-pi, pi]."""

    def lose_footing(self) -> None:
        """Ignore movements of the soles until the sensors show their new places."""
        self._unsure = _LARGEST_DELAY

    def tick(
        self,
        seconds: float,
        joints: Sequence[float],
        inertial: InertialReading,
        loads: tuple[float, float],
        *,
        resting: bool = False,
    ) -> None:
        """Advance by some seconds, at the end of which the sensors have these readings.

        `joints` are the angles of the legs' joints in rad, left and right, `loads` those of the soles in N,
        left and right. `resting` means that the legs are not walking.
        """
        x, y, heading = self.pose
        rate = _yaw_rate(inertial)
        if resting and max(map(abs, inertial.angular_velocity)) < _STILL:
            self._still = min(self._still + 1, _STANDING_TICKS)
            self._offset += (rate - self._offset) / self._still
        heading += (rate - self._offset) * seconds
        heading = math.pi - (math.pi - heading) % math.tau
        soles = (
            _in_world(self._legs.sole(_LEFT, joints[:6]), inertial, heading),
            _in_world(self._legs.sole(_RIGHT, joints[6:]), inertial, heading),
        )
        total = loads[0] + loads[1]
        if self._unsure:
            self._unsure -= 1
        elif self._soles is not None and total > 0.0:
            for now, last, load in zip(soles, self._soles, loads, strict=True):
                x -= (now[0] - last[0]) * load / total
                y -= (now[1] - last[1]) * load / total
        self._soles = soles
        self.pose = (x, y, heading)


def _yaw_rate(inertial: InertialReading) -> float:
    """Return the rate of the heading, from the rates about the axes of a tilted torso."""
    _, about_y, about_z = inertial.angular_velocity
    upright = max(math.cos(inertial.pitch), 0.1)  # a torso that lies has no heading
    return (about_y * math.sin(inertial.roll) + about_z * math.cos(inertial.roll)) / upright


def _in_world(point: Vector, inertial: InertialReading, heading: float) -> Vector:
    """Turn a vector of the torso's frame about x by roll, about y by pitch and about z by heading."""
    x, y, z = point
    cosine, sine = math.cos(inertial.roll), math.sin(inertial.roll)
    y, z = y * cosine - z * sine, y * sine + z * cosine
    cosine, sine = math.cos(inertial.pitch), math.sin(inertial.pitch)
    x, z = x * cosine + z * sine, z * cosine - x * sine
    cosine, sine = math.cos(heading), math.sin(heading)
    return x * cosine - y * sine, x * sine + y * cosine, z
