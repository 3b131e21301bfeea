"""The sensors of the body as the walk reads them: joints and inertial unit at the same moment."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np

from naoserver.capabilities import InertialReading
from naoserver_sim._footsteps.limbs import Array, Limbs
from naoserver_sim._senses.record import encoded
from naoserver_sim._simulator import Simulator


class BodySensors:
    """Keep the readings of the joints for as long as the inertial unit takes to report.

    Readings of different moments contradict each other: a step shakes the trunk by more than a radian per
    second. `delay` is that of the inertial unit in ticks. With `noise` angles are those of encoders. `tick`
    is due at the beginning of each control tick.
    """

    def __init__(
        self,
        simulator: Simulator,
        limbs: Limbs,
        inertial: Callable[[], InertialReading],
        *,
        noise: bool = False,
        delay: int = 0,
    ) -> None:
        self._data = simulator.data
        self._limbs = limbs
        self._read_inertial = inertial
        self._noise = noise
        self.delay = delay
        """Of all readings, in ticks."""
        self._joints: deque[tuple[Array, Array]] = deque(maxlen=delay + 1)
        self.tick()

    def tick(self) -> None:
        """Read the sensors."""
        self.inertial = self._read_inertial()
        self._joints.append((self._angles(), self._speeds()))
        self.angles, self.speeds = self._joints[0]

    @property
    def torques(self) -> Array:
        """Torques in N m that the motors of the legs give, in the order of `Limbs.legs`."""
        torques: Array = self._data.actuator_force[self._limbs.leg_motors]
        return torques

    def _angles(self) -> Array:
        """Return the angles of all joints of the body in rad."""
        angles: Array = self._data.qpos[self._limbs.qpos]
        return np.array(encoded(angles.tolist())) if self._noise else angles

    def _speeds(self) -> Array:
        """Return their speeds in rad/s."""
        speeds: Array = self._data.qvel[self._limbs.dofs]
        return speeds
