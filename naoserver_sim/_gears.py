"""The gears between motors and joints, as imperfect as those of a real robot: late, and with backlash."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.body import Body
from naoserver_sim._motors import Array


@dataclass(frozen=True, slots=True)
class GearNoise:
    """Imperfections of the way from a command to a joint."""

    delay: int = 2
    """Control ticks until a command has reached its motor. A joint then moves 30 to 40 ms after the command.
    B-Human finds a request in the angles of a NAO 6 three cycles of 12 ms later (`motionDelay` in
    `jointPlayProvider.cfg`, code release 2025)."""
    least_backlash: float = math.radians(0.5)
    most_backlash: float = math.radians(2.0)
    """Backlash of a joint in rad, drawn once from this range. B-Human expects the ankles of a good robot
    within 1.0 deg of the requested angles, its hips and knees within 1.4 deg, the yielding of the motors
    included, and reports a joint that jumps by more than 5 deg as damaged (`jointPlayProvider.cfg`)."""


def gear_noise(body: Body) -> GearNoise:
    """Return how imperfect the gears of a body are."""
    play = body.play
    return GearNoise(play.delay, play.least_backlash, play.most_backlash) if play else GearNoise()


class Gears:
    """Bring commands to the motors, and let joints move freely within the backlash of their gears.

    A motor holds its own side of the gear where it is commanded to be. Within half the backlash on either
    side of that it exerts no force on the joint, so that a load leans the joint against one side, and against
    the other when it reverses. The encoders of a Nao are behind the gears: they measure most of the backlash
    (docs.b-human.de, "Sensor Analysis"), so that readings of the joints show it, too.

    The forces are those of the position servos of MuJoCo towards a command that is moved by the slack, once
    in a control tick: no further degrees of freedom. The damping and friction of motor and gear act within
    the backlash, too, so that joints cross it more slowly than real ones. For the thread of the physics only.
    """

    def __init__(self, noise: GearNoise, commands: Array, joints: int, random: np.random.Generator) -> None:
        """Begin at rest at the `commands` of all motors, the first `joints` of which move the robot."""
        half = random.uniform(noise.least_backlash, noise.most_backlash, joints) / 2
        self._joints: Final = slice(joints)
        self._highest, self._lowest = half, -half
        self._slack = np.zeros(joints)
        # The newest commands on their way, oldest first.
        self._commands = deque((commands[:joints].copy() for _ in range(noise.delay + 1)), noise.delay + 1)

    @property
    def backlash(self) -> Array:
        """The backlash of each motor's gear in rad."""
        return self._highest - self._lowest

    def tick(self, commands: Array, positions: Array, out: Array) -> None:
        """Fill `out` with the commands of the servos, while the joints of all motors are at `positions`."""
        joints = self._joints
        self._commands.append(commands[joints].copy())
        arrived, slack = self._commands[0], self._slack
        np.subtract(arrived, positions[joints], out=slack)
        np.minimum(slack, self._highest, out=slack)
        np.maximum(slack, self._lowest, out=slack)
        out[:] = commands
        np.subtract(arrived, slack, out=out[joints])

    def settle(self, motors: NDArray[np.intp], positions: Array) -> None:
        """Let some motors have been commanded to be at `positions` all the time."""
        own = motors < len(self._slack)
        for commands in self._commands:
            commands[motors[own]] = positions[own]
