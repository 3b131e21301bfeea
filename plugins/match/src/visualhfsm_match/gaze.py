"""Where the neck must point for a robot's cameras to see a place, and what they see then.

The robot stands upright in its resting posture. Places are in its frame in m: on the floor below its root, x
forward, y to the left.
"""

from __future__ import annotations

import cmath
import math
from typing import Final

import numpy as np

from naoserver.bodies.body import Body
from naoserver.bodies.kinematics import Matrix, kinematics_of, matrix_of
from naoserver.bodies.parts import Axis, CameraFacts, HingeAxis
from naoserver.errors import RobotError
from zenoh_ice.data.text import sentence

_ROUNDS: Final = 6
"""A camera moves as the neck tilts, most if the neck is a waist: each round halves the error at least."""
_BOW: Final = 0.2
"""Largest tilt in rad of a waist that serves as a neck: a G1 that bows by 0.5 falls in what it does next."""
_SPEEDS: Final = 2.5, 1.0
"""How fast a head and a waist turn in rad/s."""
_SIDES: Final = 0.0, 0.9, 1.8, -0.9, -1.8
"""Pans in rad whose pictures overlap."""
_SEEN: Final = 0.9
"""Share of a picture, from its middle, that counts as seen: a robot that walks sways."""


class Gaze:
    """The gaze of a body with its first camera, and the others that its neck carries with it.

    Raises RobotError for a body without a neck, or without a camera.
    """

    def __init__(self, body: Body) -> None:
        neck = body.neck
        if neck is None or not body.cameras:
            raise RobotError(
                sentence(f"{body.title or body.name} cannot look anywhere: it has no neck, or no camera")
            )
        self._body = body
        self._pan, self._tilt = (neck.axes[axis] for axis in (Axis.PAN, Axis.TILT))
        self._by_waist = self._tilt.joint not in body.groups.head
        fastest = max(body.joint[axis.joint].max_velocity for axis in (self._pan, self._tilt))
        self.pace: Final = min(1.0, _SPEEDS[self._by_waist] / fastest)
        """The fraction of its full speed at which the neck may turn while the robot stands or walks."""
        self._link = body.cameras[0].link
        together = (camera for camera in body.cameras if camera.link == self._link)
        self.cameras: Final = sorted(together, key=lambda camera: -camera.tilt)
        """The cameras, the one that looks down most first."""
        self._angles = dict(body.resting_angles)
        self._kinematics = kinematics_of(body)
        self._torso = self._kinematics.torso_place(self._angles)
        lowest, highest = self.cameras[0], self.cameras[-1]
        self._middle = _turned(lowest, (lowest.tilt + highest.tilt) / 2)
        self.height: Final = float((self._link_place(0.0, 0.0) @ self._middle)[2, 3])
        """Height of the cameras above the floor in m, with the neck at 0: a measure of the robot's size."""
        self.far: Final = 2.5 * self.height
        """A distance in m at which they see much of the floor."""
        self.close: Final = 0.7 * self.height
        """A distance in m at which one camera, turned to it, sees the floor from before the feet on."""
        lower, upper = self._range(self._pan)
        self.sides: Final = [pan for pan in _SIDES if lower < pan < upper]
        """The pans of the neck in rad that show all sides but the back, as far as it turns."""

    def at(self, x: float, y: float, height: float = 0.0) -> tuple[float, float]:
        """Return pan and tilt of the neck in rad that bring a place to the middle of what the cameras see.

        They are as near to that as the range of the neck lets them be.
        """
        pan = _within(self._range(self._pan), math.atan2(y, x))
        limits = self._tilts(pan)
        tilt = _within(limits, 0.0)
        for _ in range(_ROUNDS):
            ahead, _, up = _seen_from(self._link_place(pan, tilt) @ self._middle, (x, y, height))
            tilt = _within(limits, tilt + math.atan2(-up, ahead))
        return pan, tilt

    def sees(self, x: float, y: float, height: float = 0.0) -> bool:
        """Return whether a camera sees a place when the neck points there as far as it can."""
        link = self._link_place(*self.at(x, y, height))
        for camera in self.cameras:
            ahead, left, up = _seen_from(link @ _turned(camera, camera.tilt), (x, y, height))
            width, rows = camera.sizes[0]
            half = _SEEN * ahead * math.tan(camera.horizontal_fov / 2)
            if abs(left) < half and abs(up) < half * rows / width:
                return True
        return False

    def round(self, *, near: bool) -> list[complex]:
        """Return where to look for something on the floor, one place after the other: x + iy in m.

        `near` is for a robot whose cameras do not show the floor before its feet when they show the far one.
        """
        pans = sorted(self.sides)
        far, close = ([cmath.rect(way, pan) for pan in pans] for way in (self.far, self.close))
        ahead = pans.index(0.0)
        if near:  # on the way from left to right it looks at the near floor
            return [*far[ahead:], *close[::-1], *far[:ahead]]
        return [*far[ahead:], *far[:ahead][::-1], 0.3 + 0j, self.far + 0j]

    def _link_place(self, pan: float, tilt: float) -> Matrix:
        """Return the place of the cameras' link in the robot's frame."""
        angles = self._angles | {
            self._pan.joint: self._pan.joint_angle(pan),
            self._tilt.joint: self._tilt.joint_angle(tilt),
        }
        return self._torso @ self._kinematics.link_place(self._link, angles)

    def _tilts(self, pan: float) -> tuple[float, float]:
        """Return the range of tilts at a pan."""
        lower, upper = self._range(self._tilt)
        for table in self._body.tables:
            if (table.independent, table.dependent) == (self._pan.joint, self._tilt.joint):
                least, most = sorted(map(self._tilt.of, table.at(self._pan.joint_angle(pan))))
                lower, upper = max(lower, least), min(upper, most)
        return lower, min(upper, _BOW) if self._by_waist else upper

    def _range(self, axis: HingeAxis) -> tuple[float, float]:
        """Return the range of an axis."""
        joint = self._body.joint[axis.joint]
        lower, upper = sorted((axis.of(joint.lower), axis.of(joint.upper)))
        return lower, upper


def _turned(camera: CameraFacts, tilt: float) -> Matrix:
    """Return the place of a camera in its link's frame, with another tilt in rad."""
    return matrix_of((*camera.position, 0.0, tilt, 0.0))


def _seen_from(camera: Matrix, place: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return how far a place is ahead of a camera, to its left, and above it, in m."""
    ahead, left, up = camera[:3, :3].T @ (np.array(place) - camera[:3, 3])
    return float(ahead), float(left), float(up)


def _within(limits: tuple[float, float], value: float) -> float:
    return min(max(value, limits[0]), limits[1])
