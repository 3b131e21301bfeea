"""Turns in space. For three numbers they are faster than those of numpy."""

from __future__ import annotations

import math

from naoserver_sim._footsteps.limbs import Array


def quaternion(heading: float, roll: float = 0.0, pitch: float = 0.0) -> tuple[float, float, float, float]:
    """Return the turn about x by roll, then y by pitch, then z by heading as a quaternion w, x, y, z."""
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
