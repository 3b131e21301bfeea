"""Measure the walk and the balance of bodies that walk by footsteps, and print the figures.

Everything runs in virtual time, with noise in sensors and gears.

    python benchmarks/bench_footsteps.py booster_t1 [--runs 30] [--moments 6]
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.errors import InvalidCommand
from tests.support.humanoids import BODIES, Humanoid, Noise
from tests.support.walking import mean_velocity

CONSOLE = Console(width=100)
COURSE: Final = (
    (10.0, WalkVelocity(forward=0.3)),
    (10.0, WalkVelocity(forward=0.2, turn=0.2)),
    (10.0, WalkVelocity(forward=0.3)),
    (10.0, WalkVelocity(forward=0.2, turn=-0.3)),
    (5.0, WalkVelocity(turn=0.4)),
    (15.0, WalkVelocity(forward=0.3)),
)
"""Seconds, and the velocity: a minute at 0.3 m/s with turns."""
PUSH_SECONDS: Final = 0.1
TWO_STEPS: Final = 0.9
"""Seconds."""
STRONGEST: Final = 40.0
"""N s: more than any push that a robot withstands."""


def standing(body: str, seed: int) -> Humanoid:
    """Return a robot with noise that has stood for a second."""
    robot = Humanoid(body, seed=seed, noise=Noise())
    robot.go(1.0)
    return robot


def print_velocities(body: str) -> None:
    limits = standing(body, 0).footsteps.limits
    table = Table("commanded: m/s forward, m/s left, rad/s", "reached", "tilt")
    for velocity in (
        WalkVelocity(forward=0.3),
        WalkVelocity(forward=limits.forward),
        WalkVelocity(forward=-0.2),
        WalkVelocity(left=0.5 * limits.left),
        WalkVelocity(left=limits.left),
        WalkVelocity(left=-limits.left),
        WalkVelocity(turn=limits.turn),
        WalkVelocity(0.2, 0.02, 0.15),
    ):
        robot = standing(body, 0)
        robot.walk(velocity, 4.0)
        reached = mean_velocity(robot.place, robot.go, 9.0, 0.05)
        commanded = ", ".join(f"{value:g}" for value in (velocity.forward, velocity.left, velocity.turn))
        ended = "fell" if robot.fallen else f"{math.degrees(robot.tilt):.1f} deg"
        table.add_row(commanded, ", ".join(f"{value:.3f}" for value in reached), ended)
    CONSOLE.print(f"{body}: velocities", table)


@dataclass(frozen=True)
class Walked:
    """What became of a minute's walk."""

    fell: bool
    way: float
    """In m."""
    missed: float
    """Error of the odometry in m."""
    turned: float
    """Error of its heading in rad."""
    seconds: float
    """Processor time."""


def walk_course(body: str, seed: int) -> Walked:
    """Walk for a minute, and stop."""
    robot, way = standing(body, seed), 0.0
    begin, odometry = robot.place(), robot.walker.odometry()
    before, started = begin, time.process_time()
    for duration, velocity in (*COURSE, (4.0, STILL)):
        try:
            robot.walker.command(velocity)
        except InvalidCommand:
            break
        for _ in range(round(duration)):
            robot.go(1.0)
            now = robot.place()
            way += math.hypot(now[0] - before[0], now[1] - before[1])
            before = now
    seconds = time.process_time() - started
    end, believed = robot.place(), robot.walker.odometry()
    turn = begin[2] - odometry.heading
    x, y = believed.x - odometry.x, believed.y - odometry.y
    missed = math.hypot(
        math.cos(turn) * x - math.sin(turn) * y - (end[0] - begin[0]),
        math.sin(turn) * x + math.cos(turn) * y - (end[1] - begin[1]),
    )
    turned = abs(math.remainder(believed.heading + turn - end[2], math.tau))
    return Walked(robot.fallen, way, missed, turned, seconds)


def print_course(body: str, runs: int) -> None:
    walks = [walk_course(body, seed) for seed in range(runs)]
    upright = [walk for walk in walks if not walk.fell]
    falls = [str(seed) for seed, walk in enumerate(walks) if walk.fell]
    turned = math.degrees(max(walk.turned for walk in upright))
    seconds = statistics.median(walk.seconds for walk in upright)
    errors = [walk.missed / walk.way for walk in upright]
    CONSOLE.print(
        f"{body}: {runs} walks of a minute at 0.3 m/s with turns: {len(falls)} falls {', '.join(falls)}\n"
        f"odometry off by {statistics.mean(errors) * 100:.1f} % of the way,"
        f" {max(errors) * 100:.1f} % at most, its heading by {turned:.1f} deg at most\n"
        f"physics and walk: {64.0 / seconds:.0f} times real time\n"
    )


def directions() -> Iterator[tuple[str, float]]:
    yield from (("front", 0.0), ("left", math.pi / 2), ("rear", math.pi), ("right", -math.pi / 2))


def withstands(body: str, velocity: WalkVelocity, angle: float, impulse: float, delay: float) -> bool:
    """Return whether the robot still stands or walks some seconds after a push at the trunk."""
    robot = standing(body, 0)
    if velocity != STILL:
        robot.walk(velocity, 2.3)
    robot.go(delay)
    force, towards = impulse / PUSH_SECONDS, robot.place()[2] + angle
    robot.push(force * math.cos(towards), force * math.sin(towards), PUSH_SECONDS)
    robot.go(4.0)
    return not robot.fallen


def largest_push(body: str, velocity: WalkVelocity, angle: float, moments: int) -> float:
    """Return the largest impulse in N s that it withstands at each of some moments, within 1 N s."""
    smallest = STRONGEST
    for moment in range(moments):
        delay = TWO_STEPS * moment / moments
        if moment and withstands(body, velocity, angle, smallest, delay):
            continue
        low, high = 0.0, smallest
        while high - low > 1.0:
            middle = 0.5 * (low + high)
            if withstands(body, velocity, angle, middle, delay):
                low = middle
            else:
                high = middle
        smallest = low
    return smallest


def print_pushes(body: str, moments: int) -> None:
    table = Table("N s at the trunk, towards", "standing", "walking 0.2 m/s forward")
    for name, angle in directions():
        still = largest_push(body, STILL, angle, 1)
        walking = largest_push(body, WalkVelocity(forward=0.2), angle, moments)
        table.add_row(name, f"{still:.0f}", f"{walking:.0f}")
    CONSOLE.print(f"{body}: largest push of {PUSH_SECONDS:g} s that it withstands", table)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("bodies", nargs="*", default=list(BODIES), help="bodies: both, if none is given")
    parser.add_argument("--runs", type=int, default=30, help="walks of a minute")
    parser.add_argument("--moments", type=int, default=6, help="moments of two steps at which pushes strike")
    options = parser.parse_args()
    for body in options.bodies:
        print_velocities(body)
        print_course(body, options.runs)
        print_pushes(body, options.moments)


if __name__ == "__main__":
    main()
