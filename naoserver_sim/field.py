"""A soccer field in the model: its lines as a texture that is drawn here, and its goals."""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver_sim.contacts import FRICTION, firm
from naoserver_sim.world import Field

_METRE: Final = 100
"""Pixels in a metre of the texture at most."""
_LARGEST: Final = 1536
"""Pixels along the longer side of the texture at most."""
_MARK: Final = 0.10
_POST_RADIUS: Final = 0.05
_NET: Final = (0.80, 0.82, 0.84, 0.35)
_NET_THICKNESS: Final = 0.01
_WHITE: Final = (0.96, 0.96, 0.96)


def add_field(spec: mujoco.MjSpec, field: Field) -> None:
    """Add the floor with the field's lines, and its goals."""
    half = (field.length / 2 + field.border, field.width / 2 + field.border)
    image = draw_field(field)
    height, width, channels = image.shape
    texture = spec.add_texture(
        name="field", type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=channels
    )
    texture.data = image.tobytes()
    material = spec.add_material(name="field", specular=0.0, shininess=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "field"
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[*half, 0.1],
        material="field",
        friction=FRICTION,
        **firm(),
    )
    for side in (-1, 1):
        _add_goal(spec, field, side)


def draw_field(field: Field) -> NDArray[np.uint8]:
    """Return a picture of the field with its border: rows from +y to -y, columns from -x to +x, RGB."""
    size = (field.length + 2 * field.border, field.width + 2 * field.border)
    scale = min(_METRE, _LARGEST / max(size))
    width, height = (round(scale * side) for side in size)
    x = (np.arange(width) + 0.5) / scale - size[0] / 2
    y = size[1] / 2 - (np.arange(height) + 0.5) / scale
    x, y = np.meshgrid(np.abs(x), np.abs(y))  # everything is there twice, mirrored
    # The share of a pixel that is white: how far it lies within a line, in pixels.
    white = np.zeros((height, width))
    half = field.line / 2

    def paint(distance: NDArray[np.float64]) -> None:
        """Paint where a distance in m to what is to be white is negative."""
        np.maximum(white, np.clip(0.5 - distance * scale, 0.0, 1.0), out=white)

    def rectangle(reach_x: tuple[float, float], reach_y: float) -> None:
        """Draw the outline of a rectangle from x to x, and from -y to y, along the middle of the line."""
        middle, extent = sum(reach_x) / 2, abs(reach_x[1] - reach_x[0]) / 2
        paint(np.abs(np.maximum(np.abs(x - middle) - extent, y - reach_y)) - half)

    rectangle((-field.length / 2, field.length / 2), field.width / 2)
    paint(np.maximum(x - half, y - field.width / 2))
    paint(np.abs(np.hypot(x, y) - field.circle_diameter / 2) - half)
    for depth, breadth in (field.penalty_area, field.goal_area):
        rectangle((field.length / 2 - depth, field.length / 2), breadth / 2)
    for mark in (0.0, field.length / 2 - field.penalty_mark):
        along = np.abs(x - mark)
        paint(np.maximum(along - _MARK / 2, y - half))
        paint(np.maximum(along - half, y - _MARK / 2))
    grass = np.array(field.grass) * (1.0 + 0.04 * np.sign(np.sin(x * math.pi / 0.5)))[..., None]
    colors = grass + white[..., None] * (np.array(_WHITE) - grass)
    return np.asarray(np.round(255 * np.clip(colors, 0, 1)), dtype=np.uint8)


def _add_goal(spec: mujoco.MjSpec, field: Field, side: int) -> None:
    line, top = side * field.length / 2, field.goal_height
    reach = field.goal_width / 2 + _POST_RADIUS
    for begin, end in (
        ((line, reach, 0.0), (line, reach, top)),
        ((line, -reach, 0.0), (line, -reach, top)),
        ((line, reach, top), (line, -reach, top)),
    ):
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            size=[_POST_RADIUS, 0, 0],
            fromto=[*begin, *end],
            rgba=[*_WHITE, 1],
            friction=FRICTION,
            **firm(),
        )
    back = line + side * field.goal_depth
    for center, half in (
        ((back, 0.0), (_NET_THICKNESS, reach)),
        (((line + back) / 2, reach), (field.goal_depth / 2, _NET_THICKNESS)),
        (((line + back) / 2, -reach), (field.goal_depth / 2, _NET_THICKNESS)),
    ):
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[*half, top / 2],
            pos=[*center, top / 2],
            rgba=_NET,
            friction=FRICTION,
            **firm(),
        )
