"""The commands of a walk or a drive: given from any thread, followed in that of the physics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import astuple
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.capabilities import STILL, Odometry, WalkVelocity
from naoserver.errors import InvalidCommand
from naoserver_sim._headway import Headway
from naoserver_sim._simulator import Simulator

_SLOWEST_WALK: Final = 1e-3
"""Velocity in m/s and rad/s below which a robot does not move."""
STUCK: Final = "it does not get on: a wall, an edge, a slope or a push holds it back"


class CommandedWay(ABC):
    """A way to move at the newest commanded velocity, until it is 0 or something ends the motion.

    It has the part of `naoserver.capabilities.Walker` that all ways have in common. `does` is the verb in
    errors.
    """

    lag: float = 0.0
    balances: bool = False

    def __init__(self, simulator: Simulator, does: str = "walk") -> None:
        self._simulator = simulator
        self._does = does
        self.ended = ""
        self._newest = self._commanded = STILL
        self._velocity = STILL
        """The velocity that it follows; for the thread of the physics only."""
        self._headway = Headway()

    @property
    @abstractmethod
    def walking(self) -> bool:
        """Whether it moves, as of `Walker`."""

    @abstractmethod
    def _hindrance(self, stiffnesses: NDArray[np.float64]) -> str:
        """Return why it cannot move, with these stiffnesses of all motors; empty when it can."""

    def command(self, velocity: WalkVelocity) -> None:
        """Move at a velocity until the next command. Raises InvalidCommand when it cannot move now."""
        if max(map(abs, astuple(velocity))) < _SLOWEST_WALK:
            velocity = STILL
        if velocity != STILL and not self.walking:
            hindrance = self._hindrance(self._simulator.newest().stiffnesses)
            if hindrance:
                raise InvalidCommand("walk", f"the robot cannot {self._does}: {hindrance}")
            self.ended = ""
        self._newest = self._commanded = velocity
        self._simulator.order(lambda: self._take(velocity))

    def commanded(self) -> WalkVelocity:
        """Return the newest command; all 0 once the motion has ended."""
        return self._commanded

    def _take(self, velocity: WalkVelocity) -> None:
        if velocity is self._newest:
            self._commanded = velocity  # even if the motion was ended since then
        self._velocity = self._followed(velocity)

    def _followed(self, velocity: WalkVelocity) -> WalkVelocity:
        """Return the velocity that it has to follow to reach a commanded one."""
        return velocity

    def _look(self, seconds: float, velocity: WalkVelocity, now: Odometry) -> None:
        """End a motion at a velocity that does not get on; `now` is the place at the end of some seconds."""
        if velocity == STILL:
            self._headway.begin()
        elif not self._headway.tick(seconds, velocity, now):
            self._end(STUCK)

    def _end(self, why: str) -> None:
        """Follow no command any more."""
        self.ended = why
        self._commanded = self._velocity = STILL
