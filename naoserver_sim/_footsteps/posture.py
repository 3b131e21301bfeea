"""Inverse kinematics: the angles of the legs for wanted soles, pelvis and center of mass.

Eighteen equations (position and attitude of both soles, attitude of the pelvis, center of mass) for as many
unknowns (the free base and the twelve joints of the legs), solved by damped least squares (Wampler, IEEE
Trans. SMC 16, 1986). Hips whose axes do not meet have no closed form. A solution begins with the last one,
moved on as it moved before, which is so near that the matrix of an earlier round is good enough.
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from naoserver.bodies.capabilities import Vector
from naoserver.bodies.footsteps import Footsteps
from naoserver_sim._footsteps.estimator import Estimator
from naoserver_sim._footsteps.limbs import Array, Limbs, Quaternion, quaternion

_ROWS: Final = 18
_DAMPING: Final = 1e-5
_STANCE_ROUNDS: Final = 50
_LARGEST_ERROR: Final = 0.1
"""Error in m or rad that one round makes up for."""
_SMALL_ERROR: Final = 0.008
"""Error in m or rad up to which a round needs no new matrix."""
_MOST_ROUNDS: Final = 5
"""Rounds with a matrix while errors are larger than those of a robot that stands."""
_STILL_ERROR: Final = 0.001
"""Error in m or rad up to which it stands."""


@dataclass(frozen=True, slots=True)
class Target:
    """Where soles, pelvis and center of mass are to be, in m and rad."""

    places: tuple[Vector, Vector, Vector]
    """Of the middles of left and right sole, and of the center of mass."""
    turns: tuple[Quaternion, Quaternion, Quaternion]
    """Of left foot, right foot and pelvis."""


def walking_stance(mj: mujoco.MjModel, limbs: Limbs, footsteps: Footsteps, angles: Array) -> Array:
    """Return the angles in rad of all joints of the body with which it stands ready to walk.

    `angles` are those to begin with, of a body that is about upright; only those of the legs are changed.
    """
    posture = Posture(mj, limbs)
    upright = posture.data.qpos.copy()
    upright[limbs.base_qpos + 3 : limbs.base_qpos + 7] = 1.0, 0.0, 0.0, 0.0
    upright[limbs.qpos] = angles
    posture.put(np.array([0.0, 0.0, footsteps.com_height]), upright)
    half = 0.5 * footsteps.width
    target = Target(
        places=((0.0, half, 0.0), (0.0, -half, 0.0), (0.0, 0.0, footsteps.com_height)),
        turns=(quaternion(0.0), quaternion(0.0), quaternion(0.0)),
    )
    posture.solve(target, angles, _STANCE_ROUNDS)
    found: Array = posture.data.qpos[limbs.qpos]
    return found


class Posture:
    """The planned body; each solution begins with the last one."""

    def __init__(self, mj: mujoco.MjModel, limbs: Limbs) -> None:
        self._mj = mj
        self._limbs = limbs
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
        self._moved, self._turned = self._matrix[:6].reshape(2, 3, -1), self._matrix[9:15].reshape(2, 3, -1)
        self._used = np.zeros((_ROWS, _ROWS))
        self._factor = np.zeros((_ROWS, _ROWS))
        self._stale = True
        self._age = 0  # rounds since the matrix is known
        self._errors = np.zeros(_ROWS)
        self._change = np.zeros(mj.nv)
        self._found = np.zeros(_ROWS)
        self._damping = _DAMPING * np.eye(_ROWS)
        # Views of what `_differences` compares.
        data = self.data
        self._places = [data.site_xpos[site] for site in limbs.middles] + [data.subtree_com[limbs.base]]
        self._turns = [data.xquat[link] for link in (*limbs.feet, limbs.pelvis)]
        self._before = self.data.qpos.copy()
        self.moved: Final[Array] = np.zeros(mj.nv)
        """How all degrees of freedom moved with the last solution, in rad and m."""

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
        self._stale = True
        self.moved[:] = 0.0

    def update(self) -> None:
        """Compute where all links are."""
        mujoco.mj_kinematics(self._mj, self.data)
        mujoco.mj_comPos(self._mj, self.data)

    def axes(self, link: int) -> Array:
        """Return the axes of a link as columns."""
        turned: Array = self.data.xmat[link].reshape(3, 3)
        return turned

    def solve(self, target: Target, angles: Array, rounds: int = 1) -> None:
        """Come nearer to a target within some rounds, with all joints but those of the legs at `angles`.

        `angles` are those of all joints of the body in rad. A target out of reach comes as near as possible.
        One round from the posture of the tick before comes within half a millimeter in a fast walk.
        """
        qpos, legs = self.data.qpos, self._legs
        self._before[:] = qpos
        self._change[self._unknowns] = self.moved[self._unknowns]
        mujoco.mj_integratePos(self._mj, qpos, self._change, 1.0)
        there = qpos[legs]
        qpos[self._limbs.qpos] = angles
        qpos[legs] = there
        for _ in range(rounds):
            self._improve(target)
        mujoco.mj_differentiatePos(self._mj, self.moved, 1.0, self._before, qpos)

    def _improve(self, target: Target) -> None:
        self.update()
        differences = self._differences(target)
        largest = max(map(abs, differences))
        errors = self._errors
        errors[:] = differences
        if self._stale or largest > (_SMALL_ERROR if self._age < _MOST_ROUNDS else _STILL_ERROR):
            self._linearize()
            errors = np.minimum(np.maximum(errors, -_LARGEST_ERROR), _LARGEST_ERROR)
        self._age += 1
        mujoco.mju_cholSolve(self._found, self._factor, np.dot(errors, self._used))
        self._change[self._unknowns] = self._found
        mujoco.mj_integratePos(self._mj, self.data.qpos, self._change, 1.0)
        self.data.qpos[self._legs] = np.minimum(np.maximum(self.legs, self._lower), self._upper)

    def _differences(self, target: Target) -> list[float]:
        """Return by how much soles and center of mass have to move, and feet and pelvis to turn."""
        errors: list[float] = []
        for (x, y, z), place in zip(target.places, self._places, strict=True):
            at_x, at_y, at_z = place.tolist()
            errors += x - at_x, y - at_y, z - at_z
        for (w, x, y, z), turn in zip(target.turns, self._turns, strict=True):
            # Twice the vector of the quaternion of the turn between both.
            at_w, at_x, at_y, at_z = turn.tolist()
            twice = 2.0 if w * at_w + x * at_x + y * at_y + z * at_z > 0.0 else -2.0
            errors += (
                twice * (at_w * x - w * at_x + z * at_y - y * at_z),
                twice * (at_w * y - w * at_y + x * at_z - z * at_x),
                twice * (at_w * z - w * at_z + y * at_x - x * at_y),
            )
        return errors

    def _linearize(self) -> None:
        """Compute how the unknowns change what `_differences` returns."""
        mj, data, limbs, matrix = self._mj, self.data, self._limbs, self._matrix
        for site, moves, turns in zip(limbs.middles, self._moved, self._turned, strict=True):
            mujoco.mj_jacSite(mj, data, moves, turns, site)
        mujoco.mj_jacSubtreeCom(mj, data, matrix[6:9], limbs.base)
        mujoco.mj_jacBody(mj, data, None, matrix[15:], limbs.pelvis)
        self._used = matrix.take(self._unknowns, axis=1)
        self._factor = self._used.T @ self._used + self._damping
        mujoco.mju_cholFactor(self._factor, 0.0)
        self._stale = False
        self._age = 0


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

    def set_angles(self, angles: Array) -> None:
        """Set the angles in rad of all joints of the body."""
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
