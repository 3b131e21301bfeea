"""The loads of the feet, from the torques of the legs' motors: these bodies have no sensors in their soles.

At rest, the torques of a leg are those of the leg's weight and of the floor's force on its foot. A straight
leg bears any load without a torque of its knee: where the torques say little, a foot counts as bearing half
the weight.
"""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from naoserver.footsteps import GRAVITY
from naoserver_sim._footsteps.estimator import Estimator
from naoserver_sim._footsteps.limbs import Array, Limbs

_SMOOTHING: Final = 0.2
"""Time constant in s: accelerations are not accounted for."""
_TRUST: Final = 0.02
"""Lever arm in m below which a torque says little about a force."""
_UP: Final = slice(2, None, 6)
"""The upward forces among the forces and moments of the floor on both feet."""


class Loads:
    """Estimate how much the left and the right foot bear, in N."""

    def __init__(self, mj: mujoco.MjModel, limbs: Limbs, estimator: Estimator) -> None:
        self._mj = mj
        self._limbs = limbs
        self._estimator = estimator
        self._damping = mj.dof_damping[limbs.leg_dofs]
        self.weight: Final = GRAVITY * float(mj.body_subtreemass[limbs.base])
        """Of the body in N."""
        self._bias = np.zeros(mj.nv)
        self._more = np.zeros(12)
        self._usual = np.zeros(12)
        self._usual[_UP] = 0.5 * self.weight
        self._trust = _TRUST**2 * np.eye(12)
        self.reset()

    def reset(self) -> None:
        """Begin with a robot that stands."""
        self.feet = np.full(2, 0.5 * self.weight)

    @property
    def shares(self) -> tuple[float, float]:
        """Parts of the load that the left and the right foot bear, 1 together."""
        left, right = np.maximum(self.feet, 1.0).tolist()
        return left / (left + right), right / (left + right)

    def tick(self, seconds: float, torques: Array) -> None:
        """Advance by some seconds, at the end of which the legs' motors give `torques` in N m.

        `torques` are in the order of `Limbs.legs`.
        """
        data, legs = self._estimator.data, self._limbs.leg_dofs
        mujoco.mj_rne(self._mj, data, 0, self._bias)
        lever = self._estimator.levers.take(legs, axis=1)  # a leg moves no other foot
        given = torques - self._damping * data.qvel[legs]
        unexplained = self._bias[legs] - given - self._usual @ lever
        matrix = lever @ lever.T + self._trust
        mujoco.mju_cholFactor(matrix, 0.0)
        mujoco.mju_cholSolve(self._more, matrix, lever @ unexplained)
        loads = np.maximum((self._usual + self._more)[_UP], 0.0)
        self.feet += (loads - self.feet) * min(seconds / _SMOOTHING, 1.0)
