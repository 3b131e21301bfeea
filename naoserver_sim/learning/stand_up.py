"""Nao/StandUp-v0: get up from the floor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, Unpack

from naoserver.body import H25
from naoserver_sim.learning.environment import PERIOD, NaoEnvironment, Options, upward

__all__ = ["MOTORS", "StandUpEnvironment"]

MOTORS: Final = tuple(
    joint.name
    for joint in H25.joints
    if joint.name not in {pair.follower for pair in H25.couplings} and "Hand" not in joint.name
)
"""The moved joints: all motors but those of the hands."""
_PUSH: Final = 60.0
"""N with which it is thrown over, for `_PUSHED` s."""
_PUSHED: Final = 0.3
_FALLING: Final = 3.0
"""Seconds after the push until it lies still."""
_STIFFENING: Final = 0.2
_STANDING: Final = 0.30
"""Height of the torso in m at which it stands, knees bent; it is 0.33 m high with straight legs."""
_UPRIGHT: Final = math.cos(math.radians(15))
_HELD: Final = 1.0
"""Seconds for which it has to stand."""
_STANDS: Final = 50.0
_DIRECTIONS: Final = {"belly": 0.0, "back": math.pi}


class StandUpEnvironment(NaoEnvironment):
    """Get up from where it fell, and stand for a second.

    The robot is thrown over in a direction that is drawn, lets its motors go as it does in a fall, and lies
    as it fell when the episode begins. `reset(options={"side": "belly"})`, or "back", gives the direction.

    Action (23): the speeds of `MOTORS`, up to half their full ones. Observation (54): angles (23) and speeds
    (23) of these; up, turning rate and loads of the soles (8). Reward of a step: how high the torso is and
    how upright, up to 1 each second; 50 when it has stood for a second, which ends the episode.
    """

    def __init__(self, **options: Unpack[Options]) -> None:
        super().__init__(MOTORS, 8, "side", options)
        self._stood = 0.0

    def _begin(self, options: Mapping[str, Any]) -> None:
        drawn = float(self.np_random.uniform(-math.pi, math.pi))
        side = options.get("side")
        if side is not None and side not in _DIRECTIONS:
            raise ValueError(f"there is no side {side!r}; there are {', '.join(_DIRECTIONS)}")
        direction = drawn if side is None else _DIRECTIONS[side]
        robot = self.robot
        robot.stage.push((_PUSH * math.cos(direction), _PUSH * math.sin(direction), 0.0), _PUSHED)
        self._wait(_FALLING)
        robot.command_stiffnesses(dict.fromkeys(H25.joint_names, 1.0), _STIFFENING)
        self._wait(_STIFFENING)
        self._stood = 0.0

    def _judge(self) -> tuple[float, bool]:
        _, x, y, _ = self._truth.torso.orientation
        upright = 1.0 - 2.0 * (x * x + y * y)
        height = self._truth.torso.position[2]
        stands = height >= _STANDING and upright >= _UPRIGHT
        self._stood = self._stood + PERIOD if stands else 0.0
        if self._stood >= _HELD:
            return _STANDS, True
        part = min(max(height / _STANDING, 0.0), 1.0) * (1.0 + upright) / 2.0
        return PERIOD * part, False

    def _features(self) -> list[float]:
        return [*self._angles(), *self._speeds(0.1), *self._balance()]

    def _info(self) -> dict[str, Any]:
        return super()._info() | {"up": upward(self._senses.inertial), "is_success": self._stood >= _HELD}
