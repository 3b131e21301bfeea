"""Setpoints of the motors: where each is commanded to be, moved towards its target at a limited speed."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Command:
    """Targets and speeds for some motors, taken together at one control tick."""

    motors: NDArray[np.intp]
    """Indices of the motors."""
    targets: Array
    """Where to go: rad of a hinge, m of a slide; an infinite target goes to the limit of the motor."""
    speeds: Array
    """How fast, not negative, in rad/s or m/s; 0 holds the setpoint where it is."""

    @classmethod
    def velocities(cls, motors: NDArray[np.intp], velocities: Array) -> Command:
        """Make the command that moves the motors at `velocities` until their limits or the next command."""
        return cls(motors, np.copysign(np.inf, velocities), np.abs(velocities))


class SetpointController:
    """Move setpoints towards their targets, never faster than the command's and the motor's speed.

    `post` may be called from any thread and never waits; `tick` belongs to the physics thread.
    """

    def __init__(self, initial: Array, lower: Array, upper: Array, max_speeds: Array) -> None:
        self._lower = lower
        self._upper = upper
        self._max_speeds = max_speeds
        self._setpoints = np.clip(initial, lower, upper)
        self._targets = self._setpoints.copy()
        self._speeds = np.zeros_like(self._setpoints)
        self._moving = False
        self.commands = np.zeros(len(self._setpoints), dtype=np.int64)
        """How many commands each motor has had."""
        # Appending to and popping from a deque is atomic: no lock between the servants and the physics.
        self._mailbox: deque[Command] = deque()

    @property
    def setpoints(self) -> Array:
        """A copy of the setpoints."""
        return self._setpoints.copy()

    @property
    def moving(self) -> bool:
        """Whether the next tick changes a setpoint."""
        return self._moving or bool(self._mailbox)

    def post(self, command: Command) -> None:
        """Hand over a command for the next tick."""
        self._mailbox.append(command)

    def place(self, motors: NDArray[np.intp], positions: Array, out: Array) -> None:
        """Set the setpoints of some motors at once, where they stay; fill `out`."""
        self._setpoints[motors] = np.clip(positions, self._lower[motors], self._upper[motors])
        self._targets[motors] = self._setpoints[motors]
        out[:] = self._setpoints

    def follow(self, motors: NDArray[np.intp], positions: Array) -> None:
        """Let the setpoints of motors that are limp go along with their joints."""
        self._setpoints[motors] = np.clip(positions, self._lower[motors], self._upper[motors])
        self._targets[motors] = self._setpoints[motors]
        self._moving = True

    def tick(self, period: float, out: Array) -> None:
        """Take the commands posted since the last tick, move the setpoints for `period` s, fill `out`."""
        while self._mailbox:
            self._take(self._mailbox.popleft())
        if not self._moving:
            return
        reach = self._speeds * period
        change = np.minimum(np.maximum(self._targets - self._setpoints, -reach), reach)
        self._setpoints += change
        self._moving = bool(change.any())
        out[:] = self._setpoints

    def _take(self, command: Command) -> None:
        motors = command.motors
        self.commands[motors] += 1
        self._targets[motors] = np.clip(command.targets, self._lower[motors], self._upper[motors])
        self._speeds[motors] = np.minimum(command.speeds, self._max_speeds[motors])
        self._moving = True
