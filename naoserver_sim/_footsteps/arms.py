"""The swing of hanging arms against the legs, which keeps the feet from twisting on the floor."""

from __future__ import annotations

import cmath
import math
from typing import Final

import numpy as np

from naoserver_sim._footsteps.estimator import Estimator
from naoserver_sim._footsteps.limbs import Array, Limbs
from naoserver_sim._footsteps.steps import Steps
from naoserver_sim._motors import SetpointController

_HANGING: Final = math.radians(45)
"""Angle to the vertical below which an arm hangs."""
_FASTEST_SWING: Final = 3.0
"""Highest speed of a shoulder in rad/s."""


class ArmSwing:
    """Swing the arms that hang when the walk begins, each until one of its joints is commanded."""

    def __init__(self, limbs: Limbs, setpoints: SetpointController, swing: float) -> None:
        self._limbs = limbs
        self._setpoints = setpoints
        self._swing = swing  # in rad for each metre
        self._shoulders = limbs.motors[[arm.swing for arm in limbs.arms]]
        self._motors = [limbs.motors[arm.joints] for arm in limbs.arms]
        self._swinging = np.zeros(len(limbs.arms), dtype=bool)
        self._rests = np.zeros(len(limbs.arms))
        self._begun = self._commands()

    def begin(self, estimator: Estimator) -> None:
        """Swing the hanging arms from now on."""
        data = estimator.data
        upwards = [data.subtree_com[arm.shoulder] - data.xpos[arm.shoulder] for arm in self._limbs.arms]
        self._swinging[:] = [arm[2] < -math.cos(_HANGING) * np.linalg.norm(arm) for arm in upwards]
        self._rests = self._setpoints.setpoints[self._shoulders]
        self._begun = self._commands()

    def tick(self, seconds: float, steps: Steps, out: Array) -> None:
        """Fill the setpoints of the shoulders in `out`."""
        self._swinging &= self._commands() == self._begun
        if not self._swinging.any():
            return
        left, right = steps.feet
        ahead = ((left.place - right.place) * cmath.rect(1.0, -steps.heading)).real
        angles = self._rests + 0.5 * self._swing * np.array([ahead, -ahead])
        reach = _FASTEST_SWING * seconds
        present = self._setpoints.setpoints[self._shoulders]
        angles = np.minimum(np.maximum(angles, present - reach), present + reach)
        self._setpoints.place(self._shoulders[self._swinging], angles[self._swinging], out)

    def _commands(self) -> Array:
        """Return the numbers of commands to the joints of each arm."""
        return np.array([self._setpoints.commands[motors].sum() for motors in self._motors])
