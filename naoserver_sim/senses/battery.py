"""The battery: what the electronics and the motors draw from it."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.body import Body
from naoserver.capabilities import BatteryReading
from naoserver_sim.model import DeviceIndex

Array = NDArray[np.float64]

VOLTAGE: Final = 21.6
"""Nominal, in V: six cells of 3.6 V."""
ENERGY: Final = 62.6 * 3600.0
"""In J: 2.9 Ah at 21.6 V, the battery of NAO6."""
ELECTRONICS: Final = 40.0
"""Draw in W of what does not move. With the motors of a robot that stands it empties the battery in 90
minutes, the endurance in normal use that the data sheet gives."""
_AMBIENT: Final = 25.0
_WARMTH: Final = 1.5
"""Kelvin by which a current of 1 A, for good, warms the battery, times the current once more."""
_TIME_CONSTANT: Final = 1800.0
"""Seconds in which it gains 63 % of that."""


class Battery:
    """Empty as the motors work; `draw` belongs to the thread of the physics.

    A motor takes its mechanical power and what its winding loses. Of a motor whose no-load speed is w and
    whose stall torque is T, at the voltage for which these hold, the winding loses w/T times the square of
    the torque; power that the load gives back is lost.
    """

    def __init__(self, robot: DeviceIndex, body: Body) -> None:
        leading = [
            joint for joint in range(len(robot.joints)) if robot.motors[joint] not in robot.motors[:joint]
        ]
        self._motors = robot.motors[leading]
        self._dofs = robot.dofs[leading]
        motors = [body.facts["joints"][joint].get("motor") for joint in leading]
        self._losses = np.array(
            [m["no_load_speed_out"] / m["stall_torque_out_no_loss"] if m else 0.0 for m in motors]
        )
        self._energy = ENERGY
        self._temperature = _AMBIENT
        self.reading = BatteryReading(1.0, 0.0, _AMBIENT, plugged=False)
        """The newest reading."""

    def draw(self, seconds: float, torques: Array, velocities: Array) -> None:
        """Go on for some seconds, by the torques of the motors and the velocities of the joints."""
        torque = torques[self._motors]
        power = torque * velocities[self._dofs] + self._losses * torque * torque
        watts = ELECTRONICS + float(np.maximum(power, 0.0).sum())
        current = watts / VOLTAGE
        self._energy = max(self._energy - watts * seconds, 0.0)
        warmer = _AMBIENT + _WARMTH * current * current - self._temperature
        self._temperature += warmer * seconds / _TIME_CONSTANT
        self.reading = BatteryReading(self._energy / ENERGY, -current, self._temperature, plugged=False)
