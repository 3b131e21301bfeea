"""The operations of ALMotion that tell where parts of the body are."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from naoserver.capabilities import Odometry
from naoserver.errors import InvalidCommand
from naoserver.qi_service.access import Access
from naoserver.qi_service.kinematics import PARTS, Matrix, angles_of, place_of, rotation, sole_height
from naoserver.qi_service.values import text

__all__ = ["CartesianOperations"]

_TORSO: Final = 0
_WORLD: Final = 1
_ROBOT: Final = 2


class CartesianOperations:
    """Tell where parts of the body are: in the frame of the torso, of the world or of the robot.

    The world's frame is that of odometry; the robot's stands upright on the floor below the torso and looks
    where it does.
    """

    def __init__(self, access: Access) -> None:
        self._access = access

    def getPosition(self, name: object, frame: object, useSensorValues: object) -> list[float]:
        """Return x, y and z in m and the angles about x, y and z in rad of a joint, effector or camera."""
        place = self._place(name, frame, useSensorValues)
        return [*(float(value) for value in place[:3, 3]), *angles_of(place)]

    def getTransform(self, name: object, frame: object, useSensorValues: object) -> list[float]:
        """Return the 16 entries of a homogeneous transform, row by row, of a joint, effector or camera."""
        return [float(value) for value in self._place(name, frame, useSensorValues).ravel()]

    def getSensorNames(self) -> list[str]:
        """Return the names of the cameras and other sensors whose place is known."""
        return [name for name in PARTS if name.startswith("Camera")]

    def _place(self, name: object, frame: object, measured: object) -> Matrix:
        if frame not in (_TORSO, _WORLD, _ROBOT):
            raise InvalidCommand("frame", f"there is no frame {str(frame)[:60]!r}; 0 torso, 1 world, 2 robot")
        reading = self._access.body.read()
        values = reading.positions if measured else reading.commands
        angles = {joint.name: value for joint, value in zip(self._access.body.joints, values, strict=True)}
        place = place_of(text(name, "name"), angles)
        if frame == _TORSO:
            return place
        place = self._torso(angles) @ place
        if frame == _WORLD:
            at = self._odometry()
            floor = rotation((0.0, 0.0, 1.0), at.heading)
            floor[:2, 3] = at.x, at.y
            place = floor @ place
        return place

    def _torso(self, angles: dict[str, float]) -> Matrix:
        """Return the place of the torso in the robot's frame."""
        tilted = np.eye(4)
        if self._access.robot.senses is not None:
            inertial = self._access.robot.senses.read().inertial
            tilted = rotation((0.0, 1.0, 0.0), inertial.pitch) @ rotation((1.0, 0.0, 0.0), inertial.roll)
        tilted[2, 3] = sole_height(angles, tilted)
        return tilted

    def _odometry(self) -> Odometry:
        if self._access.walk is None:
            return Odometry(math.nan, 0.0, 0.0, 0.0)
        return self._access.walk.read()
