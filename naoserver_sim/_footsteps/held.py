"""A posture that somebody else commands: where its center of mass belongs, and whether it is a stance."""

from __future__ import annotations

import cmath
from typing import Final

import mujoco
import numpy as np

from naoserver.footsteps import Footsteps
from naoserver_sim._footsteps.estimator import Estimator
from naoserver_sim._footsteps.limbs import Array, Limbs

_LEVEL: Final = 0.998
"""Least cosine of the angle between the soles that count as parallel."""
_UPRIGHT: Final = 0.99
"""Least cosine of the angle of the pelvis to the vertical in a stance."""
_SAME_HEIGHT: Final = 0.01
"""Largest difference of the soles' heights in m in a stance."""
_NEAR: Final = 0.01
"""Largest distance in m of the center of mass from its height in a stance."""


class HeldPosture:
    """Commanded angles of all joints, on a foot that is flat on the floor."""

    def __init__(self, mj: mujoco.MjModel, limbs: Limbs, footsteps: Footsteps) -> None:
        self._mj = mj
        self._limbs = limbs
        self._footsteps = footsteps
        self._data = mujoco.MjData(mj)
        self._data.qpos[limbs.base_qpos : limbs.base_qpos + 7] = 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
        self._soles = np.zeros((2, 3))

    def take(self, angles: Array) -> None:
        """Take the angles in rad of all joints of the body."""
        data, limbs = self._data, self._limbs
        data.qpos[limbs.qpos] = angles
        mujoco.mj_kinematics(self._mj, data)
        mujoco.mj_comPos(self._mj, data)
        self._soles = limbs.soles(data)

    def center(self, foot: int, estimator: Estimator) -> complex:
        """Return the place of the center of mass on the floor, by the place of a foot that bears it."""
        away = self._center_over(foot)
        ahead = cmath.rect(1.0, estimator.heading_of(foot))
        return estimator.place_of(foot) + complex(away[0], away[1]) * ahead

    def is_over(self, foot: int) -> bool:
        """Return whether the center of mass is over a sole, so that the foot alone can bear it."""
        return abs(float(self._center_over(foot)[1])) <= self._footsteps.sole_half[1]

    def is_stance(self) -> bool:
        """Return whether it stands on both flat feet, about as high as in the walk, its pelvis upright."""
        limbs, footsteps = self._limbs, self._footsteps
        left, right = (self._axes(link) for link in limbs.feet)
        between = left.T @ (self._soles[1] - self._soles[0])
        return bool(
            left[:, 2] @ right[:, 2] > _LEVEL
            and left[:, 2] @ self._axes(limbs.pelvis)[:, 2] > _UPRIGHT
            and abs(between[2]) < _SAME_HEIGHT
            and -between[1] > footsteps.narrowest
            and abs(self._center_over(0)[2] - footsteps.com_height) < _NEAR
        )

    def _center_over(self, foot: int) -> Array:
        """Return the center of mass in m in the frame of a sole."""
        center = self._data.subtree_com[self._limbs.base]
        away: Array = self._axes(self._limbs.feet[foot]).T @ (center - self._soles[foot])
        return away

    def _axes(self, link: int) -> Array:
        turned: Array = self._data.xmat[link].reshape(3, 3)
        return turned
