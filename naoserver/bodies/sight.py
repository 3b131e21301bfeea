"""What a camera shows of places whose positions are known, for robots that need no pictures to see.

Positions are in the robot's frame, in m: upright on the floor below its torso, x where that faces, y left, z
up.
"""

from __future__ import annotations

import colorsys
import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import Color, SeenThing
from naoserver.bodies.parts import CameraFacts

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_DARK, _PALE, _BRIGHT = 0.2, 0.25, 0.75
"""The value below which a color is black, the saturation below which it is none, the value of white."""
_HUES: Final = ((15, "red"), (45, "orange"), (70, "yellow"), (170, "green"), (260, "blue"), (330, "purple"))
"""The hue in degrees up to which a color has a name."""


def color_name(color: Color) -> str:
    """Return a color's name: red, orange, yellow, green, blue, purple, black, gray or white."""
    hue, saturation, value = colorsys.rgb_to_hsv(*color)
    if value < _DARK:
        return "black"
    if saturation < _PALE:
        return "white" if value > _BRIGHT else "gray"
    return next((name for most, name in _HUES if 360.0 * hue < most), "red")


class Thing(NamedTuple):
    """Something that may be seen."""

    kind: str
    name: str = ""
    certainty: float = 1.0
    known: bool = True
    """Whether its distance is."""
    error: float = 0.0
    """Standard deviation of its distance in m."""


class CameraPlace(NamedTuple):
    """Where a camera is at a moment, and the robot's torso."""

    camera: CameraFacts
    time: float
    eye: Array
    """Its position."""
    axes: Array
    """Its axes as columns: ahead, left, up."""
    torso: Array
    """Those of the torso."""

    def seen_from(self, places: Array) -> Array:
        """Return places, one in each row, in the camera's frame: ahead, left and up in m."""
        return np.asarray((places - self.eye) @ self.axes, np.float64)

    def shows(self, places: Array) -> Mask:
        """Return which places are within the picture, as far as nothing hides them."""
        ahead, left, up = self.seen_from(places).T
        width, height = self.camera.sizes[0]
        half = np.tan(self.camera.horizontal_fov / 2) * ahead
        return np.asarray((ahead > 0.0) & (abs(left) < half) & (abs(up) < half * height / width))

    def see(self, things: Sequence[Thing], middles: Array, bases: Array) -> tuple[SeenThing, ...]:
        """Return things as the camera shows them, by their middles and where they stand, a row for each."""
        ways = middles - self.eye
        distances = np.linalg.norm(ways, axis=1)
        ahead, left, up = (ways @ self.axes).T
        x, y, z = (ways @ self.torso).T
        columns = (
            np.arctan2(left, ahead),
            np.arctan2(-up, ahead),
            np.arctan2(y, x),
            np.arctan2(-z, np.hypot(x, y)),
            distances,
            *bases[:, :2].T,
        )
        seen = []
        for thing, (to_left, down, pan, tilt, distance, base_x, base_y) in zip(
            things, np.column_stack(columns).tolist(), strict=True
        ):
            kind, name, certainty, known, error = thing
            far = (distance, error, base_x, base_y) if known else (math.inf,) * 4
            camera = self.camera.name
            seen.append(SeenThing(kind, name, certainty, camera, self.time, to_left, down, pan, tilt, *far))
        return tuple(seen)
