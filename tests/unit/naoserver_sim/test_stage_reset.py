"""A robot that a person puts back to its start, or elsewhere, stands there, whatever it was doing."""

from __future__ import annotations

import cmath
import math
from dataclasses import asdict
from itertools import product

import pytest

from interfaces.nao import JointCommand
from naoserver.bodies import find_body
from naoserver.bodies.capabilities import Support, WalkVelocity
from naoserver.moves.joint_paths import Path, smooth_curve
from naoserver.moves.walk import way_to
from naoserver.serving.lasting_walk import LastingWalk
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.motion_rig import MotionRig
from tests.support.soak import cases
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

UPRIGHT = math.radians(10)
STANDS = 6.0
"""Robot seconds for which it has to stand."""
STEP = 0.1
NEAR = 0.06
"""Distance in m and rad from there within which it may come to rest: sensors with noise make it step."""
AHEAD = WalkVelocity(forward=0.15)
PLACE = (0.6, -0.4, 2.0)
"""Where it is put: x and y in m, and its heading in rad."""


class Robot(MotionRig):
    """A robot that stands in an empty world."""

    def __init__(self, body: str, *, noise: bool = False) -> None:
        clock = VirtualClock()
        facts, world = find_body(body), load_world("empty")
        super().__init__(SimulatedRobot(clock=clock, body=facts, world=world, skin=False, noise=noise), clock)
        self.walk = LastingWalk(self.assembly)
        self.live(1.0)

    def live(self, seconds, renew=lambda: None):
        for _ in range(round(seconds / STEP)):
            renew()
            self.walk.renew()
            for watched in self.assembly.watched:
                watched.watch()
            self.let_go(STEP)

    def push_over(self, seconds):
        weight = 9.81 * self.robot.body.mass
        self.robot.stage.push((0.3 * weight, 1.2 * weight, 0.0), 0.3)
        self.live(seconds)

    def arms(self):
        body = self.robot.body
        return [joint for joint in body.joint_names if joint not in body.groups.legs][2:6]


def rest(robot):
    pass


def crouch(robot):
    robot.go("Crouch")


def go_into_a_crouch(robot):
    robot.begin_posture("Crouch")
    robot.live(1.0)


def rise_from_a_crouch(robot):
    robot.go("Crouch")
    robot.begin_posture("Stand")
    robot.live(0.5)


def play(robot):
    robot.begin("kick" if robot.robot.body.walk else "wave")
    robot.live(1.2)


def walk_as_a_program_says(robot):
    robot.walk.go(AHEAD, "a")
    robot.live(2.25)


def walk_to_a_place(robot):
    walk_to = robot.assembly.walk_to
    limits = walk_to.guard.limits
    walk_to.begin(way_to((2.0, 1.0, 1.0), walk_to.guard.read(), limits, walk_to.guard.lag), "a")
    robot.live(2.0)


def walk_by_velocities(robot):
    robot.live(2.0, lambda: robot.assembly.walk.drive(asdict(AHEAD), "a"))


def fall(robot):
    robot.push_over(0.6)


def lie(robot):
    robot.push_over(4.0)


def let_the_motors_go(robot):
    body = robot.assembly.body
    body.stiffen({joint.name: 0.0 for joint in body.joints}, 0.1)
    robot.live(2.0)


def stop_in_a_crouch(robot):
    robot.go("Crouch")
    robot.assembly.gate.stop("a test")
    robot.live(0.5)


def stop_in_a_walk(robot):
    walk_as_a_program_says(robot)
    robot.assembly.gate.stop("a test")


def follow_a_path(robot):
    joints = robot.arms()
    start = robot.commands()
    curves = {joint: smooth_curve(joint, start[joint], [3.0], [start[joint] + 0.5]) for joint in joints}
    robot.assembly.paths.start(Path("a path", frozenset(joints), "a"), curves)
    robot.live(1.0)


def drive_a_joint(robot):
    robot.assembly.body.drive(dict.fromkeys(robot.arms()[:1], 0.5), client="a")
    robot.live(0.3)


def balance_on_one_leg(robot):
    robot.robot.balancer.command(Support.LEFT)
    robot.live(1.0)


def follow_gains(robot):
    reading, body = robot.robot.read(), robot.assembly.body
    held = {
        joint: JointCommand(position=reading.positions[body.index(joint)] + 0.1, kp=400.0, kd=8.0)
        for joint in robot.robot.body.groups.legs
    }
    robot.live(0.5, lambda: robot.assembly.gains.command(held, "a"))


def put_back(robot):
    robot.assembly.servants["Scene"].reset(None)
    return 0.0, 0.0, 0.0


def put_elsewhere(robot):
    robot.assembly.servants["Scene"].placeRobot(*PLACE, None)
    return PLACE


NAOS = ("H25", "H21")
HUMANOIDS = ("T1", "G1")
ANYTHING = (
    rest, fall, lie, let_the_motors_go, walk_as_a_program_says, walk_to_a_place, walk_by_velocities, crouch,
    go_into_a_crouch, rise_from_a_crouch, play, stop_in_a_crouch, stop_in_a_walk, follow_a_path, drive_a_joint,
)  # fmt: skip
ON_WHEELS = rest, walk_as_a_program_says, walk_to_a_place, walk_by_velocities, stop_in_a_walk
QUICK = [
    ("G1", crouch, put_back, False),
    ("T1", crouch, put_elsewhere, False),
    ("G1", fall, put_back, False),
    ("T1", stop_in_a_walk, put_back, False),
    ("T1", follow_gains, put_elsewhere, False),
    ("H25", stop_in_a_crouch, put_back, False),
    ("H25", balance_on_one_leg, put_back, False),
    ("Cart", walk_to_a_place, put_elsewhere, False),
]
"""A body, what it is doing when it is put somewhere, how it is put, and whether its sensors have noise."""
DOINGS = [
    *product((*NAOS, *HUMANOIDS), ANYTHING),
    *product(NAOS, [balance_on_one_leg]),
    *product(HUMANOIDS, [follow_gains]),
    *product(["Cart"], ON_WHEELS),
]
EVERY = [
    (*doing, put, noise) for doing, put, noise in product(DOINGS, (put_back, put_elsewhere), (False, True))
]
REST = [pytest.param(*case) for case in EVERY if case not in QUICK]


@pytest.mark.parametrize(
    ("body", "doing", "put", "noise"),
    cases(QUICK, REST),
    ids=lambda value: {True: "noise", False: "exact"}.get(value) or getattr(value, "__name__", value),
)
def test_it_stands_where_it_is_put_whatever_it_was_doing(body, doing, put, noise):
    robot = Robot(body, noise=noise)
    try:
        stage, gate = robot.robot.stage, robot.assembly.gate
        start = stage.truth().torso
        doing(robot)
        stopped = gate.state().stopped
        x, y, heading = put(robot)
        place = complex(x, y) + complex(*start.position[:2]) * cmath.rect(1.0, heading)
        for _ in range(round(STANDS / STEP)):
            robot.live(STEP)
            assert robot.robot.state().torso_tilt < UPRIGHT
        torso = stage.truth().torso
        assert abs(complex(*torso.position[:2]) - place) < NEAR
        assert abs(torso.position[2] - start.position[2]) < NEAR
        assert abs(math.remainder(torso.heading - heading, math.tau)) < NEAR
        assert set(robot.robot.read().stiffnesses) == {1.0}
        assert gate.state().stopped == stopped
    finally:
        robot.robot.close()


def test_a_robot_that_is_put_back_balances_over_no_foot():
    robot = Robot("H25")
    try:
        balance_on_one_leg(robot)
        put_back(robot)
        robot.live(0.1)
        assert robot.robot.balancer.support() is None
    finally:
        robot.robot.close()


def test_a_joint_does_not_go_where_it_was_to_be_before():
    robot = Robot("H25")
    try:
        robot.assembly.body.move({"HeadPitch": 0.5}, {"HeadPitch": 5.0})
        robot.live(1.0)
        put_back(robot)
        robot.live(0.5)
        # The shoulders are in the way of a head that is turned and lowered, which this one is no more.
        robot.assembly.body.move({"HeadYaw": 0.9}, {"HeadYaw": 5.0})
        robot.live(1.0)
        assert robot.commands()["HeadPitch"] == 0.0
    finally:
        robot.robot.close()
