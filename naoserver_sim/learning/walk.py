"""Nao/Walk-v0: step with the legs at a given velocity."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import Any, Final, Unpack

import numpy as np
from numpy.typing import NDArray

from naoserver.capabilities import Truth, WalkVelocity
from naoserver_sim.learning.environment import PERIOD, NaoEnvironment, Options, three_numbers
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.walk.kinematics import LEG_MOTORS

__all__ = ["WalkEnvironment"]

_REACH: Final = 0.6
"""Radians by which an action moves a joint from the stance at most."""
_STRIDE: Final = 0.5
"""Duration of two steps in s; the observation contains the phase: a clock to step by."""
_FASTEST: Final = WalkVelocity(forward=0.25, left=0.1, turn=0.6)
"""The highest velocity of each kind that is drawn."""
_TOLERANCE: Final = 0.1
"""Error of the velocity in m/s at which 37 % of its reward is left; of the turn 4 times that in rad/s."""
_ON_FEET: Final = 0.2
_JERK: Final = 0.02
_FALL: Final = -10.0
_LOWEST: Final = 0.2
"""Height of the torso in m below which it has fallen on its knees or worse."""


class WalkEnvironment(NaoEnvironment):
    """Keep to a velocity on the floor, by the angles of the legs.

    Action (11): the motors of the legs in the order of `LEG_MOTORS`, up to 0.6 rad to either side of the
    stance in which it begins. Observation (46): the velocity that is wanted (3); up, turning rate and loads
    of the soles (8); angles about the stance (11) and speeds (11) of the motors; the last action (11); sine
    and cosine of a clock to step by (2).

    Reward of a step: 0.2 for being on its feet, up to 1 the closer the torso moves to the velocity, as the
    mean over the last half second, for it sways from step to step, less the jerk of the action. A fall ends
    the episode and costs 10. `reset(options={"velocity": (forward, left, turn)})` gives the velocity in m/s
    and rad/s; without it one is drawn.
    """

    def __init__(self, **options: Unpack[Options]) -> None:
        super().__init__(LEG_MOTORS, 24, "velocity", options)
        self._full = {joint.name: joint.max_velocity for joint in self._moved}
        self._stance = np.zeros(len(LEG_MOTORS))
        self._last = np.zeros(len(LEG_MOTORS))
        self._jerk = 0.0
        self._wanted = WalkVelocity()
        self._moves: deque[WalkVelocity] = deque(maxlen=round(_STRIDE / PERIOD))

    def _begin(self, options: Mapping[str, Any]) -> None:
        commands = self.robot.read().commands
        self._stance = np.array([commands[place] for place in self._places])
        self._last = np.zeros(len(LEG_MOTORS))
        self._moves.clear()
        drawn = self.np_random.uniform(-1.0, 1.0, 3) * (_FASTEST.forward, _FASTEST.left, _FASTEST.turn)
        self._wanted = WalkVelocity(*three_numbers(options.get("velocity", drawn), "velocity"))

    def _act(self, robot: SimulatedRobot, action: NDArray[np.float64]) -> None:
        angles = self._stance + _REACH * action
        robot.command_positions(dict(zip(LEG_MOTORS, angles.tolist(), strict=True)), self._full)
        change = action - self._last
        self._jerk, self._last = float(change @ change), action

    def _judge(self) -> tuple[float, bool]:
        if self.fallen or self._truth.torso.position[2] < _LOWEST:
            return _FALL, True
        self._moves.append(velocity_of(self._truth))
        wanted, moved = self._wanted, self._velocity()
        error = math.hypot(
            moved.forward - wanted.forward, moved.left - wanted.left, (moved.turn - wanted.turn) / 4.0
        )
        return _ON_FEET + math.exp(-((error / _TOLERANCE) ** 2)) - _JERK * self._jerk, False

    def _features(self) -> list[float]:
        wanted = self._wanted
        phase = math.tau * self._joints.time / _STRIDE
        return [
            *(4.0 * wanted.forward, 10.0 * wanted.left, wanted.turn),
            *self._balance(),
            *(np.array(self._angles()) - self._stance).tolist(),
            *self._speeds(0.1),
            *self._last.tolist(),
            *(math.sin(phase), math.cos(phase)),
        ]

    def _velocity(self) -> WalkVelocity:
        """Return the mean of the velocities in the last half second."""
        if not self._moves:
            return WalkVelocity()
        kinds = zip(*((move.forward, move.left, move.turn) for move in self._moves), strict=True)
        return WalkVelocity(*(sum(kind) / len(self._moves) for kind in kinds))

    def _info(self) -> dict[str, Any]:
        moved, wanted = self._velocity(), self._wanted
        return super()._info() | {
            "velocity": (moved.forward, moved.left, moved.turn),
            "wanted": (wanted.forward, wanted.left, wanted.turn),
        }


def velocity_of(truth: Truth) -> WalkVelocity:
    """Return how the torso moves over the floor, in its own frame."""
    heading = truth.torso.heading
    cosine, sine = math.cos(heading), math.sin(heading)
    vx, vy, _ = truth.velocity
    return WalkVelocity(cosine * vx + sine * vy, cosine * vy - sine * vx, truth.angular_velocity[2])
