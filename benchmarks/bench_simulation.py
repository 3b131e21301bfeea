"""Measure the simulated robot: pace, lag, memory, cost of physics and images, balance while it dances.

The server runs as a process of its own and is read over Zenoh, as its users do; the rest is measured inside.

    python benchmarks/bench_simulation.py [--seconds 10]
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from pathlib import Path

import mujoco
import psutil
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from interfaces.jderobot import CameraPrx
from interfaces.nao import HealthPrx
from naoserver.body import H25
from naoserver_sim.model import build_model, standing
from naoserver_sim.robot import SimulatedRobot
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import VirtualClock, initialize

CONSOLE = Console(width=100)
SETTLING = 1.5
"""Seconds after the start that are not measured: the factor and the lag are those of the last second."""


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


def print_physics() -> None:
    model = build_model()
    data = standing(model, H25.postures["STAND_INIT"])
    steps = 4000
    begin = time.perf_counter()
    mujoco.mj_step(model.mj, data, nstep=steps)
    cost = (time.perf_counter() - begin) / steps
    CONSOLE.print(
        f"physics: {cost * 1e6:.1f} us a step of {model.mj.opt.timestep * 1e3:g} ms standing,"
        f" {model.mj.opt.timestep / cost:.0f} times real time on one core\n"
    )


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
    print_images()
    print_dance()
    print_served(seconds)


if __name__ == "__main__":
    main()
