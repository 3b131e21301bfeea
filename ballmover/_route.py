"""The way of a ball: straight lines between waypoints, checked against the limits of its axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from ._axes import AxisLimits, AxisPosition, Point
from ._exceptions import UnreachableException
from ._waypoints import Waypoint

_SPEED_TOLERANCE: Final = 1.001  # limits are sent as 32-bit floats
_FULL_TURN_TOLERANCE: Final = 1e-6  # rad
_ON_AXIS: Final = 1e-3  # m from the vertical axis, where the pan has no meaning


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line of the ball, at constant speed."""

    start: AxisPosition
    end: Point

    def duration(self, speed: float) -> float:
        """Return the duration of the line in s at a speed of the ball in m/s."""
        return self.start.point.distance_to(self.end) / speed

    def at(self, fraction: float) -> AxisPosition:
        """Return the position of the axes after a fraction of the line, 0 to 1.

        The pan does not jump: along a line it changes by less than half a turn.
        """
        a, b = self.start.point, self.end
        point = Point(*(p + fraction * (q - p) for p, q in zip(a, b, strict=True)))
        return AxisPosition.from_point(point, near_pan=self.start.pan)

    def least_distance(self) -> float:
        """Return the smallest distance in m of the line from the vertical axis."""
        (x, y, _), (dx, dy) = self.start.point, self._run()
        length_squared = dx * dx + dy * dy
        if length_squared == 0.0:
            return math.hypot(x, y)
        nearest = min(1.0, max(0.0, -(x * dx + y * dy) / length_squared))
        return math.hypot(x + nearest * dx, y + nearest * dy)

    def highest_speed(self, limits: AxisLimits) -> float:
        """Return the highest speed in m/s of the ball at which each axis keeps up along the line.

        With the line at distance d from the vertical axis and the ball at distance r, the pan turns at
        v d / r^2: fastest where r is least.
        """
        length = self.start.point.distance_to(self.end)
        if length == 0.0:
            return math.inf
        (x, y, z), (dx, dy) = self.start.point, self._run()
        horizontal = math.hypot(dx, dy)
        speeds = [
            limits.max_linear_speed * length / part
            for part in (horizontal, abs(self.end.z - z))
            if part > 0.0
        ]
        turning = abs(x * dy - y * dx) / length  # d times the horizontal part of the speed
        if turning > 0.0:
            speeds.append(limits.max_pan_speed * self.least_distance() ** 2 / turning)
        return min(speeds)

    def _run(self) -> tuple[float, float]:
        a, b = self.start.point, self.end
        return b.x - a.x, b.y - a.y


@dataclass(frozen=True, slots=True)
class Approach:
    """A movement of each axis on its own, from wherever the ball is.

    Unlike a straight line it never leaves the limits when both ends are within them.
    """

    start: AxisPosition
    end: AxisPosition
    limits: AxisLimits

    def duration(self, speed: float) -> float:
        """Return the duration of the movement in s when the ball stays below a speed in m/s."""
        pan = abs(self.end.pan - self.start.pan)
        distance = abs(self.end.distance - self.start.distance)
        height = abs(self.end.height - self.start.height)
        arc = pan * max(self.start.distance, self.end.distance)
        return max(
            math.hypot(arc, distance, height) / speed,
            pan / self.limits.max_pan_speed,
            max(distance, height) / self.limits.max_linear_speed,
        )

    def at(self, fraction: float) -> AxisPosition:
        """Return the position of the axes after a fraction of the movement, 0 to 1."""
        a, b = self.start, self.end
        return AxisPosition(
            a.pan + fraction * (b.pan - a.pan),
            a.distance + fraction * (b.distance - a.distance),
            a.height + fraction * (b.height - a.height),
        )


Move = Line | Approach
"""A movement of the axes from one position to another."""


@dataclass(frozen=True, slots=True)
class Stop:
    """A waypoint with the axes that put the ball there and the speed of the line that leads there."""

    waypoint: Waypoint
    axes: AxisPosition
    speed: float


@dataclass(frozen=True, slots=True)
class Route:
    """The stops of a ball; a straight line leads from each to the next."""

    stops: tuple[Stop, ...]
    limits: AxisLimits

    @classmethod
    def plan(cls, waypoints: Sequence[Waypoint], limits: AxisLimits, *, speed: float, loop: bool) -> Route:
        """Return the route through waypoints; `speed` in m/s is that of waypoints without their own.

        With `loop` the line from the last back to the first belongs to it. Raises UnreachableException,
        naming the waypoint and the reason.
        """
        stops = [_first_stop(waypoints[0], limits, speed)]
        for waypoint in waypoints[1:]:
            stops.append(_next_stop(stops[-1], waypoint, limits, speed))
        if loop and len(stops) > 1:
            closing = _next_stop(stops[-1], waypoints[0], limits, speed)
            winding = closing.axes.pan - stops[0].axes.pan
            if abs(winding) > _FULL_TURN_TOLERANCE:
                raise UnreachableException(
                    f"{waypoints[0]} ends a loop round the vertical axis: each lap would turn the pan by "
                    f"{winding:.3g} rad, and it has limits; choose waypoints that turn back, or --once"
                )
        return cls(tuple(stops), limits)


def _first_stop(waypoint: Waypoint, limits: AxisLimits, speed: float) -> Stop:
    axes = AxisPosition.from_point(waypoint.point, near_pan=limits.middle_pan)
    _check_position(axes, waypoint, limits)
    return Stop(waypoint, axes, waypoint.speed or speed)


def _next_stop(previous: Stop, waypoint: Waypoint, limits: AxisLimits, speed: float) -> Stop:
    own_speed = waypoint.speed or speed
    line = Line(previous.axes, waypoint.point)
    axes = line.at(1.0)
    came_from = f"{waypoint} cannot be reached on a straight line from {previous.waypoint.point}"
    # The waypoint itself first: the course of a line matters only if its end is valid.
    alone = AxisPosition.from_point(waypoint.point, near_pan=limits.middle_pan)
    _check_position(alone, waypoint, limits)
    if reason := limits.violation(axes):
        raise UnreachableException(f"{came_from}: the line passes behind the robot, where {reason}")
    nearest = line.least_distance()
    if reason := limits.violated_distance(nearest):
        raise UnreachableException(f"{came_from}: on the way {reason}")
    if nearest < _ON_AXIS:
        raise UnreachableException(f"{came_from}: on the way it would cross the vertical axis")
    highest = line.highest_speed(limits)
    if own_speed > highest * _SPEED_TOLERANCE:
        raise UnreachableException(
            f"{came_from} at {own_speed:.3g} m/s: the axes keep up only to {highest:.3g} m/s"
        )
    return Stop(waypoint, axes, own_speed)


def _check_position(axes: AxisPosition, waypoint: Waypoint, limits: AxisLimits) -> None:
    if reason := limits.violation(axes):
        raise UnreachableException(f"{waypoint} cannot be reached: {reason}")
