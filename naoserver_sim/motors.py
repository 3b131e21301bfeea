"""The motors of the model: position servos with the limits of their joints."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.body import Joint
from naoserver.condition import HOT
from naoserver.robot import JointFacts


def add_motor(
    spec: mujoco.MjSpec, joint: Joint | JointFacts, *, kp: float, kv: float, lasting: float | None = None
) -> None:
    """Add the motor of a joint, named as the joint: it pulls towards its setpoint.

    `kp` is in N m/rad and `kv` in N m s/rad; of a slide in N/m and N s/m. `lasting` is the torque in N m that
    it may give for good; without one that is its greatest.
    """
    motor = spec.add_actuator(
        name=joint.name,
        target=joint.name,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        ctrllimited=mujoco.mjtLimited.mjLIMITED_TRUE,
        ctrlrange=[joint.lower, joint.upper],
        forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE,
        forcerange=[-joint.max_torque, joint.max_torque],
        userdata=[joint.max_torque if lasting is None else lasting],
    )
    motor.set_to_position(kp=kp, kv=kv)


Array = NDArray[np.float64]

AMBIENT: Final = 25.0
"""Temperature of the air, and of motors that do nothing, in degrees Celsius."""
_TIME_CONSTANT: Final = 300.0
"""Seconds in which a motor comes 63 % nearer to the temperature that its torque gives it; assumed."""
TOO_HOT: Final = 95.0
"""Temperature at which it gives none; assumed."""


class Motors:
    """Stiffness and temperature of every motor of a model; `tick` belongs to the thread of the physics.

    A motor's greatest torque and its gains are in proportion to its stiffness, as NAOqi's limit of the
    current makes them. A motor warms by the square of its torque, as by the current in its winding: with
    the torque that its data sheet lets it give for good it comes to `HOT`. From there on it gives less.
    """

    def __init__(self, mj: mujoco.MjModel) -> None:
        self._mj = mj
        self._gains = mj.actuator_gainprm[:, 0].copy()
        self._biases = mj.actuator_biasprm[:, 1:3].copy()
        self._forces = mj.actuator_forcerange.copy()
        self._heating = (HOT - AMBIENT) / np.maximum(mj.actuator_user[:, 0], 1e-9) ** 2
        self.stiffnesses: Array = np.ones(mj.nu)
        self.temperatures: Array = np.full(mj.nu, AMBIENT)
        self.limp: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
        """The motors that hold nothing."""
        self._wanted = self.stiffnesses.copy()
        self._rates = np.zeros(mj.nu)
        self._changing = False
        self._derated = False

    def stiffen(self, motors: NDArray[np.intp], stiffnesses: Array, seconds: float) -> None:
        """Let some motors come to hold as strongly as told, within some seconds, from now on."""
        self._wanted[motors] = stiffnesses
        change = np.abs(self._wanted[motors] - self.stiffnesses[motors])
        self._rates[motors] = change / seconds if seconds > 0.0 else np.inf
        self._changing = True

    def tick(self, seconds: float, torques: Array) -> None:
        """Go on for some seconds in which the motors gave some torques in N m."""
        warmer = AMBIENT + self._heating * torques * torques - self.temperatures
        self.temperatures += warmer * (seconds / _TIME_CONSTANT)
        if self._changing:
            reach = self._rates * seconds
            self.stiffnesses += np.clip(self._wanted - self.stiffnesses, -reach, reach)
            self._changing = bool((self.stiffnesses != self._wanted).any())
            self.limp = np.flatnonzero(self.stiffnesses == 0.0)
            self._apply()
        elif self._derated or self.temperatures.max() > HOT:
            self._apply()

    def _apply(self) -> None:
        cool = np.clip((TOO_HOT - self.temperatures) / (TOO_HOT - HOT), 0.0, 1.0)
        self._derated = bool((cool < 1.0).any())
        mj = self._mj
        mj.actuator_gainprm[:, 0] = self._gains * self.stiffnesses
        mj.actuator_biasprm[:, 1:3] = self._biases * self.stiffnesses[:, None]
        mj.actuator_forcerange[:] = self._forces * (self.stiffnesses * cool)[:, None]
