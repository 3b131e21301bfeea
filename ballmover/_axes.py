"""The axes that carry a ball, and the point at which they place it.

A ball hangs on three axes, the first of which is vertical and passes through the origin of the world, where
the robot's feet are at the start (x forward, y left, z up, in m):

- pan: angle in rad round that vertical axis, 0 straight ahead of the robot, positive to its left;
- distance: horizontal distance in m from the vertical axis;
- height: height in m above the ground.

So x = distance cos(pan), y = distance sin(pan), z = height: cylindrical coordinates. `Pose3DMotors` and
`Pose3DEncoders` of a ball call them pan, x and z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:  # a file of waypoints is read without them
    from interfaces.jderobot import Pose3DMotorsParams

_TOLERANCE = 1e-6  # limits are sent as 32-bit floats


class Point(NamedTuple):
    """A point of the world in m."""

    x: float
    y: float
    z: float

    def distance_to(self, other: Point) -> float:
        """Return the distance to another point in m."""
        return math.dist(self, other)

    def __str__(self) -> str:
        return f"({self.x:.3g}, {self.y:.3g}, {self.z:.3g})"


@dataclass(frozen=True, slots=True)
class AxisPosition:
    """Positions of a ball's axes: pan in rad, distance and height in m."""

    pan: float
    distance: float
    height: float

    @classmethod
    def from_point(cls, point: Point, near_pan: float = 0.0) -> AxisPosition:
        """Return the axes that put a ball at a point.

        Several pans, whole turns apart, are possible; the one nearest to `near_pan` is used.
        """
        pan = math.atan2(point.y, point.x)
        pan += math.tau * round((near_pan - pan) / math.tau)
        return cls(pan, math.hypot(point.x, point.y), point.z)

    @property
    def point(self) -> Point:
        """Return the point at which these axes place the ball."""
        return Point(self.distance * math.cos(self.pan), self.distance * math.sin(self.pan), self.height)


@dataclass(frozen=True, slots=True)
class AxisLimits:
    """Limits of a ball's axes: range and speed."""

    min_pan: float
    max_pan: float
    min_distance: float
    max_distance: float
    min_height: float
    max_height: float
    max_pan_speed: float
    """In rad/s."""
    max_linear_speed: float
    """Speed limit of distance and height in m/s."""

    @classmethod
    def from_params(cls, params: Pose3DMotorsParams) -> AxisLimits:
        """Return the limits that the motors of a ball report."""
        return cls(
            min_pan=params.minPan,
            max_pan=params.maxPan,
            min_distance=params.minX,
            max_distance=params.maxX,
            min_height=params.minZ,
            max_height=params.maxZ,
            max_pan_speed=params.maxPanSpeed,
            max_linear_speed=params.maxTiltSpeed,
        )

    @property
    def middle_pan(self) -> float:
        """Return the pan in rad halfway between its limits."""
        return (self.min_pan + self.max_pan) / 2

    def violation(self, position: AxisPosition) -> str | None:
        """Return why the axes cannot have a position, or None when they can."""
        return (
            self.violated_distance(position.distance)
            or _outside("height above the ground", position.height, self.min_height, self.max_height, "m")
            or _outside("pan", position.pan, self.min_pan, self.max_pan, "rad")
        )

    def violated_distance(self, distance: float) -> str | None:
        """Return why the ball cannot be at a distance from the vertical axis, or None when it can."""
        return _outside(
            "distance from the vertical axis", distance, self.min_distance, self.max_distance, "m"
        )


def _outside(name: str, value: float, lowest: float, highest: float, unit: str) -> str | None:
    if lowest - _TOLERANCE <= value <= highest + _TOLERANCE:
        return None
    return f"its {name} would be {value:.3g} {unit}, outside {lowest:.3g} to {highest:.3g} {unit}"
