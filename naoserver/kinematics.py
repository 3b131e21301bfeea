"""Kinematics of the body: places of its parts at given angles of the joints, and angles that reach a place.

Joints without a given angle are fixed at 0: the body lacks them, as an H21 lacks those of its hands.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
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
_COUPLED: Final = (H25.couplings[0].leader, H25.couplings[0].follower)
_HERE: Final[Matrix] = np.eye(4)
_MOST_STEPS: Final = 60
_NEAR_ENOUGH: Final = 1e-4  # rad
_DAMPING: Final = 1e-4
_LARGEST_STEP: Final = 0.3  # rad
_NO_TURN: Final = 1e-9


def rotation(axis: tuple[float, float, float], angle: float) -> Matrix:
    """Return the rotation by an angle in rad, right-handed about a unit vector (Rodrigues)."""
    cross = _cross(axis)
    return _HERE + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def _cross(axis: tuple[float, float, float]) -> Matrix:
    """Return the matrix of the cross product of an axis with a vector; its last row and column are 0."""
    x, y, z = axis
    return np.array([[0.0, -z, y, 0.0], [z, 0.0, -x, 0.0], [-y, x, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])


def _shift(vector: tuple[float, float, float]) -> Matrix:
    moved = np.eye(4)
    moved[:3, 3] = vector
    return moved


PARTS: Final[Mapping[str, tuple[str, Matrix]]] = {
    "Head": ("HeadPitch", _HERE),
    "LArm": ("LWristYaw", _shift(_HAND)),
    "RArm": ("RWristYaw", _shift(_HAND)),
    "LLeg": ("LAnkleRoll", _shift(_SOLE)),
    "RLeg": ("RAnkleRoll", _shift(_SOLE)),
    **{
        name: ("HeadPitch", _shift(camera.position) @ rotation((0.0, 1.0, 0.0), camera.tilt))
        for camera, name in zip(H25.cameras, ("CameraTop", "CameraBottom"), strict=True)
    },
}
"""NAOqi's effectors and cameras: the joint that moves each one's link, and its place in the link's frame."""


def place_of(name: str, angles: Mapping[str, float]) -> Matrix:
    """Return the place of a joint, effector or camera, or of the torso itself, in the torso's frame.

    A joint's frame is that of the link that it moves. Raises InvalidCommand for an unknown name.
    """
    if name not in ("Torso", *PARTS, *angles):
        known = ", ".join(PARTS)
        raise InvalidCommand("name", f"there is no part {name[:60]!r}; there are Torso, {known} and joints")
    return _frames(name, angles)[1]


def torso_place(angles: Mapping[str, float], roll: float = 0.0, pitch: float = 0.0) -> Matrix:
    """Return the place of the torso in the robot's frame: on the floor below it, upright, in its heading.

    `roll` and `pitch` are its angles to the vertical in rad. The lower sole stands on the floor.
    """
    torso = rotation((0.0, 1.0, 0.0), pitch) @ rotation((1.0, 0.0, 0.0), roll)
    torso[2, 3] = -min(float((torso @ place_of(leg, angles))[2, 3]) for leg in ("LLeg", "RLeg"))
    return torso


def _frames(name: str, angles: Mapping[str, float]) -> tuple[list[tuple[Joint, Matrix]], Matrix]:
    """Return the joints that move a part, from the torso on, with their places, and the part's own place."""
    joint, offset = PARTS.get(name, (name, _HERE))
    place = _HERE
    frames: list[tuple[Joint, Matrix]] = []
    for link, fixed, sine, versine in _chain(joint):
        angle = angles.get(link.name, 0.0)
        place = place @ (fixed + math.sin(angle) * sine + (1.0 - math.cos(angle)) * versine)
        if link.name in angles:
            frames.append((link, place))
    return frames, place @ offset


@functools.lru_cache(64)
def _chain(joint: str) -> list[tuple[Joint, Matrix, Matrix, Matrix]]:
    """Return the joints from the torso to a joint, each with the parts of its transform at an angle a.

    The transform is the first matrix, plus sin a times the second, plus (1 - cos a) times the third.
    """
    if joint not in _JOINTS:
        return []
    link = _JOINTS[joint]
    origin, cross = _shift(link.origin), _cross(link.axis)
    here = (link, origin, origin @ cross, origin @ cross @ cross)
    return [*_chain(_MOVED_BY.get(link.parent, "")), here]


def angles_of(matrix: Matrix) -> tuple[float, float, float]:
    """Return the angles about x, y and z in rad of a transform that turns about x, then y, then z."""
    return (
        math.atan2(matrix[2, 1], matrix[2, 2]),
        math.atan2(-matrix[2, 0], math.hypot(matrix[2, 1], matrix[2, 2])),
        math.atan2(matrix[1, 0], matrix[0, 0]),
    )


def matrix_of(place: Sequence[float]) -> Matrix:
    """Return the transform of x, y and z in m and the angles about x, y and z in rad."""
    x, y, z, about_x, about_y, about_z = place
    turned = rotation((0.0, 0.0, 1.0), about_z) @ rotation((0.0, 1.0, 0.0), about_y)
    return _shift((x, y, z)) @ turned @ rotation((1.0, 0.0, 0.0), about_x)


def numbers_of(place: Matrix) -> list[float]:
    """Return x, y and z in m and the angles about x, y and z in rad of a transform: undo `matrix_of`."""
    return [*(float(part) for part in place[:3, 3]), *angles_of(place)]


def reach(
    goals: Mapping[str, tuple[Matrix, Sequence[bool]]], angles: Mapping[str, float]
) -> dict[str, float]:
    """Return angles of all joints with which effectors are as near to their goals as possible.

    A goal is a place in the torso's frame, and which of x, y, z and of the rotations about them count. The
    search starts at `angles` and moves only the joints between torso and effectors, within their limits:
    damped least squares (Levenberg, Q. Appl. Math. 2, 1944; Marquardt, SIAM J. Appl. Math. 11, 1963).
    """
    found = dict(angles)
    moved = list(dict.fromkeys(joint for name in goals for joint, _ in _frames(name, angles)[0]))
    columns = {joint.name: i for i, joint in enumerate(moved)}
    if columns.keys() >= set(_COUPLED):  # one motor
        columns[_COUPLED[1]] = columns[_COUPLED[0]]
    error, jacobian = _errors(goals, found, columns)
    damping = _DAMPING
    for _ in range(_MOST_STEPS):
        damped = jacobian @ jacobian.T + damping * np.eye(len(error))
        change = np.clip(jacobian.T @ np.linalg.solve(damped, error), -_LARGEST_STEP, _LARGEST_STEP)
        tried = dict(found)
        for joint in moved:
            turned = found[joint.name] + float(change[columns[joint.name]])
            tried[joint.name] = min(max(turned, joint.lower), joint.upper)
        error_then, jacobian_then = _errors(goals, tried, columns)
        if error_then @ error_then < error @ error:
            found = tried
            error = error_then
            jacobian = jacobian_then
            damping = max(damping / 3.0, _DAMPING)
        else:
            damping *= 10.0
        if np.abs(change).max(initial=0.0) < _NEAR_ENOUGH:
            break
    return found


def _errors(
    goals: Mapping[str, tuple[Matrix, Sequence[bool]]],
    angles: Mapping[str, float],
    columns: Mapping[str, int],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far effectors are from their goals, and how each joint's angle changes that."""
    errors, rows = [], []
    for name, (goal, counts) in goals.items():
        frames, place = _frames(name, angles)
        effects = np.zeros((6, max(columns.values()) + 1))
        for joint, frame in frames:
            axis = frame[:3, :3] @ np.array(joint.axis)
            effects[:3, columns[joint.name]] += np.cross(axis, place[:3, 3] - frame[:3, 3])
            effects[3:, columns[joint.name]] += axis
        wanted = np.array(counts, bool)
        errors.append(_difference(place, goal)[wanted])
        rows.append(effects[wanted])
    return np.concatenate(errors), np.concatenate(rows)


def _difference(place: Matrix, goal: Matrix) -> NDArray[np.float64]:
    """Return the translation in m and the rotation in rad, as a vector along its axis, from place to goal."""
    turn = goal[:3, :3] @ place[:3, :3].T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2.0
    size = float(np.linalg.norm(axis))
    angle = math.atan2(size, (float(np.trace(turn)) - 1.0) / 2.0)
    return np.concatenate([goal[:3, 3] - place[:3, 3], axis * (angle / size if size > _NO_TURN else 1.0)])


def between(start: Matrix, goal: Matrix, share: float) -> Matrix:
    """Return the place at a share of the straight line, and of the shortest rotation, between two places."""
    way = share * _difference(start, goal)
    angle = float(np.linalg.norm(way[3:]))
    place = start.copy()
    place[:3, 3] += way[:3]
    if angle > _NO_TURN:
        x, y, z = (float(part) for part in way[3:] / angle)
        place[:3, :3] = rotation((x, y, z), angle)[:3, :3] @ start[:3, :3]
    return place


def center_of_mass(name: str, angles: Mapping[str, float]) -> tuple[float, NDArray[np.float64]]:
    """Return the mass in kg of a part of the body and its center in m, in the torso's frame.

    The part is `Body`, a joint with the link that it moves, or the chain of an effector. Raises
    InvalidCommand for another.
    """
    if name in ("Head", "LArm", "RArm", "LLeg", "RLeg"):
        chain = {joint.name for joint, _ in _frames(name, dict.fromkeys(_JOINTS, 0.0))[0]}
        links = [link for link in H25.links if link.parent_joint in chain]
    else:
        known = name in ("Body", "Torso", *angles)
        links = [link for link in H25.links if known and name in ("Body", link.parent_joint or "Torso")]
    mass = sum(link.mass for link in links)
    if not links:
        raise InvalidCommand(
            "name", f"there is no part {name[:60]!r}; there are Body, Torso, chains and joints"
        )
    places = ((link, _frames(link.parent_joint or "Torso", angles)[1]) for link in links)
    weighted = sum(link.mass * (place @ np.array([*link.com, 1.0]))[:3] for link, place in places)
    return mass, np.asarray(weighted / mass if mass else np.zeros(3), np.float64)
