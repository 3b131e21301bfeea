"""The physics of failures: where a joint really is, by where the head looks and where the trunk stands."""

import math

import numpy as np
import pytest

from naoserver.bodies.capabilities import WalkVelocity
from naoserver_sim.named_body import named_body
from naoserver_sim.robot import SimulatedRobot
from tests.support.models import FOLDER
from tests.support.plugins import OWN_ROBOTS
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

G = 9.81
USERS = ("humanoid", "gripper_arm", "quadruped")
"""Models of robots that users bring."""


@pytest.fixture
def made():
    """Return a function that makes a robot that has stood for a second, and its clock."""
    robots = []

    def make(body="H25", posture="StandInit", **options):
        clock = VirtualClock()
        robots.append(
            SimulatedRobot(clock=clock, body=named_body(body), posture=posture, skin=False, **options)
        )
        robots[-1].start()
        clock.advance(1.0)
        return robots[-1], clock

    yield make
    for robot in robots:
        robot.close()


def read(robot, joint):
    return robot.read().positions[robot.body.joint_names.index(joint)]


def pan(robot):
    """Where the head really points, from where the trunk does, in rad."""
    _, axes = robot.camera_pose("Camera")
    ahead = -axes[:, 2]
    heading = robot.stage.truth().torso.heading
    return math.remainder(math.atan2(ahead[1], ahead[0]) - heading, math.tau)


def turn(robot, clock, to=0.6, seconds=1.0):
    robot.command_positions({"HeadYaw": to}, {"HeadYaw": 8.0})
    clock.advance(seconds)


# -- motors, gears and encoders ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "amount", "really", "reported"),
    [
        ("stuck", None, 0.0, 0.0),
        ("limp", None, 0.0, 0.0),
        ("weak", 0.05, 0.0, 0.0),
        ("slow", 0.02, 0.16, 0.16),
        ("backlash", 0.2, 0.5, 0.5),
        ("offset", 0.1, 0.5, 0.6),
        ("hot", 100.0, 0.0, 0.0),
    ],
)
def test_a_head_that_is_turned_by_a_joint_that_fails(made, kind, amount, really, reported):
    robot, clock = made()
    robot.faults.inject("HeadYaw", kind, amount)
    turn(robot, clock)
    assert pan(robot) == pytest.approx(really, abs=0.02)
    assert read(robot, "HeadYaw") == pytest.approx(reported, abs=0.02)


@pytest.mark.parametrize("kind", ["stuck", "limp", "weak", "slow", "backlash", "offset", "noisy", "frozen"])
def test_a_joint_that_is_healed_goes_where_it_was_told(made, kind):
    robot, clock = made()
    robot.faults.inject("HeadYaw", kind)
    turn(robot, clock)
    robot.faults.heal()
    clock.advance(1.5)
    assert (pan(robot), read(robot, "HeadYaw")) == pytest.approx((0.6, 0.6), abs=0.02)


def test_a_servo_runs_away_while_its_encoder_is_frozen(made):
    robot, clock = made()
    robot.faults.inject("HeadYaw", "frozen")
    turn(robot, clock)
    assert read(robot, "HeadYaw") == pytest.approx(0.0, abs=0.01)
    assert pan(robot) > 1.5


def test_a_noisy_encoder_scatters_what_is_reported_and_shakes_the_head(made):
    robot, clock = made()
    robot.faults.inject("HeadYaw", "noisy", 0.05)
    found = []
    for _ in range(100):
        clock.advance(0.01)
        found.append((read(robot, "HeadYaw"), pan(robot)))
    reported, really = np.std(found, axis=0)
    assert reported > 0.04
    assert 0.002 < really < reported


def test_a_motor_that_pushes_against_a_stuck_joint_gets_warm(made):
    robot, clock = made()
    index = robot.body.joint_names.index("HeadYaw")
    robot.faults.inject("HeadYaw", "stuck")
    turn(robot, clock)
    pushing = robot.read()
    assert pushing.torques[index] > 1.0
    clock.advance(1.0)
    assert robot.read().temperatures[index] > pushing.temperatures[index]


def test_a_hot_motor_stays_hot_for_a_while_once_healed(made):
    robot, clock = made()
    index = robot.body.joint_names.index("HeadYaw")
    robot.faults.inject("HeadYaw", "hot", 95.0)
    clock.advance(0.5)
    robot.faults.heal()
    clock.advance(0.5)
    assert robot.read().temperatures[index] == pytest.approx(95.0, abs=0.5)


def test_a_stuck_knee_bears_the_robot(made):
    robot, clock = made()
    robot.faults.inject("LKneePitch", "stuck")
    robot.faults.inject("RKneePitch", "stuck")
    before = read(robot, "LKneePitch")
    knees = {"LKneePitch": 0.0, "RKneePitch": 0.0}
    robot.command_stiffnesses(knees, 0.1)
    clock.advance(2.0)
    assert read(robot, "LKneePitch") == pytest.approx(before, abs=0.02)
    assert not robot.state().fallen


def test_a_robot_that_is_put_elsewhere_sticks_there_as_it_began(made):
    robot, clock = made()
    turn(robot, clock)
    robot.faults.inject("HeadYaw", "stuck")
    clock.advance(0.1)
    robot.stage.place_robot(0.5, 0.0, 0.0)
    clock.advance(1.0)
    assert read(robot, "HeadYaw") == pytest.approx(0.0, abs=0.01)
    assert not robot.state().fallen


# -- the trunk --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("body", ["H25", "T1", "G1"])
def test_a_robot_that_is_held_does_not_fall_with_limp_legs(made, body):
    robot, clock = made(body)
    before = robot.stage.truth().torso
    robot.faults.inject("Robot", "held")
    robot.command_stiffnesses(dict.fromkeys(robot.body.joint_names, 0.0), 0.1)
    clock.advance(3.0)
    now = robot.stage.truth().torso
    assert now.position == pytest.approx(before.position, abs=0.06)
    robot.faults.heal()
    clock.advance(3.0)
    assert robot.stage.truth().torso.position[2] < before.position[2] - 0.1


def test_a_load_presses_on_the_soles(made):
    robot, clock = made()

    def pressed():
        reading = robot.senses.read()
        return reading.left_foot.total + reading.right_foot.total

    before = pressed()
    robot.faults.inject("torso", "loaded", 1.0)
    clock.advance(2.0)
    assert pressed() - before == pytest.approx(1.0 * G, rel=0.05)
    robot.faults.heal()
    clock.advance(2.0)
    assert pressed() == pytest.approx(before, rel=0.02)


# -- senses -----------------------------------------------------------------------------------------------------


def test_dead_soles_do_not_bear_the_robot_for_its_controllers(made):
    robot, clock = made()
    robot.faults.inject("FootPressure", "dead")
    clock.advance(0.1)
    assert robot.senses.read().left_foot.total == 0.0
    with pytest.raises(Exception, match="it does not stand on its feet"):
        robot.walker.command(WalkVelocity(0.1, 0.0, 0.0))


def test_stuck_soles_feel_what_they_felt(made):
    robot, clock = made()
    robot.faults.inject("FootPressure", "stuck")
    clock.advance(0.1)
    before = robot.senses.read().left_foot
    robot.faults.inject("Robot", "held")
    robot.command_positions({"LKneePitch": 1.5, "RKneePitch": 1.5}, {"LKneePitch": 2.0, "RKneePitch": 2.0})
    clock.advance(1.0)
    assert robot.senses.read().left_foot == before


def test_a_fall_is_not_noticed_with_a_dead_inertial_unit(made):
    robot, clock = made()
    robot.faults.inject("InertialUnit", "dead")
    robot.stage.push((0.0, 100.0, 0.0), 0.3)
    clock.advance(2.0)
    assert robot.state().fallen
    assert robot.senses.falls.falls == 0


# -- all of it ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "body",
    [
        "H25",
        "T1",
        "G1",
        "Cart",
        *(pytest.param(FOLDER / f"{name}.urdf", id=name, marks=OWN_ROBOTS) for name in USERS),
    ],
)
def test_each_part_of_a_body_fails_in_each_way_and_nothing_breaks(made, body):
    robot, clock = made(body, posture=None)
    robot.faults.restart = lambda: None
    for part, kinds in robot.faults.kinds.items():
        for kind in kinds:
            robot.faults.inject(part, kind.name, seconds=0.02)
        clock.advance(0.03)
    robot.faults.heal()
    assert np.isfinite(robot.read().positions).all()
    assert math.isfinite(robot.stage.truth().torso.position[2])
