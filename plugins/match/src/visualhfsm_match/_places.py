"""Where robots and ball are, and where the referee wants them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Final

from naoserver.errors import InvalidCommand
from naoserver.protocol.robot import Robot
from visualhfsm_match._referee import BALL, Put, Seen, Sight

_ASIDE: Final = 0.35
"""m by which a robot is put elsewhere where there is no room."""
_TURN: Final = 2.4
"""rad from one place that is tried to the next."""


def sight_of(robots: Mapping[str, Robot]) -> Sight:
    """Return where the simulated robots of a world, by their names, and its ball are now."""
    seen = {}
    for name, robot in robots.items():
        assert robot.stage is not None
        truth = robot.stage.truth()
        seen[name] = Seen(truth.torso.position[0], truth.torso.position[1], robot.state().fallen)
    x, y, _ = truth.objects[BALL].position
    return Sight(truth.time, (x, y), seen)


class Places:
    """What is to be put somewhere: where there is no room, it waits, and then stands aside.

    `put` does it, and raises InvalidCommand where there is no room.
    """

    def __init__(self, put: Callable[[Put], object]) -> None:
        self._put: Final = put
        self._waiting: Final[dict[str, Put]] = {}
        self._tries: Final[dict[str, int]] = {}

    def want(self, puts: Iterable[Put]) -> None:
        """Put some things, and those that still wait."""
        self._waiting.update((put.name, put) for put in puts)
        for name, put in [*self._waiting.items()]:
            tries = self._tries[name] = self._tries.get(name, -1) + 1
            turn, ring = _TURN * tries, (_ASIDE * (tries // 3) / 4 if name or tries else 0.0)
            x, y = put.x + ring * math.cos(turn), put.y + ring * math.sin(turn)
            try:
                self._put(Put(name, x, y, put.heading))
            except InvalidCommand:
                continue
            del self._waiting[name], self._tries[name]
