"""Setpoints."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import pytest

from interfaces.nao import JointsPrx
from naoserver.bodies.capabilities import JointCommand
from naoserver.bodies.parts import Joint
from naoserver.conformance._robot import (
    COUPLING,
    GAINS,
    JOINT,
    ROOM,
    RobotClient,
    free_joints,
    needs,
    slowly,
    speed_of,
    step_of,
    target_of,
    tolerance_of,
)
from naoserver.protocol.robot import LIMP, JointReading

WHILE = 0.3
"""Robot seconds after which a command has certainly taken effect."""


class Look(NamedTuple):
    """A setpoint, and between which robot times it was there.

    What a reading measured may be older than its setpoints, which are those of now, and so may be its time.
    """

    earliest: float
    latest: float
    setpoint: float


@dataclass
class Moved:
    """The joint that tests move, which carries least, and where its setpoint is when a test begins."""

    nao: RobotClient
    joint: Joint

    def __post_init__(self) -> None:
        self.name = self.joint.name
        self.robot = self.nao.robot
        self.place = [joint.name for joint in self.robot.joints].index(self.name)
        self.start = self.setpoint(self.robot.read())
        self.target = target_of(self.joint, self.start)
        self.speed = speed_of(self.joint)
        self.tolerance = tolerance_of(self.joint)

    def setpoint(self, reading: JointReading) -> float:
        return reading.commands[self.place]

    def position(self, reading: JointReading) -> float:
        return reading.positions[self.place]

    def go(self, target: float, speed: float) -> None:
        self.robot.command_positions({self.name: target}, {self.name: speed})

    def drive(self, velocity: float) -> None:
        self.robot.command_velocities({self.name: velocity})

    def pull(self, target: float) -> None:
        """Pull it to a target as strongly as its gear does."""
        assert self.robot.gains is not None
        gear, ends = self.robot.body.gears[self.joint.gear], (self.joint.lower, self.joint.upper)
        command = JointCommand(target, 0.0, 0.0, gear.stiffness, gear.damping, *ends, self.speed)
        self.robot.gains.command_gains({self.name: command})

    def stiffen(self, stiffness: float) -> None:
        self.robot.command_stiffnesses({self.name: stiffness}, 0.1)
        self.nao.readings(
            lambda reading: abs(reading.stiffnesses[self.place] - stiffness) < LIMP,
            f"{self.name} is as stiff as commanded, {stiffness:g}, after 0.1 s",
        )

    def look(self) -> Look:
        reading = self.robot.read()
        return Look(reading.time, self.robot.clock.now(), self.setpoint(reading))

    def course(self, done: Callable[[float], object], promise: str) -> list[Look]:
        """Return looks at its setpoint from now to the first that is `done`."""
        seen = []

        def seen_to_be_done() -> object:
            seen.append(self.look())
            return done(seen[-1].setpoint)

        self.nao.until(seen_to_be_done, promise)
        return seen

    def arrives(self, target: float, promise: str) -> list[Look]:
        return self.course(lambda setpoint: abs(setpoint - target) < 1e-3, promise)

    def drift(self, seconds: float) -> float:
        """Return how far its setpoint moves within some robot seconds, once a command has taken effect."""
        self.nao.watched(WHILE)
        setpoints = [self.setpoint(reading) for reading in self.nao.watched(seconds)]
        return max(setpoints) - min(setpoints)

    def ahead(self, looks: list[Look], speed: float) -> float:
        """Return by how much its setpoint was ahead of a speed, between any two looks."""
        most = 0.0
        for sign in (1.0, -1.0):
            least = math.inf
            for look in looks:
                least = min(least, sign * look.setpoint - speed * look.earliest)
                most = max(most, sign * look.setpoint - speed * look.latest - least)
        return most


def moved_of(nao: RobotClient) -> Moved:
    """Return the joint of a robot that a test moves."""
    return Moved(nao, free_joints(nao.robot.body)[0])


@pytest.fixture
def moved(rest: RobotClient) -> Moved:
    """The joint that a test moves."""
    return moved_of(rest)


@needs(JOINT)
def test_a_position_command_moves_the_setpoint_no_faster_than_given(moved: Moved) -> None:
    """A position command moves the setpoint to its target at no more than the given speed."""
    before = moved.look()
    moved.go(moved.target, moved.speed)
    seen = moved.arrives(moved.target, f"the setpoint of {moved.name} comes to its target {moved.target:.3g}")
    ahead = moved.ahead([before, *seen], moved.speed)
    assert ahead < 0.2 * step_of(moved.joint), (
        f"the setpoint of {moved.name} moved faster than the given {moved.speed:.3g}/s: by {ahead:.3g} more"
    )
    moved.nao.readings(
        lambda reading: abs(moved.position(reading) - moved.target) < moved.tolerance,
        f"{moved.name} follows its setpoint to {moved.target:.3g}",
    )


@needs(JOINT)
def test_a_velocity_command_moves_the_setpoint_until_the_next(moved: Moved) -> None:
    """A velocity command moves the setpoint at that velocity until the next one; 0 holds it where it is."""
    way = moved.target - moved.start
    velocity = way / 0.8
    moved.drive(velocity)
    seen = moved.course(
        lambda setpoint: (setpoint - moved.start) / way > 0.5,
        f"the setpoint of {moved.name} moves at the commanded velocity {velocity:.3g}/s",
    )
    moved.drive(0.0)
    ahead = moved.ahead(seen, abs(velocity))
    assert ahead < 0.2 * abs(way), f"the setpoint of {moved.name} moved faster than commanded: by {ahead:.3g}"
    left = moved.drift(WHILE)
    assert left < 0.1 * abs(way), (
        f"velocity 0 does not hold the setpoint of {moved.name}: in {WHILE:g} s it moved by {left:.3g}"
    )


@needs(JOINT)
def test_the_newest_command_replaces_the_one_before(moved: Moved) -> None:
    """The newest command of a joint replaces the one before, of either kind."""
    way = moved.target - moved.start
    moved.drive(way)
    moved.go(moved.target, moved.speed)
    moved.arrives(moved.target, "a position replaces a velocity: the setpoint ends at the target")
    moved.go(moved.start, moved.speed / 20)
    moved.drive(0.0)
    assert moved.drift(1.0) < abs(way) / 50, "a velocity, 0, ends the way to a position"
    there = moved.setpoint(moved.robot.read())
    moved.go(moved.start, moved.speed)
    moved.go(there, moved.speed)
    moved.nao.watched(2 * WHILE)
    assert moved.setpoint(moved.robot.read()) == pytest.approx(there, abs=abs(way) / 5), (
        "a position replaces the position before"
    )


@needs(JOINT, GAINS)
def test_a_joint_follows_a_command_with_gains_until_the_next_one(moved: Moved) -> None:
    """A joint follows a command with gains, and its setpoint follows the joint, until the next command."""
    moved.pull(moved.target)
    moved.nao.readings(
        lambda reading: abs(moved.position(reading) - moved.target) < moved.tolerance,
        f"gains pull {moved.name} to {moved.target:.3g}",
    )
    for reading in moved.nao.watched(WHILE):
        away = abs(moved.setpoint(reading) - moved.position(reading))
        assert away < moved.tolerance, f"the setpoint of {moved.name}, pulled by gains, is {away:.3g} away"
    moved.drive(0.0)
    assert moved.drift(WHILE) < moved.tolerance, f"velocity 0 does not hold {moved.name} where gains left it"
    moved.go(moved.start, moved.speed)
    moved.arrives(moved.start, f"{moved.name} heeds positions again")


@needs(JOINT)
def test_a_limp_joint_heeds_nobody_and_does_not_jump_when_it_becomes_stiff(moved: Moved) -> None:
    """The setpoint of a limp motor follows its joint, so that nothing jumps when it becomes stiff again."""
    moved.stiffen(0.0)
    moved.nao.watched(WHILE)
    moved.go(moved.target, moved.speed)
    for reading in moved.nao.watched(2 * WHILE):
        away = abs(moved.setpoint(reading) - moved.position(reading))
        assert away < moved.tolerance, (
            f"the setpoint of {moved.name}, which is limp, is {away:.3g} away from it"
        )
    limp = moved.position(moved.robot.read())
    moved.stiffen(1.0)
    for reading in moved.nao.watched(2 * WHILE):
        jump = abs(moved.position(reading) - limp)
        assert jump < moved.tolerance, f"{moved.name} jumped by {jump:.3g} when it became stiff again"
    moved.go(moved.target, moved.speed)
    moved.arrives(moved.target, f"{moved.name} heeds commands when it is stiff again")


@needs(COUPLING, ROOM)
def test_coupled_joints_move_together(rest: RobotClient) -> None:
    """Joints that one motor drives move, stop and become limp together."""
    robot, body, pair = rest.robot, rest.proxy(JointsPrx, "Body"), rest.robot.body.couplings[0]
    leader, follower = robot.body.joint[pair.leader], robot.body.joint[pair.follower]
    left, right = (robot.body.joint_names.index(joint.name) for joint in (leader, follower))
    start = robot.read().commands
    part = start[right] + (target_of(follower, start[right]) - start[right]) / 3
    goal = body.setJointPositions({follower.name: part}, 0.05)[follower.name]
    there = rest.readings(lambda now: abs(now.commands[right] - goal) < 1e-3, f"{follower.name} moves")[-1]
    away = abs(there.commands[left] - start[left])
    assert away > 0.01, f"{follower.name} moved, and {leader.name}, which shares its motor, did not"
    body.setJointPositions({leader.name: start[left]}, slowly(robot, leader))
    rest.readings(lambda now: abs(now.commands[right] - goal) > 2e-3, f"{leader.name} moves {follower.name}")
    rest.assembly.body.hold([follower.name])
    rest.watched(WHILE)
    held, later = robot.read().commands, rest.watched(WHILE)[-1].commands
    assert abs(held[left] - start[left]) > away / 2, "who stops one of them stops both"
    assert (later[left], later[right]) == pytest.approx((held[left], held[right]), abs=1e-3), "they go on"
    body.setStiffnesses({follower.name: 0.6}, 0.0)
    rest.readings(
        lambda now: (now.stiffnesses[left], now.stiffnesses[right]) == pytest.approx((0.6, 0.6)),
        "they are as stiff as each other",
    )
