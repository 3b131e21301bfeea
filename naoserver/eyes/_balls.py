"""Balls in a picture: regions of a color, round, and as large as a ball is there."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

import cv2
import numpy as np

from naoserver.bodies.sight import Thing
from naoserver.eyes._shot import Found, Pixels, Shot
from naoserver.eyes.looks import Looks

_SMALLEST: Final = 2.0
"""Radius in pixels of the smallest ball: less is a speck."""
_ROUND: Final = 0.6, 0.85
"""Share of the circle round it that a region fills: a ball on a field, and one that may be in the air."""
_SIZES: Final = (0.6, 1.5), (0.8, 1.2)
"""Radius of a ball on the floor as a share of the expected one: on a field, where none flies, and else."""
_CARPET: Final = 0.4, 0.6
"""Share of grass below a ball, from a distance in m: below the orange of a robot is a robot."""
_ERROR: Final = 0.05
"""Error of a distance by the size, as a share of it."""


def find_balls(shot: Shot, looks: Looks) -> Iterator[Found]:
    """Yield the balls of all colors."""
    grass = looks.field.grass.hue
    for color, radius in looks.balls.items():
        tint = looks.colors[color]
        if shot.grass is not None and tint.hue[0] < grass[1] and grass[0] < tint.hue[1]:
            continue  # grass would be one
        mask = cv2.morphologyEx(shot.masks(tint), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
        regions, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        for region in regions:
            found = _ball(shot, color, radius, region)
            if found is not None:
                yield found


def _ball(shot: Shot, color: str, radius: float, region: Any) -> Found | None:  # noqa: ANN401 - of OpenCV
    u, v, wide, fills = _circle(region)
    if wide < _SMALLEST:
        return None
    place = shot.at_height(u, v, radius)
    size = shot.focal / math.hypot(shot.focal, u - (shot.pixels.shape[1] - 1) / 2) * wide
    if place is not None:
        away = float(np.linalg.norm(place - shot.eye))
        share = size * away / (shot.focal * radius)
        low, high = _SIZES[shot.grass is None]
        enough, far = _CARPET
        if low < share < high and (
            shot.grass is None or away < far or _grass_below(shot.grass.green, u, v, wide) > enough
        ):
            certainty = round(min(share, 1.0 / share) * min(1.0, fills / _ROUND[1]), 3)
            thing = Thing("ball", color, certainty, error=shot.error_on_floor(place))
            return Found(thing, place, place * (1.0, 1.0, 0.0))
    if shot.grass is not None or fills < _ROUND[1] or wide < 2.0 * _SMALLEST:
        return None
    away = shot.focal * radius / size
    place = shot.at_distance(u, v, away)
    return Found(Thing("ball", color, 0.5, error=_ERROR * away), place, place * (1.0, 1.0, 0.0))


def _circle(region: Any) -> tuple[float, float, float, float]:  # noqa: ANN401
    """Return the middle and the radius of the circle round a region, and how much of it that fills.

    If it is not round, it is the largest circle in it: the ball before a robot's orange toes.
    """
    (u, v), radius = cv2.minEnclosingCircle(region)
    radius += 0.5  # it goes through the middles of pixels
    fills = (cv2.contourArea(region) + 0.5 * len(region)) / (math.pi * radius**2)
    if fills >= _ROUND[0]:
        return u, v, radius, fills
    left, top, width, height = cv2.boundingRect(region)
    filled: Pixels = np.zeros((height + 2, width + 2), np.uint8)
    cv2.drawContours(filled, [region], 0, 255, cv2.FILLED, offset=(1 - left, 1 - top))
    _, radius, _, (u, v) = cv2.minMaxLoc(cv2.distanceTransform(filled, cv2.DIST_L2, 5))
    return u + left - 1.0, v + top - 1.0, radius, 0.5


def _grass_below(green: Any, u: float, v: float, radius: float) -> float:  # noqa: ANN401
    """Return how much of a picture below a circle is grass, from 0 to 1; 1 if the picture ends there."""
    rows = slice(int(v + 1.2 * radius), int(v + 3.2 * radius) + 1)
    below = green[rows, max(0, int(u - radius)) : int(u + radius) + 1]
    return float(below.mean()) if below.size else 1.0
