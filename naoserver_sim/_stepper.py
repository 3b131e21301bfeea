"""The steps of the physics in a control tick, with the kind of solver that is the faster one just then."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from naoserver_sim._motors import Motors
from naoserver_sim._share import RobotData

STEPS_PER_TICK: Final = 4
"""Physics steps in a control tick: 2.5 ms each, 10 ms in all, the cycle of the robot's motor boards."""
_SENSORS: Final = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
_DENSE: Final = int(mujoco.mjtJacobian.mjJAC_DENSE)
_SPARSE: Final = int(mujoco.mjtJacobian.mjJAC_SPARSE)
_STATE: Final = mujoco.mjtState.mjSTATE_INTEGRATION
_MANY: Final = 2.5
"""Mean iterations of the solver in a step from which a sparse Jacobian is faster than a dense one."""
_SPARSE_FROM: Final = 60
"""Degrees of freedom from which MuJoCo's own choice is a sparse Jacobian."""
_SMOOTHING: Final = 0.1
"""Part of this mean that the last step of a tick is."""
_CONVERGED: Final = 0.01
"""Largest gradient, scaled as by MuJoCo, at which the solver may end: usually, it is less than a tenth."""
_DENSE_TICKS: Final = 100
"""Ticks with a dense Jacobian after one in which the sparse solver did not converge."""


class Stepper:
    """Step the physics, for the thread of the physics only.

    Limbs do not move each other's contacts, so a sparse Jacobian saves a quarter of a step in which the
    solver iterates, as in a walk. But MuJoCo's sparse solver does not always converge where several limbs
    touch each other: there bodies would fly apart. Such a tick is done again with a dense Jacobian.
    """

    def __init__(
        self, mj: mujoco.MjModel, data: mujoco.MjData, motors: Sequence[tuple[Motors, RobotData]]
    ) -> None:
        """`motors` are those of each robot, with its state; more may be added."""
        self._mj = mj
        self._data = data
        self._motors = motors
        self._option = mj.opt
        self._sensing = mj.opt.disableflags & ~_SENSORS
        self._usual = mj.opt.jacobian
        # MuJoCo takes a sparse one by itself in large models, as those of several robots.
        self._many = _MANY if mj.nv < _SPARSE_FROM else 0.0
        self._before = np.zeros(mujoco.mj_stateSize(mj, _STATE))
        self._dense_ticks = 0
        self._mean = 0.0  # of the iterations
        # Views: iterations in each island of constraints, gradient after each of them.
        self._iterations = data.solver_niter
        self._gradients = data.solver.gradient.reshape(len(data.solver_niter), -1)

    def tick(self) -> None:
        """Step for a control tick. Sensors measure only in its last step: nobody reads them before."""
        self._option.jacobian = self._usual
        self._mean += _SMOOTHING * (int(self._iterations[0]) - self._mean)
        if self._dense_ticks > 0:
            self._dense_ticks -= 1
            self._option.jacobian = _DENSE
        elif self._mean >= self._many:
            mujoco.mj_getState(self._mj, self._data, self._before, _STATE)
            self._option.jacobian = _SPARSE
            if self._step_checked():
                return
            self._dense_ticks = _DENSE_TICKS
            self._option.jacobian = _DENSE
            mujoco.mj_setState(self._mj, self._data, self._before, _STATE)
        self._option.disableflags = self._sensing | _SENSORS
        if any(motors.following.size for motors, _ in self._motors):
            for _ in range(STEPS_PER_TICK - 1):
                self._step()
        else:
            mujoco.mj_step(self._mj, self._data, STEPS_PER_TICK - 1)
        self._option.disableflags = self._sensing
        self._step()

    def _step_checked(self) -> bool:
        """Step for a control tick, until the solver does not converge; return whether it did to the end."""
        self._option.disableflags = self._sensing | _SENSORS
        for left in range(STEPS_PER_TICK, 0, -1):
            if left == 1:
                self._option.disableflags = self._sensing
            self._step()
            if not self._converged():
                return False
        return True

    def _step(self) -> None:
        for motors, part in self._motors:
            motors.limit(part)
        mujoco.mj_step(self._mj, self._data)

    def _converged(self) -> bool:
        islands = max(self._data.nisland, 1)
        if islands > len(self._iterations):
            return False  # nothing is known of some
        for island in range(islands):
            last = self._iterations[island] - 1
            if last >= 0 and not self._gradients[island, last] < _CONVERGED:
                return False
        return True
