"""Measure the cost of the simulated robot's senses compared with stepping, and the cost of reading them.

Times are processor times of the thread, the shortest of many rounds, so that other programs hardly affect
them.

    python benchmarks/bench_senses.py [--rounds 40]
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from naoserver.bodies.capabilities import WalkVelocity
from naoserver_sim._stepper import STEPS_PER_TICK
from naoserver_sim.robot import SimulatedRobot
from tests.support.present import present
from zenoh_ice import VirtualClock

CONSOLE = Console(width=100)
ASKED = 0.10
"""The largest share that the senses may add to the cost of stepping."""
TICKS = 50


def least(rounds: int, work: dict[str, Callable[[], None]]) -> dict[str, float]:
    """Return the shortest time in s of each function; their calls alternate."""
    best = dict.fromkeys(work, float("inf"))
    for _ in range(rounds):
        for name, run in work.items():
            begin = time.thread_time()
            run()
            best[name] = min(best[name], time.thread_time() - begin)
    return best


def cost_of_standing(rounds: int, *, noise: bool) -> tuple[float, float]:
    """Return the time of a control tick in s without the senses, and the time that they add.

    Without them MuJoCo measures nothing, and nothing reads values.
    """
    robot = SimulatedRobot(clock=VirtualClock(), skin=False, noise=noise, seed=1)
    simulator = robot._simulator
    mj, data = simulator.physics.mj, simulator.physics.data
    watchers, physics = list(simulator.watchers), simulator.physics
    step = physics._stepper.tick

    def bare_step() -> None:
        mj.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        mujoco.mj_step(mj, data, nstep=STEPS_PER_TICK)

    def bare() -> None:
        simulator.watchers.clear()
        physics._stepper.tick = bare_step  # type: ignore[method-assign]
        physics.advance(TICKS)

    def feeling() -> None:
        simulator.watchers[:] = watchers
        physics._stepper.tick = step  # type: ignore[method-assign]
        physics.advance(TICKS)

    best = least(rounds, {"bare": bare, "feeling": feeling})
    return best["bare"] / TICKS, (best["feeling"] - best["bare"]) / TICKS


def cost_of_walking(rounds: int, *, noise: bool) -> float:
    """Return the time of a control tick in s of a robot that walks, with its senses."""
    robot = SimulatedRobot(clock=VirtualClock(), skin=False, noise=noise, seed=1)
    present(robot.walker).command(WalkVelocity(forward=0.1))
    return least(rounds, {"walk": lambda: robot._simulator.physics.advance(TICKS)})["walk"] / TICKS


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description="Measure what the senses of the simulated robot cost.")
    parser.add_argument("--rounds", type=int, default=40)
    rounds = parser.parse_args().rounds
    table = Table(title=f"Senses compared with stepping (required: less than {ASKED:.0%} more)")
    for column in ("", "stepping, us per tick", "senses, us per tick", "more"):
        table.add_column(column, justify="right" if column else "left")
    for noise in (False, True):
        bare, senses = cost_of_standing(rounds, noise=noise)
        walking = cost_of_walking(rounds, noise=noise) - senses
        for name, stepping in (("standing", bare), ("walking", walking)):
            figures = (f"{stepping * 1e6:.1f}", f"{senses * 1e6:.1f}", f"{senses / stepping:.1%}")
            table.add_row(f"{name}{', with noise' if noise else ''}", *figures)
    CONSOLE.print(table)

    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False)
    reads: list[float] = []
    again: list[float] = []
    for _ in range(rounds):
        clock.advance(0.1)
        robot.state()  # the physics is brought up to date here
        for times in (reads, again):
            begin = time.thread_time()
            robot.senses.read()
            times.append(time.thread_time() - begin)
    CONSOLE.print(
        f"reading all senses: {min(reads) * 1e6:.0f} us after a measurement of the sonar,"
        f" {min(again) * 1e6:.0f} us without new values"
    )


if __name__ == "__main__":
    main()
