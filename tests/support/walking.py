"""Measure how fast a robot walks, by its true position."""

from __future__ import annotations

import math
from collections.abc import Callable

__all__ = ["mean_velocity"]


def mean_velocity(
    place: Callable[[], tuple[float, float, float]], go: Callable[[float], None], seconds: float, step: float
) -> tuple[float, float, float]:
    """Return the mean velocity in the robot's frame: m/s forward, m/s left, rad/s.

    `place` returns x, y and heading, `go` lets time pass, which it does for `seconds` in steps of `step`.
    """
    forward = left = turned = 0.0
    x, y, heading = place()
    for _ in range(round(seconds / step)):
        go(step)
        to_x, to_y, to_heading = place()
        cosine, sine = math.cos(to_heading), math.sin(to_heading)
        forward += cosine * (to_x - x) + sine * (to_y - y)
        left += cosine * (to_y - y) - sine * (to_x - x)
        turned += math.remainder(to_heading - heading, math.tau)
        x, y, heading = to_x, to_y, to_heading
    return forward / seconds, left / seconds, turned / seconds
