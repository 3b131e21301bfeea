"""A picture, and the rays of its pixels in the robot's frame: upright on the floor, x ahead, y left, z up."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from interfaces.jderobot import CameraDescription, FloorPoint, ImageData
from naoserver.bodies.parts import CameraFacts
from naoserver.bodies.sight import Array, CameraPlace, Mask, Thing
from naoserver.eyes.looks import FieldLooks, Tint

Pixels = NDArray[np.uint8]
Numbers = NDArray[np.int64]

_LEAN: Final = 0.02
"""Error in rad of all directions in a picture: the robot may walk, and senses of that are not exact."""
_HEIGHTS: Final = (0.0, -1.0), (10.0, 20.0)
"""Two heights in m through which a ray passes that looks down, and up."""
_STEP: Final = 4
"""Pixels from one row or column to the next of those that say how bright grass is."""
_FIELD: Final = 0.06
"""Share of a picture that is grass where it shows a field."""


class Found(NamedTuple):
    """Something in a picture: its middle, and where it stands, in m in the robot's frame."""

    thing: Thing
    middle: Array
    base: Array


class Grass(NamedTuple):
    """Which pixels show grass, and which something as white as a line."""

    green: Mask
    white: Mask


class Shot(NamedTuple):
    """A picture in RGB and in OpenCV's HSV, and its camera at that moment, in the robot's frame."""

    pixels: Pixels
    hsv: Pixels
    place: CameraPlace
    focal: float
    """In pixels."""
    rays: Array
    """Leads from column, row, 1 to a direction, by 1 ahead of the camera."""
    grass: Grass | None
    """None for a picture that shows no field."""

    @property
    def eye(self) -> Array:
        """Where the camera is."""
        return self.place.eye

    @property
    def to_floor(self) -> Array:
        """Leads from column, row, 1 to x, y, 1 on the floor, times what is positive below the horizon."""
        x, y, z = self.eye
        return np.asarray(np.array(((z, 0.0, -x), (0.0, z, -y), (0.0, 0.0, -1.0))) @ self.rays)

    def pixels_of(self, places: Array) -> Array:
        """Return column and row of places, one in each row; NaN for those behind the camera."""
        u, v, ahead = np.linalg.solve(self.rays, (places - self.eye).T)
        return np.asarray(np.column_stack((u, v)) / np.where(ahead > 0.0, ahead, np.nan)[:, None])

    def at_height(self, u: float, v: float, height: float) -> Array | None:
        """Return the place at a height in m that a pixel shows; None if it shows none."""
        ray = self.rays @ (u, v, 1.0)
        way = (height - self.eye[2]) / ray[2] if ray[2] else math.inf
        return np.asarray(self.eye + way * ray) if 0.0 < way < math.inf else None

    def at_distance(self, u: float, v: float, distance: float) -> Array:
        """Return the place at a distance in m from the camera that a pixel shows."""
        ray = self.rays @ (u, v, 1.0)
        return np.asarray(self.eye + distance / np.linalg.norm(ray) * ray)

    def error_on_floor(self, place: Array) -> float:
        """Return the standard deviation in m of the distance of a place that is known by its height."""
        way = self.eye - place
        return float(_LEAN * (way @ way) / max(abs(way[2]), 1e-6))

    def masks(self, tint: Tint) -> Pixels:
        """Return which pixels have a color, as 255."""
        return in_tint(self.hsv, tint)


def in_tint(hsv: Pixels, tint: Tint, least: float = 0.0) -> Pixels:
    """Return which pixels have a color, and at least a saturation from 0 to 255, as 255."""
    low, high = (hue / 2.0 for hue in tint.hue)
    saturation, value = max(255.0 * tint.saturation, least), 255.0 * tint.value
    ranges = [(low, high)] if low <= high else [(low, 180.0), (0.0, high)]
    masks = [cv2.inRange(hsv, (a, saturation, value), (b, 255, 255)) for a, b in ranges]
    return np.asarray(np.bitwise_or.reduce(masks), np.uint8)


def take(
    camera: str,
    image: ImageData,
    description: CameraDescription,
    floor_point: Callable[[float, float, float], FloorPoint],
    looks: FieldLooks,
) -> Shot | None:
    """Return a picture, given what a camera answers; None if that does not say where the camera is."""
    width, height = image.description.width, image.description.height
    pixels = np.frombuffer(image.pixelData, np.uint8).reshape(height, width, 3)
    focal = description.fdistx * width / description.width
    middle = (width - 1) / 2, (height - 1) / 2
    camera_rays, robot_rays, torso_rays = [], [], []
    for u in (0.0, width - 1.0):
        for heights in _HEIGHTS:
            first, second = (floor_point(u, height - 1.0, each) for each in heights)
            if math.isfinite(first.distance) and math.isfinite(second.distance):
                break
        else:
            return None
        near = np.array((first.x, first.y, heights[0]))
        ray = np.array((second.x, second.y, heights[1])) - near
        ray /= np.linalg.norm(ray)
        eye = near - first.distance * ray
        robot_rays.append(ray)
        camera_rays.append(np.array((focal, middle[0] - u, middle[1] - (height - 1.0))))
        level = math.cos(first.tilt)
        torso_rays.append(
            np.array((level * math.cos(first.pan), level * math.sin(first.pan), -math.sin(first.tilt)))
        )
    own, robot, torso = (_axes(*rays) for rays in (camera_rays, robot_rays, torso_rays))
    axes = robot @ own.T
    facts = CameraFacts(
        camera, (0.0, 0.0, 0.0), 0.0, 2.0 * math.atan(width / 2.0 / focal), ((width, height),), (1.0,)
    )
    stamp = image.timeStamp
    place = CameraPlace(facts, stamp.seconds + 1e-6 * stamp.useconds, eye, axes, robot @ torso.T)
    to_ray = np.array(((0.0, 0.0, focal), (-1.0, 0.0, middle[0]), (0.0, -1.0, middle[1]))) / focal
    hsv = cv2.cvtColor(pixels, cv2.COLOR_RGB2HSV)
    return Shot(pixels, hsv, place, focal, axes @ to_ray, _grass(pixels, looks.grass))


def _axes(first: Array, second: Array) -> Array:
    """Return axes, as columns, that turn with two directions."""
    x = first / np.linalg.norm(first)
    z = np.cross(x, second)
    z /= np.linalg.norm(z)
    return np.column_stack((x, np.cross(z, x), z))


def _grass(pixels: Pixels, tint: Tint) -> Grass | None:
    """Return which pixels show grass, and which something as white as a line, whatever the exposure."""
    hsv = cv2.cvtColor(cv2.blur(pixels, (3, 3)), cv2.COLOR_RGB2HSV)
    some = hsv[::_STEP, ::_STEP]
    green = some[in_tint(some, tint) > 0]
    if len(green) < _FIELD * some.shape[0] * some.shape[1]:
        return None
    _, saturation, value = np.median(green, axis=0)
    white = cv2.inRange(hsv, (0, 0, 0.9 * value), (180, 0.55 * saturation, 255))
    return Grass(in_tint(hsv, tint, 0.75 * saturation) > 0, white > 0)


def runs_of(mask: Mask) -> tuple[Numbers, Numbers, Numbers]:
    """Return the row of each run along the rows of a mask, its first pixel, and the one after its last."""
    edges = np.diff(mask.astype(np.int8), axis=1, prepend=np.int8(0), append=np.int8(0))
    (at, begin), (_, end) = np.nonzero(edges == 1), np.nonzero(edges == -1)
    return at, begin, end


def on_floor(to_floor: Array, u: Array | Numbers, v: Array | Numbers) -> Array:
    """Return x and y of pixels on the floor, a row for each; NaN above the horizon."""
    x, y, front = to_floor @ (u, v, np.ones(len(u)))
    return np.asarray(np.column_stack((x, y)) / np.where(front > 0, front, np.nan)[:, None])


def horizon_of(to_floor: Array, columns: Numbers) -> Array:
    """Return the row of the horizon in columns."""
    return np.asarray(-(to_floor[2, 0] * columns + to_floor[2, 2]) / to_floor[2, 1])
