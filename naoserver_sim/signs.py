"""Boards with a picture on them: landmarks with a number, and faces."""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from hfsm_command import missing_package
from naoserver.errors import RobotError
from naoserver_sim.world import Sign

_PIXELS: Final = 128
_THICKNESS: Final = 0.01
_BACK: Final = (0.92, 0.92, 0.90, 1.0)

Picture = NDArray[np.uint8]


def draw_landmark(number: int) -> Picture:
    """Return an ArUco mark of 4 by 4 bits with a white border, RGB. Raises RobotError without OpenCV."""
    try:
        import cv2
    except ModuleNotFoundError as error:
        raise RobotError(f"landmarks: {missing_package(error, 'vision')}") from None
    marks = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    picture = np.full((_PIXELS, _PIXELS), 255, np.uint8)
    border = _PIXELS // 8
    picture[border:-border, border:-border] = marks.generateImageMarker(number, _PIXELS - 2 * border)
    return np.repeat(picture[..., None], 3, axis=2)


def draw_face() -> Picture:
    """Return a face before a wall, RGB: skin, two dark eyes, brows, a nose and a mouth."""
    image = Image.new("RGB", (_PIXELS, _PIXELS), (150, 165, 175))
    draw = ImageDraw.Draw(image)
    draw.ellipse((26, 6, 102, 70), fill=(70, 45, 30))  # hair
    draw.ellipse((30, 16, 98, 120), fill=(224, 172, 140))
    for left in (44, 72):
        draw.ellipse((left, 54, left + 12, 64), fill=(25, 20, 20))
        draw.line((left - 2, 47, left + 14, 46), fill=(120, 80, 55), width=2)
    draw.line((64, 62, 60, 80, 66, 82), fill=(196, 140, 110), width=2)
    draw.arc((50, 78, 78, 102), 20, 160, fill=(170, 70, 70), width=3)
    return np.asarray(image)


def add_picture(spec: mujoco.MjSpec, name: str, picture: Picture) -> None:
    """Add a material of a name that shows a picture: rows from +y to -y, columns from -x to +x, RGB."""
    height, width, channels = picture.shape
    flat = mujoco.mjtTexture.mjTEXTURE_2D
    texture = spec.add_texture(name=name, type=flat, width=width, height=height, nchannel=channels)
    texture.data = picture.tobytes()
    material = spec.add_material(name=name, specular=0.0, shininess=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


def add_sign(spec: mujoco.MjSpec, sign: Sign, name: str) -> None:
    """Add a board that faces where its heading points, and its picture."""
    picture = draw_face() if sign.landmark is None else draw_landmark(sign.landmark)
    add_picture(spec, name, picture)
    # Local axes: x to the right of who looks at it, y up, z towards him.
    facing, up = (math.cos(sign.heading), math.sin(sign.heading), 0.0), (0.0, 0.0, 1.0)
    turned = np.column_stack([np.cross(up, facing), up, facing])
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, turned.ravel())
    half, center = sign.size / 2, np.array((*sign.position, sign.height))
    firm, seen = spec.find_default("firm"), spec.find_default("seen")
    spec.worldbody.add_geom(
        firm,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[half, half, _THICKNESS / 2],
        pos=center - _THICKNESS * np.array(facing),
        quat=quat,
        rgba=_BACK,
    )
    spec.worldbody.add_geom(
        seen, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[half, half, 0.01], pos=center, quat=quat, material=name
    )
