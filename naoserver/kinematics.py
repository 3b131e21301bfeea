"""Forward kinematics of the H25: where joints, effectors and cameras are, from the angles of the joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.body import H25, Joint
from naoserver.errors import InvalidCommand

Matrix = NDArray[np.float64]
"""A homogeneous transform, shape (4, 4)."""

_JOINTS: Final = {joint.name: joint for joint in H25.joints}
_MOVED_BY: Final = {joint.child: joint.name for joint in H25.joints}
_SIZES: Final = H25.facts["dimensions"]
_HAND: Final = (_SIZES["hand_offset_x"], 0.0, -_SIZES["hand_offset_z"])
_SOLE: Final = (0.0, 0.0, -_SIZES["foot_height"])


def rotation(axis: tuple[float, float, float], angle: float) -> Matrix:
    """Return the rotation by an angle in rad, right-handed about a unit vector (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned = np.eye(4)
    turned[:3, :3] += math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
    return turned


def _shift(vector: tuple[float, float, float]) -> Matrix:
    moved = np.eye(4)
    moved[:3, 3] = vector
    return moved


PARTS: Final[Mapping[str, tuple[str, Matrix]]] = {
    "Head": ("HeadPitch", np.eye(4)),
    "LArm": ("LWristYaw", _shift(_HAND)),
    "RArm": ("RWristYaw", _shift(_HAND)),
    "LLeg": ("LAnkleRoll", _shift(_SOLE)),
    "RLeg": ("RAnkleRoll", _shift(_SOLE)),
    **{
        name: ("HeadPitch", _shift(camera.position) @ rotation((0.0, 1.0, 0.0), camera.tilt))
        for camera, name in zip(H25.cameras, ("CameraTop", "CameraBottom"), strict=True)
    },
}
"""NAOqi's effectors and cameras: the joint that moves the link of each, and its place in the link's frame."""


def place_of(name: str, angles: Mapping[str, float]) -> Matrix:
    """Return the place of a joint, effector or camera, or of the torso itself, in the torso's frame.

    A joint's frame is that of the link that it moves. Raises InvalidCommand for what there is none of.
    """
    if name == "Torso":
        return np.eye(4)
    joint, offset = PARTS.get(name, (name, np.eye(4)))
    if joint not in _JOINTS:
        known = ", ".join(PARTS)
        raise InvalidCommand("name", f"there is no part {name[:60]!r}; there are Torso, {known} and joints")
    place: Matrix = offset
    link: Joint | None = _JOINTS[joint]
    while link is not None:
        place = _shift(link.origin) @ rotation(link.axis, angles[link.name]) @ place
        link = _JOINTS.get(_MOVED_BY.get(link.parent, ""))
    return place


def angles_of(matrix: Matrix) -> tuple[float, float, float]:
    """Return the angles about x, y and z in rad of a transform that turns about x, then y, then z."""
    return (
        math.atan2(matrix[2, 1], matrix[2, 2]),
        math.atan2(-matrix[2, 0], math.hypot(matrix[2, 1], matrix[2, 2])),
        math.atan2(matrix[1, 0], matrix[0, 0]),
    )
