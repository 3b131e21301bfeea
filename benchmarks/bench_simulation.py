"""Measure the simulated robot: the cost of physics, senses and images, and of several robots in one world.

Required are steps at 30 times real time with walk and senses. docs/explanation/comparison.md compares these
figures with qiBullet's. Times are processor times, so that other programs hardly affect them; those of the
senses are the shortest of many rounds.

    python benchmarks/bench_simulation.py [--rounds 40] [physics] [bodies] [world] [pictures] [senses]
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from unittest.mock import patch

import gymnasium
import mujoco
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.common import parts
from naoserver.bodies import find_body
from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.bodies.nao import H25
from naoserver.body import Body
from naoserver_sim._stepper import STEPS_PER_TICK
from naoserver_sim.arena import Arena
from naoserver_sim.model import build_model
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.standing import standing
from naoserver_sim.world import load_world, side_by_side
from tests.support.present import present
from visualhfsm_learning import ENVIRONMENTS
from zenoh_ice import VirtualClock

ROUNDS = 7
TICKS = 200
"""Control ticks of 10 ms, with 4 steps each, in a round."""
TURNS = 41
"""Rounds in which a body's robot and bare steps take turns."""
SHORT = TICKS // 4
"""Control ticks of such a round."""
ASKED = 0.10
"""The largest share that the senses may add to the cost of stepping."""
SENSED = 50


CONSOLE = Console(width=100)


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


def print_physics(_: argparse.Namespace) -> None:
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


def print_bodies(_: argparse.Namespace) -> None:
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


def print_one_world(_: argparse.Namespace) -> None:
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


def print_picture_rates(given: argparse.Namespace) -> None:
    table = Table("size", "noise", "images per second of processor time", "median")
    for noise in (False, True):
        robot = SimulatedRobot(clock=VirtualClock(), noise=noise, seed=1)
        for size in ((320, 240), (640, 480)):
            robot.capture("Camera", *size)
            rates = []
            for _ in range(min(given.rounds, ROUNDS)):
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
        physics.advance(SENSED)

    def feeling() -> None:
        simulator.watchers[:] = watchers
        physics._stepper.tick = step  # type: ignore[method-assign]
        physics.advance(SENSED)

    best = least(rounds, {"bare": bare, "feeling": feeling})
    return best["bare"] / SENSED, (best["feeling"] - best["bare"]) / SENSED


def cost_of_walking(rounds: int, *, noise: bool) -> float:
    """Return the time of a control tick in s of a robot that walks, with its senses."""
    robot = SimulatedRobot(clock=VirtualClock(), skin=False, noise=noise, seed=1)
    present(robot.walker).command(WalkVelocity(forward=0.1))
    return least(rounds, {"walk": lambda: robot._simulator.physics.advance(SENSED)})["walk"] / SENSED


def print_senses(given: argparse.Namespace) -> None:
    rounds = given.rounds
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
    for _ in range(rounds):
        clock.advance(0.1)
        robot.state()  # the physics is brought up to date here
        begin = time.thread_time()
        robot.senses.read()
        reads.append(time.thread_time() - begin)
    CONSOLE.print(f"reading all senses: {min(reads) * 1e6:.0f} us after a measurement of the sonar")


def main() -> None:
    measured = {
        "physics": print_physics,
        "bodies": print_bodies,
        "world": print_one_world,
        "pictures": print_picture_rates,
        "senses": print_senses,
    }
    parts(__doc__, measured, rounds=40)


if __name__ == "__main__":
    main()
