"""Turns in space. For three numbers they are faster than those of numpy."""

from __future__ import annotations

import math

import numpy as np

from naoserver_sim._footsteps.limbs import Array


def axes(heading: float, roll: float = 0.0, pitch: float = 0.0) -> Array:
    """Return the axes, as columns, of what is turned about x by roll, then y by pitch, then z by heading."""
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(heading), math.sin(heading)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def quaternion(heading: float, roll: float, pitch: float) -> tuple[float, float, float, float]:
    """Return the same turn as a quaternion w, x, y, z."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(heading / 2), math.sin(heading / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def inclination(turned: Array) -> tuple[float, float]:
    """Return roll and pitch in rad of axes as columns."""
    return math.atan2(turned[2, 1], turned[2, 2]), -math.asin(max(-1.0, min(1.0, turned[2, 0])))


def turn_between(now: Array, wanted: Array) -> Array:
    """Return the small turn in rad, as a vector, from some axes to others."""
    turn = (wanted @ now.T).tolist()
    return 0.5 * np.array([turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]])
