"""Measure how well a robot knows where it is on the soccer field, with noise in senses and sight.

It walks to random places in virtual time. The same looks correct three estimates, each beside the
odometry alone: that of a robot that was put down exactly, that of one put down 15 cm and 8 degrees off, and
that of one whose odometry slips more than the simulated one does: 10 % of each way, 5 % of each turn, and
3 degrees in a meter.

    python plugins/match/benchmarks/bench_localization.py [--seeds 8] [--seconds 30]
"""

from __future__ import annotations

import cmath
import math
import statistics
from typing import Any, Final

import numpy as np

from benchmarks.common import options
from hfsm_runtime.virtual.clock import TaskClock
from hfsm_runtime.virtual.network import VirtualNetwork
from interfaces.jderobot import EncodersPrx
from interfaces.nao import ActionStatus, PoseHeadPrx, SightPrx, WalkPrx
from naoserver.soccer_field import Field
from visualhfsm.simulation._robot import RobotUnderTest
from visualhfsm_match.localization import Localizer

START: Final = -0.75
OFF: Final = 0.15, math.radians(8)
SLIP: Final = 0.9, 1.05, math.radians(3)
PERIOD: Final = 0.2
GLANCES: Final = (0.0, 0.0), (0.7, 0.0), (-0.7, 0.0), (0.0, 0.3)


class Guess:
    """An estimate, and what the odometry alone makes of the same start."""

    def __init__(self, x: float, y: float, heading: float) -> None:
        self.localizer = Localizer(Field(), (x, y, heading))
        self._place, self._heading = complex(x, y), heading

    def move(self, x: float, y: float, heading: float, time: float) -> None:
        """Follow the odometry."""
        self.localizer.move(x, y, heading, time)
        self.odometry = self._place + complex(x, y) * cmath.rect(1.0, self._heading), self._heading + heading

    def errors(self, place: complex, heading: float) -> tuple[float, ...]:
        """Return the errors of both in cm and degrees."""
        pose = self.localizer.pose
        both = (complex(pose.x, pose.y), pose.heading), self.odometry
        turns = [math.degrees(abs(cmath.phase(cmath.rect(1.0, turn - heading)))) for _, turn in both]
        return 100 * abs(both[0][0] - place), turns[0], 100 * abs(both[1][0] - place), turns[1]


def walk(seed: int, seconds: float) -> dict[str, tuple[float, ...]]:
    """Let it walk, and return the errors of each estimate over the last two seconds."""
    random, clock = np.random.default_rng(seed), TaskClock()
    network = VirtualNetwork(clock)
    robot = RobotUnderTest("sim", clock, network, world="soccer", seed=seed, noise=True)
    stage: Any = robot.device.stage

    def proxy(kind: Any, name: str) -> Any:  # noqa: ANN401
        return kind.uncheckedCast(network.communicator.stringToProxy(name))

    sight, encoders, walker, head = (
        proxy(SightPrx, "Sight"),
        proxy(EncodersPrx, "Encoders"),
        proxy(WalkPrx, "Walk"),
        proxy(PoseHeadPrx, "Head"),
    )
    aside = cmath.rect(OFF[0], random.uniform(0.0, math.tau))
    guesses = {
        "put down exactly": Guess(START, 0.0, 0.0),
        "put down 15 cm and 8 degrees off": Guess(
            START + aside.real, aside.imag, OFF[1] * random.choice((-1, 1))
        ),
        "odometry that slips": Guess(START, 0.0, 0.0),
    }
    before, slipped, turned = (0j, 0.0), 0j, 0.0
    clock.advance(1.0)
    found: dict[str, list[tuple[float, ...]]] = {name: [] for name in guesses}
    for step in range(round(seconds / PERIOD)):
        truth = stage.truth().torso
        place, heading = complex(*truth.position[:2]), truth.heading
        if walker.getWalkState().status is not ActionStatus.Moving:
            way = complex(random.uniform(-3.5, 3.5), random.uniform(-2.3, 2.3)) - place
            way *= min(1.0, 2.0 / abs(way)) * cmath.rect(1.0, -heading)
            walker.walkTo(way.real, way.imag, cmath.phase(way))
        if step % 10 == 0:
            head.setPose(*GLANCES[step // 10 % len(GLANCES)], 0.3)
        at = encoders.getEncodersData()
        now = complex(at.robotx, at.roboty), at.robottheta
        moved = (now[0] - before[0]) * cmath.rect(SLIP[0], turned - before[1])
        slipped += moved
        turned += SLIP[1] * cmath.phase(cmath.rect(1.0, now[1] - before[1])) + SLIP[2] * abs(moved)
        before = now
        time = head.getPose().time
        for name, guess in guesses.items():
            pose = (slipped, turned) if name == "odometry that slips" else now
            guess.move(pose[0].real, pose[0].imag, pose[1], time)
        look = sight.getSight()
        for guess in guesses.values():
            guess.localizer.see(look.things, time - look.time)
        if step * PERIOD >= seconds - 2.0:
            for name, guess in guesses.items():
                found[name].append(guess.errors(place, heading))
        clock.advance(PERIOD)
    robot.close()
    return {name: tuple(np.mean(each, axis=0)) for name, each in found.items()}


def main() -> None:
    """Walk with each seed and print the median and the largest errors."""
    arguments = options(__doc__, seeds=8, seconds=30.0)
    walks = [walk(seed, arguments.seconds) for seed in range(1, arguments.seeds + 1)]
    for name in walks[0]:
        place, turn, odometry, odometry_turn = zip(*(each[name] for each in walks), strict=True)
        print(
            f"{name}: {statistics.median(place):.1f} cm (at most {max(place):.1f}), "
            f"{statistics.median(turn):.1f} degrees; the odometry alone {statistics.median(odometry):.1f} cm "
            f"(at most {max(odometry):.1f}), {statistics.median(odometry_turn):.1f} degrees"
        )


if __name__ == "__main__":
    main()
