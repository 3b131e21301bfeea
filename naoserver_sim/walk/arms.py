"""The arms while it walks: each swings against the leg of its side, unless somebody commands it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver_sim.control import SetpointController
from naoserver_sim.model import DeviceIndex
from naoserver_sim.walk.gait import FootOffset

__all__ = ["ArmSwing"]

_HANGING: Final = 1.4
"""ShoulderPitch in rad of an arm that hangs down."""
_ABOUT: Final = 0.5
"""Distance in rad from it up to which an arm counts as hanging."""
_SWING: Final = 3.0
"""Radians of a shoulder for a metre of the foot on the same side."""
_PARTS: Final = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw")


class ArmSwing:
    """Swing the arms that hang when the walk begins, each until somebody commands one of its joints."""

    def __init__(self, robot: DeviceIndex, setpoints: SetpointController) -> None:
        motors = {joint.name: motor for joint, motor in zip(robot.joints, robot.motors, strict=True)}
        self._setpoints = setpoints
        # The motors of each arm, left and right; the shoulder's pitch, which swings, comes first.
        self._motors: NDArray[np.intp] = np.array(
            [[motors[f"{side}{part}"] for part in _PARTS] for side in "LR"], dtype=np.intp
        )
        self._begun = self._commands()
        self._rests = setpoints.setpoints[self._motors[:, 0]]
        self._swinging = np.zeros(2, dtype=np.bool_)

    def begin(self) -> None:
        """Let the arms that hang swing from now on."""
        self._begun = self._commands()
        self._rests = self._setpoints.setpoints[self._motors[:, 0]]
        self._swinging = np.abs(self._rests - _HANGING) <= _ABOUT

    def tick(self, feet: Sequence[FootOffset], out: NDArray[np.float64]) -> None:
        """Put the shoulders where the feet, left and right, have them; fill the setpoints in `out`."""
        self._swinging &= self._commands() == self._begun
        # An arm that swings forwards pitches up, which is negative: back when its foot is ahead.
        angles = self._rests + [_SWING * foot.x for foot in feet]
        self._setpoints.place(self._motors[self._swinging, 0], angles[self._swinging], out)

    def _commands(self) -> NDArray[np.int64]:
        """Return how many commands the joints of each arm have had."""
        counted: NDArray[np.int64] = self._setpoints.commands[self._motors].sum(axis=1)
        return counted
