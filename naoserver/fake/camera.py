"""Draw what the fake robot's cameras see: balls as discs, by the projection of a pinhole camera."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.body import H25
from naoserver.robot import CameraFacts

RADIUS: Final = 0.05
"""Radius of a ball in m."""
NECK_HEIGHT: Final = float(H25.facts["checks"]["neck_joint_height"])
"""Height of the head's two axes above the floor in m, legs straight."""
_GROUND: Final = 110

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Ball:
    """A ball: its bearing in rad, positive to the left, its distance and its height above the floor in m."""

    pan: float
    distance: float
    height: float


def focal_length(camera: CameraFacts, width: int) -> float:
    """Return the focal length in pixels of an image `width` pixels wide."""
    return width / 2 / math.tan(camera.horizontal_fov / 2)


def project(camera: CameraFacts, pan: float, tilt: float, ball: Ball) -> Point:
    """Return where a ball's centre is in the camera's frame in m: ahead, to the left, up.

    The head turns by `pan` about the vertical, then by `tilt` about its own y axis.
    """
    x, y = ball.distance * math.cos(ball.pan - pan), ball.distance * math.sin(ball.pan - pan)
    x, z = _pitched(x, ball.height - NECK_HEIGHT, tilt)
    ahead, up = _pitched(x - camera.position[0], z - camera.position[2], camera.tilt)
    return ahead, y - camera.position[1], up


def paint(
    camera: CameraFacts,
    size: tuple[int, int],
    balls: Iterable[tuple[Point, tuple[int, int, int]]],
    ball_radius: float = RADIUS,
) -> NDArray[np.uint8]:
    """Return an RGB image of `size`, width and height, of balls, each with its place and its color.

    A place is in the camera's frame, as `project` returns it. Nearer balls hide those behind them.
    """
    width, height = size
    image = np.full((height, width, 3), _GROUND, np.uint8)
    focal = focal_length(camera, width)
    for (ahead, left, up), color in sorted(balls, key=lambda placed: -placed[0][0]):
        if ahead <= ball_radius:
            continue
        column, row = width / 2 - focal * left / ahead, height / 2 - focal * up / ahead
        radius = focal * ball_radius / ahead
        rows = np.arange(max(0, math.floor(row - radius)), min(height, math.ceil(row + radius) + 1))
        columns = np.arange(max(0, math.floor(column - radius)), min(width, math.ceil(column + radius) + 1))
        if rows.size and columns.size:
            inside = (rows[:, None] + 0.5 - row) ** 2 + (columns + 0.5 - column) ** 2 <= radius**2
            image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1][inside] = color
    return image


def _pitched(x: float, z: float, angle: float) -> tuple[float, float]:
    """Return a point's coordinates in a frame that is pitched by `angle`, positive downwards."""
    return x * math.cos(angle) - z * math.sin(angle), x * math.sin(angle) + z * math.cos(angle)
