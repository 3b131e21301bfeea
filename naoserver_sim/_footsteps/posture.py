"""Inverse kinematics: the angles of the legs for wanted soles, pelvis and center of mass.

Eighteen equations (position and attitude of both soles, attitude of the pelvis, center of mass) for as many
unknowns (the free base and the twelve joints of the legs), solved by damped least squares (Wampler, IEEE
Trans. SMC 16, 1986) from the last solution, which is near.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from naoserver.footsteps import Footsteps
from naoserver_sim._footsteps.limbs import Array, Limbs
from naoserver_sim._footsteps.vectors import axes, turn_between

_ROWS: Final = 18
_DAMPING: Final = 1e-5
_STANCE_ROUNDS: Final = 50
_LARGEST_ERROR: Final = 0.1
"""Error in m or rad that one round makes up for."""


@dataclass(frozen=True, slots=True)
class Target:
    """Where soles, pelvis and center of mass are to be, in m and rad."""

    center: Array
    soles: tuple[Array, Array]
    """Their middles."""
    feet: tuple[Array, Array]
    """Axes of the feet as columns."""
    pelvis: Array
    """Its axes as columns."""


def walking_stance(mj: mujoco.MjModel, limbs: Limbs, footsteps: Footsteps, angles: Array) -> Array:
    """Return the angles in rad of all joints of the body with which it stands ready to walk.

    `angles` are those to begin with, of a body that is about upright; only those of the legs are changed.
    """
    posture = Posture(mj, limbs, footsteps)
    upright = posture.data.qpos.copy()
    upright[limbs.base_qpos + 3 : limbs.base_qpos + 7] = 1.0, 0.0, 0.0, 0.0
    upright[limbs.qpos] = angles
    posture.put(np.array([0.0, 0.0, footsteps.com_height]), upright)
    half = 0.5 * footsteps.width
    level = axes(0.0)
    target = Target(
        center=np.array([0.0, 0.0, footsteps.com_height]),
        soles=(np.array([0.0, half, 0.0]), np.array([0.0, -half, 0.0])),
        feet=(level, level),
        pelvis=level,
    )
    posture.solve(target, angles, _STANCE_ROUNDS)
    found: Array = posture.data.qpos[limbs.qpos]
    return found


class Posture:
    """The planned body; each solution begins with the last one."""

    def __init__(self, mj: mujoco.MjModel, limbs: Limbs, footsteps: Footsteps) -> None:
        self._mj = mj
        self._limbs = limbs
        self._sole = np.array(footsteps.sole_middle)
        self.data: Final = mujoco.MjData(mj)
        """The planned body in the frame of the odometer."""
        self._legs = limbs.qpos[limbs.legs]
        base = np.arange(limbs.base_dof, limbs.base_dof + 6)
        self._unknowns = np.concatenate([base, limbs.leg_dofs])
        joints = mj.dof_jntid[limbs.leg_dofs]
        limited = mj.jnt_limited[joints].astype(bool)
        lower, upper = mj.jnt_range[joints].T
        self._lower, self._upper = np.where(limited, lower, -np.inf), np.where(limited, upper, np.inf)
        self._matrix = np.zeros((_ROWS, mj.nv))
        self._errors = np.zeros(_ROWS)
        self._change = np.zeros(mj.nv)
        self._damping = _DAMPING * np.eye(_ROWS)

    @property
    def legs(self) -> Array:
        """Angles in rad of the legs' joints, in the order of `Limbs.legs`."""
        angles: Array = self.data.qpos[self._legs]
        return angles

    def put(self, origin: Array, qpos: Array) -> None:
        """Begin with a body at other angles, with its base at a place."""
        at = self._limbs.base_qpos
        self.data.qpos[:] = qpos
        self.data.qpos[at : at + 3] = origin

    def look(self) -> None:
        """Compute where all links are."""
        mujoco.mj_kinematics(self._mj, self.data)
        mujoco.mj_comPos(self._mj, self.data)

    def sole(self, foot: int) -> Array:
        """Return the middle of a sole in m."""
        data, link = self.data, self._limbs.feet[foot]
        place: Array = data.xpos[link] + data.xmat[link].reshape(3, 3) @ self._sole
        return place

    def axes(self, link: int) -> Array:
        """Return the axes of a link as columns."""
        turned: Array = self.data.xmat[link].reshape(3, 3)
        return turned

    def solve(self, target: Target, angles: Array, rounds: int) -> None:
        """Come nearer to a target within some rounds, with all joints but those of the legs at `angles`.

        `angles` are those of all joints of the body in rad. A target out of reach comes as near as possible.
        """
        legs = self.legs
        self.data.qpos[self._limbs.qpos] = angles
        self.data.qpos[self._legs] = legs
        for _ in range(rounds):
            self._improve(target)

    def _improve(self, target: Target) -> None:
        mj, data, limbs = self._mj, self.data, self._limbs
        matrix, errors, change = self._matrix, self._errors, self._change
        self.look()
        for foot, link in enumerate(limbs.feet):
            row, turned = 6 * foot, data.xmat[link].reshape(3, 3)
            sole = data.xpos[link] + turned @ self._sole
            mujoco.mj_jac(mj, data, matrix[row : row + 3], matrix[row + 3 : row + 6], sole, link)
            errors[row : row + 3] = target.soles[foot] - sole
            errors[row + 3 : row + 6] = turn_between(turned, target.feet[foot])
        mujoco.mj_jacBody(mj, data, None, matrix[12:15], limbs.pelvis)
        errors[12:15] = turn_between(data.xmat[limbs.pelvis].reshape(3, 3), target.pelvis)
        mujoco.mj_jacSubtreeCom(mj, data, matrix[15:18], limbs.base)
        errors[15:18] = target.center - data.subtree_com[limbs.base]
        np.clip(errors, -_LARGEST_ERROR, _LARGEST_ERROR, out=errors)
        used = matrix[:, self._unknowns]
        change[self._unknowns] = np.linalg.solve(used.T @ used + self._damping, used.T @ errors)
        mujoco.mj_integratePos(mj, data.qpos, change, 1.0)
        data.qpos[self._legs] = np.minimum(np.maximum(self.legs, self._lower), self._upper)
