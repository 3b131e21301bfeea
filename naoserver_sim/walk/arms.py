"""The arms while it walks: each swings against the leg of its side, unless somebody commands it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True)
class _Arm:
    shoulder: NDArray[np.intp]
    motors: NDArray[np.intp]


class ArmSwing:
    """Swing the arms that hang when the walk begins, each until somebody commands one of its joints."""

    def __init__(self, robot: DeviceIndex, setpoints: SetpointController) -> None:
        motors = {joint.name: motor for joint, motor in zip(robot.joints, robot.motors, strict=True)}
        self._setpoints = setpoints
        self._arms = [
            _Arm(
                np.array([motors[f"{side}ShoulderPitch"]], dtype=np.intp),
                np.array([motors[f"{side}{part}"] for part in _PARTS], dtype=np.intp),
            )
            for side in "LR"
        ]
        self._swinging: list[tuple[int, float, int]] = []  # which arm, about what, commands it had

    def begin(self) -> None:
        """Let the arms that hang swing from now on."""
        now = self._setpoints.setpoints
        rests = [float(now[arm.shoulder[0]]) for arm in self._arms]
        self._swinging = [
            (side, rest, self._commands(side))
            for side, rest in enumerate(rests)
            if abs(rest - _HANGING) <= _ABOUT
        ]

    def tick(self, feet: Sequence[FootOffset], out: NDArray[np.float64]) -> None:
        """Put the shoulders where the feet, left and right, have them; fill the setpoints in `out`."""
        self._swinging = [
            (side, rest, commands)
            for side, rest, commands in self._swinging
            if self._commands(side) == commands
        ]
        for side, rest, _ in self._swinging:
            # An arm that swings forwards pitches up, which is negative: back when its foot is ahead.
            self._setpoints.place(self._arms[side].shoulder, np.array([rest + _SWING * feet[side].x]), out)

    def _commands(self, side: int) -> int:
        """Return how many commands the joints of an arm have had."""
        return int(self._setpoints.commands[self._arms[side].motors].sum())
