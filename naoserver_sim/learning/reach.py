"""Nao/Reach-v0: bring the left hand to a place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, Unpack

import numpy as np
from numpy.typing import NDArray

from naoserver.kinematics import place_of
from naoserver_sim.learning.environment import NaoEnvironment, Options, three_numbers

__all__ = ["ARM", "ReachEnvironment", "hand_at"]

Array = NDArray[np.float64]

ARM: Final = ("LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll", "LWristYaw")
"""The joints of the arm from the shoulder down."""
_THERE: Final = 0.02
"""Distance in m at which the hand is there."""
_REWARD: Final = 1.0
_FALL: Final = -10.0
_SCALE: Final = 5.0
"""Factor for lengths in m, which are then about 1."""


class ReachEnvironment(NaoEnvironment):
    """Bring the middle of the left hand within 2 cm of a place that it can reach, and keep it there.

    Action (5): the speeds of the joints in `ARM`, up to half their full ones. Observation (24): angles and
    speeds of these joints (10); where the hand is (3), and from there to the place (3), in the torso's frame;
    up, turning rate and loads of the soles (8). Where the hand is follows from the angles of the joints.

    Reward of a step: minus the distance in m, and 1 while the hand is there. A fall ends the episode and
    costs 10. `reset(options={"place": (x, y, z)})` gives the place in m; without it the one is drawn at which
    the hand is when the joints are anywhere in the middle 80 % of their ranges.
    """

    def __init__(self, **options: Unpack[Options]) -> None:
        super().__init__(ARM, 14, "place", options)
        self._target = self._hand = np.zeros(3)

    def _begin(self, options: Mapping[str, Any]) -> None:
        lower = np.array([joint.lower for joint in self._moved])
        upper = np.array([joint.upper for joint in self._moved])
        drawn = hand_at((lower + (upper - lower) * self.np_random.uniform(0.1, 0.9, len(ARM))).tolist())
        self._target = np.array(three_numbers(options.get("place", drawn), "place"))

    def _judge(self) -> tuple[float, bool]:
        if self.fallen:
            return _FALL, True
        distance = self._distance()
        return (_REWARD if distance <= _THERE else 0.0) - distance, False

    def _features(self) -> list[float]:
        hand = self._hand
        return [
            *self._angles(),
            *self._speeds(0.2),
            *(_SCALE * hand).tolist(),
            *(_SCALE * (self._target - hand)).tolist(),
            *self._balance(),
        ]

    def _info(self) -> dict[str, Any]:
        return super()._info() | {"distance": self._distance(), "is_success": self._distance() <= _THERE}

    def _look(self) -> None:
        super()._look()
        self._hand = hand_at(self._angles())

    def _distance(self) -> float:
        return float(np.linalg.norm(self._target - self._hand))


def hand_at(angles: Sequence[float]) -> Array:
    """Return where the middle of the left hand is, in the torso's frame in m; `angles` are those of `ARM`."""
    return place_of("LArm", dict(zip(ARM, angles, strict=True)))[:3, 3]
