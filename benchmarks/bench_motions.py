"""Measure the motions in the simulation's physics, in virtual time, and compare them with the requirements.

python benchmarks/bench_motions.py [--runs 10]
"""

from __future__ import annotations

import argparse
import logging
import math
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from interfaces.nao import ActionStatus
from naoserver.bodies import find_body
from naoserver.moves.routes import UPRIGHT, changes_stance, situation_of
from naoserver_sim.robot import SimulatedRobot
from tests.support.motion_rig import MOTIONS, MotionRig
from zenoh_ice import VirtualClock

CONSOLE = Console(width=110)
H25 = find_body("H25")
ON_THE_FEET = ("kick", "kick_left", "wave", "dance")


def new_rig(seed: int = 0) -> MotionRig:
    """Return a robot that has stood for a second."""
    clock = VirtualClock()
    rig = MotionRig(SimulatedRobot(clock=clock, skin=False, noise=True, seed=seed), clock)
    rig.let_go(1.0)
    return rig


def push(rig: MotionRig, degrees: float, force: float, seconds: float) -> None:
    """Push the torso in a direction, in degrees from straight ahead to the left."""
    way = math.radians(degrees)
    rig.robot.stage.push((force * math.cos(way), force * math.sin(way), 0.0), seconds)


def disturbed(posture: str, run: int) -> MotionRig:
    """Return a robot in a posture, with an error of 0.1 rad (standard deviation) in each joint."""
    rig, noise = new_rig(run), np.random.default_rng(run)
    rig.go(posture)
    joints = rig.robot.joints
    targets = {
        joint.name: float(
            np.clip(
                H25.postures[posture].angles[joint.name] + noise.normal(0.0, 0.1), joint.lower, joint.upper
            )
        )
        for joint in joints
    }
    rig.robot.command_positions(targets, {joint.name: 0.2 * joint.max_velocity for joint in joints})
    rig.let_go(1.5)
    return rig


def getting_up(posture: str, runs: int) -> tuple[str, ...]:
    """Count how often it stands, or sits, after playing the motion that gets up from a posture once."""
    ways = (motion for motion in MOTIONS.values() if motion.start == posture and changes_stance(H25, motion))
    motion = next(way for way in ways if H25.postures[way.end].stance in UPRIGHT)
    done = 0
    for run in range(runs):
        rig = disturbed(posture, run)
        if rig.stance == H25.postures[posture].stance:
            rig.play(motion.name)
        done += rig.stance is H25.postures[motion.end].stance
    return f"{motion.name}, each joint off by 0.1 rad", "10 of 10", f"{done} of {runs}"


def falls(runs: int) -> tuple[str, ...]:
    """Push the robot over in all directions; count how often and how fast it gets up again."""
    stands, seconds = 0, []
    for run in range(runs):
        rig = new_rig(run)
        push(rig, 360.0 * run / runs, 80.0, 0.15)
        rig.let_go(3.0)
        begun = rig.clock.now()
        if rig.go("Stand").status is ActionStatus.Done:
            stands += 1
            seconds.append(rig.clock.now() - begun)
    measured = f"{stands} of {runs}, in {statistics.median(seconds):.0f} s (at most {max(seconds):.0f} s)"
    return "goToPosture Stand, limp after a fall in any direction", "all", measured


def on_the_feet(motion: str, runs: int) -> tuple[str, ...]:
    """Count falls while a motion is played, with small pushes."""
    fallen, least = 0, 1.0
    for run in range(runs):
        rig = new_rig(run)
        push(rig, 360.0 * run / runs, 4.0, 0.1)
        rig.begin(motion)
        least = min(least, *(situation_of(rig.robot).up[2] for _ in playing(rig)))
        fallen += rig.player.progress("motion").status is not ActionStatus.Done
    tilt = math.degrees(math.acos(least))
    return (
        f"{motion}, pushed with 0.4 N s",
        "0 falls",
        f"{fallen} falls of {runs}, tilt at most {tilt:.0f} deg",
    )


def playing(rig: MotionRig) -> Iterator[None]:
    """Let time pass until the action ends."""
    while rig.player.busy:
        rig.let_go(0.02)
        yield


def sitting(runs: int) -> tuple[str, ...]:
    """Count how often it sits down and stands up in a row, until it fails or a motor is too hot."""
    rig, done, tilt = new_rig(), 0, 0.0
    for run in range(2 * runs):
        rig.begin_posture(("Sit", "Stand")[run % 2])
        for _ in playing(rig):
            tilt = max(tilt, rig.robot.state().torso_tilt)
        if rig.player.progress("posture").status is not ActionStatus.Done:
            break
        done += 1
    hottest = max(rig.robot.read().temperatures)
    return (
        "goToPosture Sit and Stand in a row",
        f"{runs} times",
        f"{done / 2:g} times, tilt at most {math.degrees(tilt):.0f} deg, {hottest:.0f} degrees C",
    )


def long_dance(minutes: float) -> tuple[str, ...]:
    """Dance for some minutes."""
    rig = new_rig()
    while rig.clock.now() < minutes * 60.0 and rig.play("dance").status is ActionStatus.Done:
        pass
    return (
        f"dance repeatedly for {minutes:g} min",
        "no fall",
        f"{rig.clock.now() / 60.0:.1f} min, {rig.stance}",
    )


def cost() -> tuple[str, ...]:
    """Measure the processor time of the player while the robot dances."""
    rig = new_rig()
    rig.begin("dance")
    seconds = []
    while rig.player.busy:
        rig.clock.advance(0.02)
        rig.robot.read()
        begun = time.perf_counter()
        rig.player.tick()
        seconds.append(time.perf_counter() - begun)
    microseconds = statistics.median(seconds) * 1e6
    return (
        "the player's cost per tick, 50 ticks per second",
        "-",
        f"{microseconds:.0f} us, {microseconds * 50 / 1e4:.1f} % of a core",
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=10)
    runs = parser.parse_args().runs
    logging.disable(logging.WARNING)
    measures: list[Callable[[], tuple[str, ...]]] = [
        lambda: getting_up("LyingBelly", runs),
        lambda: getting_up("LyingBack", runs),
        lambda: getting_up("Sit", runs),
        lambda: falls(2 * runs),
        lambda: sitting(2 * runs),
        *(lambda motion=motion: on_the_feet(motion, runs) for motion in ON_THE_FEET),
        lambda: long_dance(10.0),
        cost,
    ]
    table = Table("motion", "required", "measured", title="Motions, in virtual time, with noise")
    for measure in measures:
        table.add_row(*measure())
    CONSOLE.print(table)


if __name__ == "__main__":
    main()
