"""The digest of a virtual run with pictures: `python -m tests.support.virtual_trace BODY SECONDS` prints it.

Before, it says that it begins. With a further argument, which is a seed, the clocks on the wall jump ahead while
it runs, by up to minutes.
"""

from __future__ import annotations

import hashlib
import random
import sys
import time
from collections.abc import Callable
from typing import Final

from msgspec.structs import replace

from naoserver_sim.world import StartPose, load_world
from tests.support.places import ROOT
from visualhfsm.simulation import simulate

__all__ = ["BEGINS", "trace"]

BEGINS: Final = "it begins\n"

_CLOCKS: Final = ("monotonic", "perf_counter", "time")
_JUMPS: Final = (0.05, 0.7, 3.0, 15.0, 70.0)
_SHARE: Final = 0.05
"""Share of the looks at a clock before which time jumps."""


def trace(body: str, seconds: float) -> str:
    """Return the digest of what a robot of a body, with noise, sees and does in the beginning of a match.

    Each tenth of a second counts its state, its picture, and the calls and states of the behavior.
    """
    soccer = load_world("soccer")
    ball = replace(soccer.balls[0], position=(3.5, 0.1))
    world = replace(soccer, balls=(ball,), robot=StartPose(position=(2.9, 0.0)))
    digest = hashlib.sha256()
    with simulate(
        ROOT / "behaviors" / "score.xml",
        robot="sim",
        body=body,
        world=world,
        camera="rendered",
        noise=True,
        seed=1,
        parameters={"start_x": 2.9},
    ) as b:
        while b.time < seconds:
            b.advance(0.1)
            seen = hashlib.sha256(b.robot.look().pixels.tobytes()).hexdigest()
            digest.update(repr((b.robot.device.read(), b.robot.state, b.active_paths, seen)).encode())
        digest.update(repr((b.calls(), b.robot.health)).encode())
    return digest.hexdigest()


def let_clocks_jump(seed: int) -> None:
    """Let all clocks on the wall jump ahead at random looks at them, by the same durations."""
    numbers, ahead = random.Random(seed), 0.0

    def jumping(clock: Callable[[], float]) -> Callable[[], float]:
        def now() -> float:
            nonlocal ahead
            if numbers.random() < _SHARE:
                ahead += numbers.choice(_JUMPS)
            return clock() + ahead

        return now

    for name in _CLOCKS:
        setattr(time, name, jumping(getattr(time, name)))


if __name__ == "__main__":
    name, seconds, *late = sys.argv[1:]
    for each in late:
        let_clocks_jump(int(each))
    sys.stdout.write(BEGINS)
    sys.stdout.flush()
    sys.stdout.write(trace(name, float(seconds)) + "\n")
