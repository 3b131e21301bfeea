"""Measure the simulated robot's walk and balance, and print the figures with the requirements.

Everything runs in virtual time, with noise in every sense. The largest pushes are also plotted.

    python benchmarks/bench_walk.py [--programmes 30] [--robots 8] [--plot docs/pictures/walk/pushes.png]
"""

from __future__ import annotations

import argparse
import cmath
import logging
import math
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from hfsm_runtime.virtual.clock import TaskClock
from hfsm_runtime.virtual.network import VirtualNetwork
from interfaces.nao import ActionStatus, WalkPrx
from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.errors import InvalidCommand
from naoserver_sim._walk.walker import LIMITS
from naoserver_sim.robot import SimulatedRobot
from tests.support.present import present
from tests.support.walking import mean_velocity
from visualhfsm.simulation._robot import RobotUnderTest
from zenoh_ice import VirtualClock

CONSOLE = Console(width=100)
DIRECTIONS: Final = 8
PUSH_SECONDS: Final = 0.1
TWO_STEPS: Final = 0.51
"""Seconds."""
STRONGEST: Final = 8.0
"""N s: more than any push that the robot withstands."""


class Run:
    """A robot with noisy senses that has stood for two seconds."""

    def __init__(self, seed: int, *, noise: bool = True) -> None:
        self.clock = VirtualClock()
        self.robot = SimulatedRobot(clock=self.clock, skin=False, noise=noise, seed=seed)
        self.go(2.0)

    def go(self, seconds: float) -> None:
        """Let time pass."""
        self.clock.advance(seconds)
        self.robot.read()

    def walk(self, velocity: WalkVelocity, seconds: float = 0.0) -> None:
        """Command a velocity and let time pass."""
        present(self.robot.walker).command(velocity)
        self.go(seconds)

    @property
    def fallen(self) -> bool:
        """Whether the robot lies."""
        return self.robot.state().fallen

    def place(self) -> tuple[float, float, float]:
        """Return the true position of the robot on the floor, and its heading."""
        torso = self.robot.stage.truth().torso
        return torso.position[0], torso.position[1], torso.heading


def reached(velocity: WalkVelocity, seconds: float = 10.0) -> tuple[float, float, float]:
    """Return the mean velocity in the robot's frame, once it walks."""
    run = Run(0)
    run.walk(velocity, 3.0)
    return mean_velocity(run.place, run.go, seconds, 0.02)


def print_speeds() -> None:
    table = Table("commanded: m/s forward, m/s left, rad/s", "reached", "off (required: 15 %)")
    for velocity in (
        *(WalkVelocity(forward=speed) for speed in (0.1, 0.2, 0.25, LIMITS.forward, -0.25)),
        *(WalkVelocity(left=speed) for speed in (0.05, 0.1, LIMITS.left, -0.1)),
        *(WalkVelocity(turn=speed) for speed in (0.4, 0.8, LIMITS.turn, -0.8)),
        WalkVelocity(0.2, 0.05, 0.4),
    ):
        wanted = (velocity.forward, velocity.left, velocity.turn)
        found = reached(velocity)
        off = [abs(is_ / asked - 1.0) for is_, asked in zip(found, wanted, strict=True) if asked]
        table.add_row(
            ", ".join(f"{value:g}" for value in wanted),
            ", ".join(f"{value:.3f}" for value in found),
            ", ".join(f"{part * 100:.1f} %" for part in off),
        )
    CONSOLE.print("velocities", table)


def print_drift(runs: int = 10) -> None:
    drifts, errors, turns = [], [], []
    for seed in range(runs):
        run = Run(seed)
        x, y, heading = run.place()
        begin = present(run.robot.walker).odometry()
        way = 0.0
        run.walk(WalkVelocity(forward=0.25))
        while way < 3.0:
            run.go(0.1)
            to_x, to_y, to_heading = run.place()
            way = math.hypot(to_x - x, to_y - y)
        odometry = present(run.robot.walker).odometry()
        drifts.append(abs(math.cos(heading) * (to_y - y) - math.sin(heading) * (to_x - x)))
        # Both in the frame of the robot at the start.
        turn = heading - begin.heading
        dx, dy = odometry.x - begin.x, odometry.y - begin.y
        there_x = math.cos(turn) * dx - math.sin(turn) * dy
        there_y = math.sin(turn) * dx + math.cos(turn) * dy
        errors.append(math.hypot(there_x - (to_x - x), there_y - (to_y - y)) / way)
        turns.append(abs(math.remainder(odometry.heading - to_heading + turn, math.tau)))
    CONSOLE.print(
        f"3 m straight, {runs} times: drift {statistics.mean(drifts):.2f} m, at most {max(drifts):.2f} m"
        f" (required: 0.3); odometry off by {statistics.mean(errors) * 100:.1f} %, at most"
        f" {max(errors) * 100:.1f} % (required: 10); heading by at most {math.degrees(max(turns)):.1f} deg\n"
    )


def print_places(robots: int, places: int = 6, farthest: float = 0.3) -> None:
    """Walk to places near by, with any heading in front, by the servant `Walk`."""
    errors, turns, longest = [], [], 0.0
    for seed in range(1, robots + 1):
        random, clock = np.random.default_rng(seed), TaskClock()
        network = VirtualNetwork(clock)
        robot = RobotUnderTest("sim", clock, network, camera="drawn", seed=seed, noise=True)
        walk: Any = WalkPrx.uncheckedCast(network.communicator.stringToProxy("Walk"))
        stage = present(robot.device.stage)
        clock.advance(2.0)
        for _ in range(places):
            way = cmath.rect(farthest * math.sqrt(random.uniform()), random.uniform(-math.pi, math.pi))
            heading = random.uniform(-1.0, 1.0)
            before, began = stage.truth().torso, clock.now()
            walk.walkTo(way.real, way.imag, heading)
            clock.advance(0.1)
            while walk.getWalkState().status is ActionStatus.Moving:
                clock.advance(0.1)
            assert walk.getWalkState().status is ActionStatus.Done, walk.getWalkState().message
            longest = max(longest, clock.now() - began)
            clock.advance(1.0)
            after = stage.truth().torso
            moved = complex(*after.position[:2]) - complex(*before.position[:2])
            errors.append(100 * abs(moved * cmath.rect(1.0, -before.heading) - way))
            turned = math.remainder(after.heading - before.heading - heading, math.tau)
            turns.append(abs(math.degrees(turned)))
        robot.close()
        network.communicator.destroy()
    mean, mean_turn = (math.sqrt(statistics.mean(each**2 for each in found)) for found in (errors, turns))
    CONSOLE.print(
        f"{len(errors)} walks to places within {farthest:g} m, at most {longest:.1f} s: off by {mean:.1f} cm,"
        f" at most {max(errors):.1f} cm, and {mean_turn:.1f} deg, at most {max(turns):.1f} deg"
        " (root mean squares)\n"
    )


def programme(seed: int, seconds: float = 60.0) -> tuple[float | None, float, float, float]:
    """Walk at random velocities of the full range, with a new one every 3 s.

    Returns the time of a fall, the distance, the error of the odometry in m, and the processor time in s.
    """
    run, random = Run(seed), np.random.default_rng(seed)
    begin = time.process_time()
    x, y, _ = run.place()
    way = 0.0
    for step in range(round(seconds / 0.5)):
        if step % 6 == 0:
            forward, left, turn = random.uniform(-1.0, 1.0, 3) * (random.random() > 0.1)
            try:
                run.walk(WalkVelocity(forward * LIMITS.forward, left * LIMITS.left, turn * LIMITS.turn))
            except InvalidCommand:
                break
        run.go(0.5)
        to_x, to_y, _ = run.place()
        way += math.hypot(to_x - x, to_y - y)
        x, y = to_x, to_y
        if run.fallen:
            return 0.5 * step, way, math.nan, math.nan
    odometry = present(run.robot.walker).odometry()
    return None, way, math.hypot(odometry.x - x, odometry.y - y), time.process_time() - begin


def print_programmes(count: int) -> None:
    falls, costs, parts = [], [], []
    for seed in range(count):
        fell, way, missed, cost = programme(seed)
        if fell is None:
            costs.append(cost)
            parts.append(missed / way)
        else:
            falls.append(f"seed {seed} at {fell:g} s")
    CONSOLE.print(
        f"{count} random programmes of 60 s at up to {LIMITS.forward:g} m/s, {LIMITS.left:g} m/s and"
        f" {LIMITS.turn:g} rad/s at once: {len(falls)} falls (required: at most 2 of 30) {', '.join(falls)}\n"
        f"odometry off by {statistics.mean(parts) * 100:.1f} % of the way, at most {max(parts) * 100:.1f} %\n"
        f"physics, senses and walk: {60.0 / statistics.median(costs):.0f} times real time on one core"
        f" (required for physics and walk: 30)\n"
    )


def print_balance(minutes: float) -> None:
    def nothing(run: Run, number: int) -> None:
        """Leave the robot alone."""

    def look_round(run: Run, number: int) -> None:
        side = 1.0 if number % 2 else -1.0
        speeds = {name: run_speeds(run)[name] for name in ("HeadYaw", "HeadPitch")}
        run.robot.command_positions({"HeadYaw": side * 2.0, "HeadPitch": side * 0.4}, speeds)

    def dance(run: Run, number: int) -> None:
        poses = ((-1.4, 0.2, -0.1, 1.0), (1.4, 0.2, -1.4, -1.0), (0.0, 1.2, -0.1, 0.0), (0.0, 0.1, -1.0, 0.5))
        pitch, roll, elbow, yaw = poses[number % len(poses)]
        targets = {"HeadYaw": yaw}
        for side, sign in (("L", 1.0), ("R", -1.0)):
            targets[f"{side}ShoulderPitch"] = pitch
            targets[f"{side}ShoulderRoll"] = sign * roll
            targets[f"{side}ElbowRoll"] = sign * elbow
        speeds = run_speeds(run)
        run.robot.command_positions(targets, {name: speeds[name] for name in targets})

    table = Table("standing", "falls (required: 0)", "worst tilt")
    rows: Sequence[tuple[str, Callable[[Run, int], None], float]] = (
        ("still", nothing, 1.0),
        ("head at full speed", look_round, 0.7),
        ("dance, both arms at full speed", dance, 1.2),
    )
    for name, act, pause in rows:
        run, worst = Run(0), 0.0
        for number in range(round(minutes * 60.0 / pause)):
            act(run, number)
            for _ in range(4):
                run.go(pause / 4)
                worst = max(worst, run.robot.state().torso_tilt)
        table.add_row(
            f"{minutes:g} min, {name}", "1" if run.fallen else "0", f"{math.degrees(worst):.1f} deg"
        )
    CONSOLE.print(table)


def run_speeds(run: Run) -> dict[str, float]:
    return {joint.name: joint.max_velocity for joint in run.robot.joints}


@dataclass(frozen=True)
class Gaits:
    """The situations in which the robot is pushed."""

    name: str
    velocity: WalkVelocity


GAITS: Final = (
    Gaits("standing", STILL),
    Gaits("walking 0.2 m/s forward", WalkVelocity(forward=0.2)),
)


def withstands(velocity: WalkVelocity, angle: float, impulse: float, delay: float) -> bool:
    """Return whether the robot still stands or walks some seconds after a push at the torso."""
    run = Run(0)
    if velocity != STILL:
        run.walk(velocity, 2.0)
    run.go(delay)
    _, _, heading = run.place()
    force = impulse / PUSH_SECONDS
    direction = (math.cos(heading + angle), math.sin(heading + angle))
    run.robot.stage.push((force * direction[0], force * direction[1], 0.0), PUSH_SECONDS)
    for _ in range(16):
        run.go(0.25)
        if run.fallen:
            return False
    return True


def largest_push(velocity: WalkVelocity, angle: float, moments: int) -> float:
    """Return the largest impulse in N s that it withstands at each of some moments, within 0.1 N s."""
    smallest = STRONGEST
    for moment in range(moments):
        delay = TWO_STEPS * moment / moments
        if moment and withstands(velocity, angle, smallest, delay):
            continue
        low, high = 0.0, smallest
        while high - low > 0.1:
            middle = (low + high) / 2
            if withstands(velocity, angle, middle, delay):
                low = middle
            else:
                high = middle
        smallest = low
    return smallest


def print_pushes(moments: int, plot: Path | None) -> None:
    angles = [math.tau * number / DIRECTIONS for number in range(DIRECTIONS)]
    names = ("front", "front left", "left", "rear left", "rear", "rear right", "right", "front right")
    table = Table("N s at the torso, towards", *(gait.name for gait in GAITS))
    found = {gait.name: [largest_push(gait.velocity, angle, moments) for angle in angles] for gait in GAITS}
    for number, name in enumerate(names):
        table.add_row(name, *(f"{found[gait.name][number]:.1f}" for gait in GAITS))
    CONSOLE.print(
        f"largest push of {PUSH_SECONDS:g} s that it withstands at each of {moments} moments of two steps",
        table,
    )
    if plot is not None:
        draw(found, angles, names, plot)
        CONSOLE.print(f"plotted to {plot}")


def draw(found: dict[str, list[float]], angles: Sequence[float], names: Sequence[str], plot: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes

    figure = Figure(figsize=(6.4, 5.6), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(projection="polar")
    assert isinstance(axes, PolarAxes)
    axes.set_theta_zero_location("N")
    for name, values in found.items():
        axes.plot([*angles, angles[0]], [*values, values[0]], marker="o", label=name)
    axes.set_xticks(list(angles), names)
    axes.set_rlim(0.0, math.ceil(max(max(values) for values in found.values())))
    axes.set_rlabel_position(22.5)
    axes.tick_params(axis="x", pad=18)
    axes.set_title("Largest push at the torso that the robot withstands, N s")
    axes.legend(loc="upper left", bbox_to_anchor=(-0.25, 1.1), frameon=False)
    plot.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(plot)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--programmes", type=int, default=30, help="random programmes of 60 s")
    parser.add_argument("--robots", type=int, default=8, help="robots that walk to places near by")
    parser.add_argument("--minutes", type=float, default=10.0, help="minutes of standing, looking, dancing")
    parser.add_argument(
        "--moments", type=int, default=6, help="moments of two steps at which each push strikes"
    )
    parser.add_argument("--plot", type=Path, help="PNG file for a plot of the pushes")
    options = parser.parse_args()
    logging.getLogger("naoserver_sim").setLevel(logging.ERROR)  # falls are part of the figures
    print_speeds()
    print_drift()
    print_places(options.robots)
    print_programmes(options.programmes)
    print_balance(options.minutes)
    print_pushes(options.moments, options.plot)


if __name__ == "__main__":
    main()
