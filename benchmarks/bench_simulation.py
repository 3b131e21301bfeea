"""Measure the simulated robot: pace, lag, memory, cost of physics and images, balance while it dances.

Required are steps at 30 times real time with walk and senses, and three robots with a camera each in real
time on two cores. docs/explanation/comparison.md compares these figures with qiBullet's.

The server runs as a separate process and is read over Zenoh, as by users; the rest is measured in this
process.

    python benchmarks/bench_simulation.py [--seconds 10]
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from unittest.mock import patch

import gymnasium
import mujoco
import numpy as np
import psutil
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from interfaces.jderobot import CameraPrx
from interfaces.nao import HealthPrx
from naoserver.bodies import find_body
from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.bodies.nao import H25
from naoserver.body import Body
from naoserver_sim.arena import Arena
from naoserver_sim.model import build_model
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.standing import standing
from naoserver_sim.world import load_world, side_by_side
from tests.support.present import present
from tests.support.processes import ComponentProcess, free_endpoint, module
from visualhfsm_learning import ENVIRONMENTS
from zenoh_ice import VirtualClock, initialize

CONSOLE = Console(width=100)
SETTLING = 1.5
"""Seconds after the start that are not measured: the factor and the lag are means over the last second."""
ROUNDS = 7
TICKS = 200
"""Control ticks of 10 ms, with 4 steps each, in a round."""
TURNS = 41
"""Rounds in which a body's robot and bare steps take turns."""
SHORT = TICKS // 4
"""Control ticks of such a round."""


def served(seconds: float, options: list[str], cameras: tuple[str, ...]) -> list[str]:
    """Run a server, subscribe to cameras, and return its pace, lag, image rates, memory and load."""
    endpoint = free_endpoint()
    with (
        ComponentProcess(module("naoserver_sim", "--listen", endpoint, *options)) as process,
        initialize(connect=[endpoint], listen=["tcp/127.0.0.1:0"]) as communicator,
    ):
        process.wait_for("^ready")
        observed = psutil.Process(process.process.pid)
        health = HealthPrx.checkedCast(communicator.stringToProxy("Health"))
        arrived = dict.fromkeys(cameras, 0)
        subscriptions = []
        for name in cameras:
            camera = CameraPrx.checkedCast(communicator.stringToProxy(name))

            def count(_: object, name: str = name) -> None:
                arrived[name] += 1

            subscriptions.append(camera.getImageData.subscribe(count))
        time.sleep(SETTLING)
        begin, counted, used = time.monotonic(), dict(arrived), observed.cpu_times()
        factors, lags = [], []
        while (elapsed := time.monotonic() - begin) < seconds:
            report = health.getHealth()
            factors.append(report.realTimeFactor)
            lags.append(report.lag)
            time.sleep(0.2)
        now = observed.cpu_times()
        load = (now.user + now.system - used.user - used.system) / elapsed
        memory = observed.memory_info().rss / 2**20
        for subscription in subscriptions:
            subscription.close()
    rates = ", ".join(f"{(arrived[name] - counted[name]) / elapsed:.1f}" for name in cameras)
    return [
        " ".join(options) or "(none)",
        str(len(cameras)),
        f"{min(factors):.3f} .. {max(factors):.3f}",
        f"{max(lags) * 1000:.1f}",
        rates or "-",
        f"{memory:.0f}",
        f"{load * 100:.0f} %",
    ]


def print_served(seconds: float) -> None:
    both = ("Camera", "CameraBottom")
    table = Table("options", "cameras read", "real-time factor", "worst lag ms", "images/s", "MB", "CPU")
    for options, cameras in (
        ([], ()),
        ([], both),
        (["--camera", "Camera=640x480@15"], both),
        ([], (*both, "CameraOutside")),
        (["--speed", "5"], both),
        (["--speed", "20"], ()),
        (["--speed", "max"], ()),
    ):
        table.add_row(*served(seconds, options, cameras))
    CONSOLE.print("naoserver-sim, read over Zenoh", table)


def paces(work: Callable[[], float], rounds: int = ROUNDS) -> list[float]:
    """Return the simulated seconds per second of this thread's processor time, for each round of work."""
    measured = []
    for _ in range(rounds):
        begin = time.thread_time()
        simulated = work()
        measured.append(simulated / (time.thread_time() - begin))
    return measured


def stepping() -> dict[str, list[float]]:
    """Return the speed of one core as a multiple of real time, by the content of a step."""
    model = build_model(skin=False)
    data = standing(model, H25.postures["StandInit"].angles)

    def bare() -> float:
        mujoco.mj_step(model.mj, data, nstep=4 * TICKS)
        return TICKS * 0.01

    figures = {"physics alone, standing": paces(bare)}
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, noise=True, seed=1)

    def advance() -> float:
        clock.advance(TICKS * 0.01)
        robot.state()
        return TICKS * 0.01

    def read_and_command() -> float:
        for _ in range(TICKS // 2):
            clock.advance(0.02)
            robot.read()
            robot.senses.read()
            robot.command_positions({"HeadYaw": 0.1}, {"HeadYaw": 4.0})
        return TICKS * 0.01

    figures["standing, senses with noise"] = paces(advance)
    figures["the same, read and commanded at 50 Hz"] = paces(read_and_command)
    present(robot.walker).command(WalkVelocity(0.2))
    advance()
    figures["walking, senses with noise"] = paces(advance)
    robot.close()
    return figures


def bare_steps(body: Body) -> Callable[[], float]:
    """Return a round of steps of a body's model alone, in which the robot stands."""
    model = build_model(skin=False, body=body)
    data = standing(model, body.postures["StandInit"].angles)

    def work() -> float:
        mujoco.mj_step(model.mj, data, nstep=4 * SHORT)
        return SHORT * 0.01

    return work


def beside(bare: Callable[[], float], work: Callable[[], float]) -> tuple[float, float]:
    """Return the pace of some work beside that of bare steps, and the part of it that is steps.

    They take turns, because others may use the processor: both are medians over the rounds.
    """
    step, spent = mujoco.mj_step, 0.0

    def timed(*arguments: object, **named: object) -> None:
        nonlocal spent
        begin = time.thread_time()
        step(*arguments, **named)
        spent += time.thread_time() - begin

    ratios, parts = [], []
    for _ in range(TURNS):
        (alone,), (own,) = paces(bare, 1), paces(work, 1)
        ratios.append(own / alone)
        begin, spent = time.thread_time(), 0.0
        with patch.object(mujoco, "mj_step", timed):
            work()
        parts.append(spent / (time.thread_time() - begin))
    return statistics.median(ratios), statistics.median(parts)


def learning(name: str) -> float:
    """Return the pace of a Gymnasium environment whose robot does not move, beside bare steps."""
    environment = gymnasium.make(f"visualhfsm_learning:{name}", disable_env_checker=True)
    environment.reset(seed=1)
    still = np.zeros(environment.action_space.shape or (), np.float32)

    def step() -> float:
        for _ in range(SHORT // 2):
            environment.step(still)
        return SHORT * 0.01

    ratio, _ = beside(bare_steps(H25), step)
    environment.close()
    return ratio


def print_physics() -> None:
    table = Table("one core", "times real time", "steps per second", "median")
    for name, measured in stepping().items():
        best = max(measured)
        table.add_row(name, f"{best:.0f}", f"{best * 400:.0f}", f"{statistics.median(measured):.0f}")
    CONSOLE.print(
        "physics steps of 2.5 ms, by processor time (required: 30 times real time while walking)", table
    )
    table = Table("environment of Gymnasium", "pace beside bare steps")
    for name in ENVIRONMENTS:
        table.add_row(name, f"{learning(name):.2f}")
    CONSOLE.print(table)


def read_for(clock: VirtualClock, robot: SimulatedRobot) -> Callable[[], float]:
    """Return a round of work: a robot goes on, and its joints are read at 50 Hz."""

    def work() -> float:
        for _ in range(SHORT // 2):
            clock.advance(0.02)
            robot.read()
        return SHORT * 0.01

    return work


def beside_bare_steps(body: Body) -> list[str]:
    """Return how fast a body's model steps alone, and a robot that stands and walks with noise beside it."""
    bare = bare_steps(body)
    row = [f"{400 * max(paces(bare, TURNS)):,.0f}"]
    for velocity in (STILL, WalkVelocity(0.2)):
        clock = VirtualClock()
        robot = SimulatedRobot(clock=clock, skin=False, noise=True, seed=1, body=body)
        clock.advance(1.0)
        present(robot.walker).command(velocity)
        clock.advance(1.0)
        ratio, part = beside(bare, read_for(clock, robot))
        robot.close()
        row += [f"{ratio:.2f}", f"{ratio / part:.2f}"]
    return row


def print_bodies() -> None:
    table = Table("body", "bare steps a second", "standing", "its steps alone", "walking", "its steps alone")
    for name in ("H25", "T1", "G1"):
        table.add_row(name, *beside_bare_steps(find_body(name)))
    CONSOLE.print(
        "processor time of bare steps of a standing model beside that of a robot with noise whose joints are"
        " read at 50 Hz, and beside that of its own steps alone, which are dearer than those of a robot at"
        " rest",
        table,
    )


def walking_together(robots: int, body: Body, *, images: bool = False) -> Callable[[], float]:
    """Return a round of work: robots walk round in one world, perhaps with 10 images a second of each."""
    clock = VirtualClock()
    world = side_by_side(load_world("soccer"), robots)
    arena = Arena(world, clock=clock, noise=True, seed=1, body=body, skin=images)
    clock.advance(0.5)
    for robot in arena.robots:
        present(robot.walker).command(WalkVelocity(0.1, 0.0, 0.3))
    clock.advance(1.0)

    def work() -> float:
        begin = time.process_time()
        for _ in range(SHORT // 10):
            clock.advance(0.1)
            for robot in arena.robots:
                robot.read()
                if images:
                    robot.capture("Camera", 320, 240)
        return time.process_time() - begin

    return work


def print_one_world() -> None:
    """Compare the processor time of a robot in a world of four with that of one in a world of its own."""
    table = Table("body", "one of four beside one alone", "four, times real time", "with 10 images/s each")
    for name in ("H25", "T1"):
        body = find_body(name)
        alone, four = walking_together(1, body), walking_together(4, body)
        pairs = [(alone(), four()) for _ in range(TURNS)]
        seen = walking_together(4, body, images=True)
        table.add_row(
            name,
            f"{statistics.median(together / (4 * one) for one, together in pairs):.2f}",
            f"{SHORT * 0.01 / statistics.median(together for _, together in pairs):.1f}",
            f"{SHORT * 0.01 / statistics.median(seen() for _ in range(ROUNDS)):.1f}",
        )
    CONSOLE.print("walking robots with noise, by processor time (required: 1.2 at most)", table)


def print_picture_rates() -> None:
    table = Table("size", "noise", "images per second of processor time", "median")
    for noise in (False, True):
        robot = SimulatedRobot(clock=VirtualClock(), noise=noise, seed=1)
        for size in ((320, 240), (640, 480)):
            robot.capture("Camera", *size)
            rates = []
            for _ in range(ROUNDS):
                begin = time.process_time()
                for _ in range(50):
                    robot.capture("Camera", *size)
                rates.append(50 / (time.process_time() - begin))
            sides = f"{size[0]}x{size[1]}"
            table.add_row(
                sides, "yes" if noise else "no", f"{max(rates):.0f}", f"{statistics.median(rates):.0f}"
            )
        robot.close()
    CONSOLE.print("images of the top camera in one process", table)


def print_team(seconds: float, robots: int = 3, cores: int = 2) -> None:
    """Run several robots on a few cores, and read a camera of each."""
    this = psutil.Process()
    before = this.cpu_affinity()
    available = sorted(before)[:cores]
    this.cpu_affinity(available)  # processes that are started from now on inherit it
    table = Table("camera", "worst real-time factors", "images/s", "worst lags ms", "cores used")
    for camera in ("320x240@10", "640x480@15"):
        options = ["--camera", f"Camera={camera}"]
        with ThreadPoolExecutor(robots) as pool:
            started = [pool.submit(served, seconds, options, ("Camera",)) for _ in range(robots)]
            runs = [run.result() for run in started]
        factors, lags, rates, loads = ([run[column] for run in runs] for column in (2, 3, 4, 6))
        table.add_row(
            camera,
            ", ".join(factor.split(" .. ")[0] for factor in factors),
            ", ".join(rates),
            ", ".join(lags),
            f"{sum(float(load.split()[0]) for load in loads) / 100:.2f}",
        )
    this.cpu_affinity(before)
    CONSOLE.print(f"{robots} robots on {len(available)} cores, a camera of each read over Zenoh", table)


def print_images() -> None:
    table = Table("camera", "size", "median ms, skin", "median ms, blocks")
    rows: dict[tuple[str, tuple[int, int]], list[float]] = {}
    for skin in (True, False):
        robot = SimulatedRobot(clock=VirtualClock(), skin=skin)
        try:
            for camera in robot.cameras:
                for size in camera.sizes:
                    costs = []
                    for _ in range(25):
                        begin = time.perf_counter()
                        robot.capture(camera.name, *size)
                        costs.append(time.perf_counter() - begin)
                    rows.setdefault((camera.name, size), []).append(statistics.median(costs[5:]) * 1000)
        finally:
            robot.close()
    for (name, (width, height)), costs in rows.items():
        table.add_row(name, f"{width}x{height}", *(f"{cost:.1f}" for cost in costs))
    CONSOLE.print("one image, from the call to the pixels", table)


def dance(fraction: float, arms: str, seconds: float = 30.0) -> tuple[float, int]:
    """Move arms and head at a fraction of full speed; return the worst tilt and the number of poses."""
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False)
    place = {joint.name: number for number, joint in enumerate(robot.joints)}
    full = {joint.name: joint.max_velocity for joint in robot.joints}
    poses = ((-1.4, 0.2, 0.1, 1.0), (1.4, 0.2, 1.4, -1.0), (0.0, 1.2, 0.1, 0.0), (0.0, -0.1, 1.0, 0.5))
    worst, reached = 0.0, 0
    while clock.now() < seconds:
        pitch, roll, elbow, yaw = poses[reached % len(poses)]
        targets = {"HeadYaw": yaw}
        for arm in arms:
            outward = 1 if arm == "L" else -1
            targets |= {
                f"{arm}ShoulderPitch": pitch,
                f"{arm}ShoulderRoll": outward * roll,
                f"{arm}ElbowRoll": -outward * elbow,
            }
        robot.command_positions(targets, {name: fraction * full[name] for name in targets})
        while clock.now() < seconds:
            clock.advance(0.02)
            worst = max(worst, robot.state().torso_tilt)
            positions = robot.read().positions
            if all(abs(positions[place[name]] - target) < 0.06 for name, target in targets.items()):
                reached += 1
                break
    robot.close()
    return math.degrees(worst), reached


def print_dance() -> None:
    table = Table("arms", *(f"{fraction:g} of full speed" for fraction in (0.1, 0.2, 0.3, 0.5, 1.0)))
    for arms in ("R", "L", "LR"):
        results = [dance(fraction, arms) for fraction in (0.1, 0.2, 0.3, 0.5, 1.0)]
        table.add_row(arms, *(f"{tilt:.1f} deg, {poses} poses" for tilt, poses in results))
    CONSOLE.print("largest tilt of the torso while arms and head dance for 30 s (6.5 deg standing)", table)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10.0, help="duration of each run of the server")
    seconds = parser.parse_args().seconds
    print_physics()
    print_bodies()
    print_one_world()
    print_picture_rates()
    print_images()
    print_team(seconds)
    print_dance()
    print_served(seconds)


if __name__ == "__main__":
    main()
