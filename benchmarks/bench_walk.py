"""Measure walk, balance and motions of simulated robots, and print the figures with the requirements.

Everything runs in virtual time, with noise in every sense. `walks`: velocities, odometry, falls, and the
largest pushes that a robot withstands, of a Nao and of the bodies that walk by footsteps. `standing`: a Nao
that looks round and dances, and its walks to places near by. `motions`: getting up, sitting down, kicking.

    python benchmarks/bench_walk.py [--bodies H25,T1,G1] [--runs 30] [--moments 6] [PART...]
"""

from __future__ import annotations

import argparse
import cmath
import logging
import math
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass
from typing import Any, Final

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.common import parts
from hfsm_runtime.virtual.clock import TaskClock
from hfsm_runtime.virtual.network import VirtualNetwork
from interfaces.nao import ActionStatus, WalkPrx
from naoserver.bodies import find_body
from naoserver.bodies.capabilities import STILL, Odometry, WalkVelocity
from naoserver.errors import InvalidCommand
from naoserver.moves.routes import UPRIGHT, changes_stance, situation_of
from naoserver_sim._walk.walker import LIMITS
from naoserver_sim.robot import SimulatedRobot
from tests.support.humanoids import Humanoid, Noise
from tests.support.motion_rig import MOTIONS, MotionRig
from tests.support.present import present
from tests.support.walking import mean_velocity
from visualhfsm.simulation._robot import RobotUnderTest
from zenoh_ice import VirtualClock

Place = tuple[float, float, float]
"""On the floor, in m, and the heading in rad."""

CONSOLE = Console(width=110)
PUSH_SECONDS: Final = 0.1
MINUTE: Final = 60.0
COURSE: Final = (
    (10.0, WalkVelocity(forward=0.3)),
    (10.0, WalkVelocity(forward=0.2, turn=0.2)),
    (10.0, WalkVelocity(forward=0.3)),
    (10.0, WalkVelocity(forward=0.2, turn=-0.3)),
    (5.0, WalkVelocity(turn=0.4)),
    (15.0, WalkVelocity(forward=0.3)),
    (4.0, STILL),
)
"""Seconds, and the velocity: a minute at 0.3 m/s with turns, and the end."""


class Nao:
    """A Nao with noisy senses that has stood for two seconds."""

    def __init__(self, seed: int) -> None:
        self.clock = VirtualClock()
        self.robot = SimulatedRobot(clock=self.clock, skin=False, noise=True, seed=seed)
        self.walker = present(self.robot.walker)
        self.speeds = {joint.name: joint.max_velocity for joint in self.robot.joints}
        self.go(2.0)

    def go(self, seconds: float) -> None:
        """Let time pass."""
        self.clock.advance(seconds)
        self.robot.read()

    def walk(self, velocity: WalkVelocity, seconds: float = 0.0) -> None:
        """Command a velocity and let time pass."""
        self.walker.command(velocity)
        self.go(seconds)

    def push(self, x: float, y: float, seconds: float) -> None:
        """Push the torso with a force in N."""
        self.robot.stage.push((x, y, 0.0), seconds)

    @property
    def fallen(self) -> bool:
        """Whether the robot lies."""
        return self.robot.state().fallen

    def place(self) -> Place:
        """Return where the robot truly is."""
        torso = self.robot.stage.truth().torso
        return torso.position[0], torso.position[1], torso.heading


def humanoid(body: str, seed: int) -> Humanoid:
    """Return a humanoid with noise that has stood for a second."""
    robot = Humanoid(body, seed=seed, noise=Noise())
    robot.go(1.0)
    return robot


@dataclass(frozen=True)
class Walks:
    """What is measured of the walks of a body."""

    stand: Callable[[int], Nao | Humanoid]
    """Returns one that stands, with the noise of a seed."""
    velocities: tuple[WalkVelocity, ...]
    programme: Callable[[int], Sequence[tuple[float, WalkVelocity]]]
    """Returns seconds and velocities of a minute's walk, by the seed."""
    directions: int
    """From which it is pushed."""
    two_steps: float
    """Seconds."""
    strongest: float
    """N s: more than any push that it withstands."""
    within: float
    """N s."""


def at_random(seed: int) -> list[tuple[float, WalkVelocity]]:
    """Return random velocities of the full range, with a new one every 3 s."""
    random, most = np.random.default_rng(seed), astuple(LIMITS)
    return [
        (3.0, WalkVelocity(*(random.uniform(-1.0, 1.0, 3) * most * (random.random() > 0.1)).tolist()))
        for _ in range(20)
    ]


def of_footsteps(name: str) -> Walks:
    """Return what is measured of a body that walks by footsteps."""
    folder = {"T1": "booster_t1", "G1": "unitree_g1"}[name]
    limits = humanoid(folder, 0).footsteps.limits
    velocities = (
        *(WalkVelocity(forward=speed) for speed in (0.3, limits.forward, -0.2)),
        *(WalkVelocity(left=speed) for speed in (0.5 * limits.left, limits.left, -limits.left)),
        WalkVelocity(turn=limits.turn),
        WalkVelocity(0.2, 0.02, 0.15),
    )
    return Walks(lambda seed: humanoid(folder, seed), velocities, lambda _: COURSE, 4, 0.9, 40.0, 1.0)


def of_the_nao() -> Walks:
    """Return what is measured of a Nao."""
    velocities = (
        *(WalkVelocity(forward=speed) for speed in (0.1, 0.2, 0.25, LIMITS.forward, -0.25)),
        *(WalkVelocity(left=speed) for speed in (0.05, 0.1, LIMITS.left, -0.1)),
        *(WalkVelocity(turn=speed) for speed in (0.4, 0.8, LIMITS.turn, -0.8)),
        WalkVelocity(0.2, 0.05, 0.4),
    )
    return Walks(Nao, velocities, at_random, 8, 0.51, 8.0, 0.1)


def print_speeds(walks: Walks) -> None:
    table = Table("commanded: m/s forward, m/s left, rad/s", "reached", "off (required: 15 %)")
    for velocity in walks.velocities:
        robot = walks.stand(0)
        robot.walk(velocity, 4.0)
        found = mean_velocity(robot.place, robot.go, 9.0, 0.05)
        wanted = astuple(velocity)
        off = [abs(is_ / asked - 1.0) for is_, asked in zip(found, wanted, strict=True) if asked]
        table.add_row(
            ", ".join(f"{value:g}" for value in wanted),
            ", ".join(f"{value:.3f}" for value in found),
            "fell" if robot.fallen else ", ".join(f"{part * 100:.1f} %" for part in off),
        )
    CONSOLE.print("velocities", table)


def error_of(begin: Place, odometry: Odometry, end: Place, believed: Odometry) -> tuple[float, float]:
    """Return by how many m and rad an odometry is off after a way."""
    turn = begin[2] - odometry.heading
    way = complex(believed.x - odometry.x, believed.y - odometry.y) * cmath.rect(1.0, turn)
    missed = abs(way - complex(end[0] - begin[0], end[1] - begin[1]))
    return missed, abs(math.remainder(believed.heading + turn - end[2], math.tau))


def print_drift(walks: Walks, runs: int = 10) -> None:
    drifts, errors, turns = [], [], []
    for seed in range(runs):
        robot, way = walks.stand(seed), 0.0
        begin, odometry = robot.place(), robot.walker.odometry()
        robot.walk(WalkVelocity(forward=0.25))
        while way < 3.0:
            robot.go(0.1)
            end = robot.place()
            moved = complex(end[0] - begin[0], end[1] - begin[1])
            way = abs(moved)
        missed, turned = error_of(begin, odometry, end, robot.walker.odometry())
        drifts.append(abs((moved * cmath.rect(1.0, -begin[2])).imag))
        errors.append(100 * missed / way)
        turns.append(math.degrees(turned))
    CONSOLE.print(
        f"3 m straight, {runs} times: drift {statistics.mean(drifts):.2f} m, at most {max(drifts):.2f} m"
        f" (required: 0.3); odometry off by {statistics.mean(errors):.1f} %, at most {max(errors):.1f} %"
        f" (required: 10); heading by at most {max(turns):.1f} deg\n"
    )


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
    pace: float
    """Times real time, by processor time."""


def walk_a_minute(walks: Walks, seed: int) -> Walked:
    """Walk a programme."""
    robot, way, seconds = walks.stand(seed), 0.0, 0.0
    begin, odometry = robot.place(), robot.walker.odometry()
    before, started = begin, time.process_time()
    for duration, velocity in walks.programme(seed):
        try:
            robot.walker.command(velocity)
        except InvalidCommand:
            break
        for _ in range(round(duration / 0.5)):
            robot.go(0.5)
            now = robot.place()
            way += math.dist(now[:2], before[:2])
            before = now
        seconds += duration
    pace = seconds / (time.process_time() - started)
    return Walked(robot.fallen, way, *error_of(begin, odometry, robot.place(), robot.walker.odometry()), pace)


def print_minutes(walks: Walks, runs: int) -> None:
    walked = [walk_a_minute(walks, seed) for seed in range(runs)]
    upright = [each for each in walked if not each.fell]
    falls = [str(seed) for seed, each in enumerate(walked) if each.fell]
    errors = [100 * each.missed / each.way for each in upright]
    CONSOLE.print(
        f"{runs} walks of a minute: {len(falls)} falls {', '.join(falls)}\n"
        f"odometry off by {statistics.mean(errors):.1f} % of the way, {max(errors):.1f} % at most,"
        f" its heading by {math.degrees(max(each.turned for each in upright)):.1f} deg at most\n"
        f"physics, senses and walk: {statistics.median(each.pace for each in upright):.0f} times real time on"
        f" one core (required of a Nao: 30)\n"
    )


def withstands(walks: Walks, velocity: WalkVelocity, angle: float, impulse: float, delay: float) -> bool:
    """Return whether the robot still stands or walks some seconds after a push at the trunk."""
    robot = walks.stand(0)
    if velocity != STILL:
        robot.walk(velocity, 2.3)
    robot.go(delay)
    force = cmath.rect(impulse / PUSH_SECONDS, robot.place()[2] + angle)
    robot.push(force.real, force.imag, PUSH_SECONDS)
    for _ in range(16):
        robot.go(0.25)
        if robot.fallen:
            return False
    return True


def largest_push(walks: Walks, velocity: WalkVelocity, angle: float, moments: int) -> float:
    """Return the largest impulse in N s that it withstands at each of some moments."""
    smallest = walks.strongest
    for moment in range(moments):
        delay = walks.two_steps * moment / moments
        if moment and withstands(walks, velocity, angle, smallest, delay):
            continue
        low, high = 0.0, smallest
        while high - low > walks.within:
            middle = 0.5 * (low + high)
            if withstands(walks, velocity, angle, middle, delay):
                low = middle
            else:
                high = middle
        smallest = low
    return smallest


def print_pushes(walks: Walks, moments: int) -> None:
    table = Table("N s at the trunk, degrees to the left", "standing", "walking 0.2 m/s forward")
    for number in range(walks.directions):
        angle = math.tau * number / walks.directions
        still = largest_push(walks, STILL, angle, 1)
        walking = largest_push(walks, WalkVelocity(forward=0.2), angle, moments)
        table.add_row(f"{math.degrees(angle):.0f}", f"{still:.1f}", f"{walking:.1f}")
    CONSOLE.print(f"largest push of {PUSH_SECONDS:g} s that it withstands", table)


def print_walks(given: argparse.Namespace) -> None:
    for name in given.bodies.split(","):
        walks = of_the_nao() if name == "H25" else of_footsteps(name)
        CONSOLE.print(f"[bold]{name}")
        print_speeds(walks)
        print_drift(walks)
        print_minutes(walks, given.runs)
        print_pushes(walks, given.moments)


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


def print_balance(minutes: float) -> None:
    def nothing(run: Nao, number: int) -> None:
        """Leave the robot alone."""

    def look_round(run: Nao, number: int) -> None:
        side = 1.0 if number % 2 else -1.0
        speeds = {name: run.speeds[name] for name in ("HeadYaw", "HeadPitch")}
        run.robot.command_positions({"HeadYaw": side * 2.0, "HeadPitch": side * 0.4}, speeds)

    def dance(run: Nao, number: int) -> None:
        poses = ((-1.4, 0.2, -0.1, 1.0), (1.4, 0.2, -1.4, -1.0), (0.0, 1.2, -0.1, 0.0), (0.0, 0.1, -1.0, 0.5))
        pitch, roll, elbow, yaw = poses[number % len(poses)]
        targets = {"HeadYaw": yaw}
        for side, sign in (("L", 1.0), ("R", -1.0)):
            targets[f"{side}ShoulderPitch"] = pitch
            targets[f"{side}ShoulderRoll"] = sign * roll
            targets[f"{side}ElbowRoll"] = sign * elbow
        speeds = run.speeds
        run.robot.command_positions(targets, {name: speeds[name] for name in targets})

    table = Table("standing", "falls (required: 0)", "worst tilt")
    rows: Sequence[tuple[str, Callable[[Nao, int], None], float]] = (
        ("still", nothing, 1.0),
        ("head at full speed", look_round, 0.7),
        ("dance, both arms at full speed", dance, 1.2),
    )
    for name, act, pause in rows:
        run, worst = Nao(0), 0.0
        for number in range(round(minutes * 60.0 / pause)):
            act(run, number)
            for _ in range(4):
                run.go(pause / 4)
                worst = max(worst, run.robot.state().torso_tilt)
        table.add_row(
            f"{minutes:g} min, {name}", "1" if run.fallen else "0", f"{math.degrees(worst):.1f} deg"
        )
    CONSOLE.print(table)


def print_standing(given: argparse.Namespace) -> None:
    print_places(given.robots)
    print_balance(given.minutes)


# Motions


H25 = find_body("H25")
ON_THE_FEET = ("kick", "kick_left", "wave", "dance")


def new_rig(seed: int = 0) -> MotionRig:
    """Return a robot that has stood for a second."""
    clock = VirtualClock()
    rig = MotionRig(SimulatedRobot(clock=clock, skin=False, noise=True, seed=seed), clock)
    rig.let_go(1.0)
    return rig


def push_rig(rig: MotionRig, degrees: float, force: float, seconds: float) -> None:
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
        push_rig(rig, 360.0 * run / runs, 80.0, 0.15)
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
        push_rig(rig, 360.0 * run / runs, 4.0, 0.1)
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


def print_motions(given: argparse.Namespace) -> None:
    runs = given.repetitions
    measures: list[Callable[[], tuple[str, ...]]] = [
        *(
            lambda posture=posture: getting_up(posture, runs)
            for posture in ("LyingBelly", "LyingBack", "Sit")
        ),
        lambda: falls(2 * runs),
        lambda: sitting(2 * runs),
        *(lambda motion=motion: on_the_feet(motion, runs) for motion in ON_THE_FEET),
        lambda: long_dance(given.minutes),
        cost,
    ]
    table = Table("motion", "required", "measured", title="Motions")
    for measure in measures:
        table.add_row(*measure())
    CONSOLE.print(table)


def main() -> None:
    logging.disable(logging.WARNING)  # falls are part of the figures
    measured = {"walks": print_walks, "standing": print_standing, "motions": print_motions}
    parts(
        __doc__,
        measured,
        bodies="H25,T1,G1",
        runs=30,
        moments=6,
        robots=8,
        minutes=10.0,
        repetitions=10,
    )


if __name__ == "__main__":
    main()
