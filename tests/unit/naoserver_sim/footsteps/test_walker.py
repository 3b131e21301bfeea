"""Walk and balance of bodies that hold angles, in virtual time: a T1, and a G1 where it matters; all in a soak."""

import math
from dataclasses import astuple

import numpy as np
import pytest

from naoserver.bodies.capabilities import STILL, Walker, WalkVelocity
from naoserver.errors import InvalidCommand
from tests.support.humanoids import Humanoid, Noise
from tests.support.soak import cases, repeated
from tests.support.walking import mean_velocity

pytestmark = pytest.mark.sim

SPEED = 1.0
T1, G1 = "booster_t1", "unitree_g1"
FORWARD, BACK = WalkVelocity(forward=0.3), WalkVelocity(forward=-0.2)
LEFT, TURN = WalkVelocity(left=0.08), WalkVelocity(turn=-0.4)
ALL_AT_ONCE = WalkVelocity(0.15, 0.02, 0.15)
both_bodies = pytest.mark.parametrize("body", [T1, G1])


@pytest.fixture(params=cases([T1], [G1]))
def body(request):
    return request.param


@pytest.fixture
def robot(body):
    return Humanoid(body)


def end(robot):
    """End the walk, and wait until it has ended."""
    robot.walker.command(STILL)
    for _ in range(60):
        if not robot.walker.walking:
            return
        robot.go(0.1)
    pytest.fail("it still walks")


def bent(robot, more):
    """Return the angles of the legs with knees that are bent by more, and the trunk upright."""
    changes = {"hip_pitch": -0.5, "knee": 1.0, "ankle_pitch": -0.5}
    targets = {}
    for name in robot.leg_names:
        for part, share in changes.items():
            if part in name.lower():
                targets[name] = robot.commands(name)[0] + share * more
    return targets


def crouch(robot, more):
    """Bend the knees, within a second at the speed of the knees."""
    targets = bent(robot, more)
    for name, angle in targets.items():
        robot.move({name: angle}, abs(angle - robot.commands(name)[0]))
    robot.go(1.0)
    return targets


@both_bodies
def test_it_is_a_walker_that_stands(robot):
    robot.go(2.0)
    assert isinstance(robot.walker, Walker)
    assert not robot.walker.walking
    assert robot.walker.commanded() == STILL
    assert robot.walker.limits == robot.footsteps.limits
    assert robot.tilt < math.radians(2)
    assert robot.place() == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


@pytest.mark.parametrize(
    ("body", "velocity"),
    cases(
        [(G1, FORWARD), (T1, BACK), (G1, LEFT), (T1, TURN), (T1, ALL_AT_ONCE)],
        [
            *(pytest.param(T1, velocity) for velocity in (FORWARD, LEFT)),
            *(pytest.param(G1, velocity) for velocity in (BACK, TURN, ALL_AT_ONCE)),
        ],
    ),
)
def test_it_walks_as_fast_as_commanded_and_ends_on_both_feet(robot, velocity):
    robot.walk(velocity, 3.0)
    assert robot.walker.walking
    reached = mean_velocity(robot.place, robot.go, 2.7, 0.05)
    for value, wanted in zip(reached, astuple(velocity), strict=True):
        assert value == pytest.approx(wanted, rel=0.15, abs=0.05)
    end(robot)
    robot.go(1.0)
    before = robot.place()
    robot.go(0.5)
    assert robot.place() == pytest.approx(before, abs=0.01)
    assert robot.tilt < math.radians(5)


@pytest.mark.parametrize(("body", "force"), cases([(G1, 47.0)], [pytest.param(T1, 35.0)]))
def test_the_walk_ends_also_while_the_robot_is_pushed_again_and_again(robot, force):
    robot.walk(WalkVelocity(forward=0.2), 2.0)
    robot.walker.command(STILL)
    for push in range(60):
        robot.push(0.0, force if push % 2 else -force, 0.2)
        robot.go(0.2)
        if not robot.walker.walking:
            break
    assert not robot.walker.walking
    assert robot.tilt < math.radians(10)


def test_its_odometry_knows_where_it_has_got_to(robot):
    robot.walk(WalkVelocity(forward=0.3), 4.0)
    robot.walk(WalkVelocity(0.1, 0.03, 0.2), 4.0)
    odometry = robot.walker.odometry()
    assert (odometry.x, odometry.y, odometry.heading) == pytest.approx(robot.place(), abs=0.06)


@both_bodies
@pytest.mark.parametrize("seed", cases([0], [1, 2]))
def test_it_walks_with_noise_in_sensors_and_gears(body, seed):
    robot = Humanoid(body, seed=seed, noise=Noise())
    robot.go(1.0)
    robot.walk(WalkVelocity(forward=robot.footsteps.limits.forward), repeated(4.0, 6.0))
    robot.walk(WalkVelocity(0.2, 0.0, 0.2), repeated(2.0, 3.0))
    end(robot)
    assert not robot.fallen
    assert robot.place()[0] > 1.0


def test_the_same_commands_give_the_same_states(body):
    traces = []
    for _ in range(2):
        robot = Humanoid(body, seed=3, noise=Noise())
        robot.walk(WalkVelocity(0.2, 0.0, 0.1), 1.5)
        traces.append(robot.data.qpos.tobytes() + robot.data.qvel.tobytes())
    assert traces[0] == traces[1]


@pytest.mark.parametrize("angle", [0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi])
def test_it_stands_a_push(robot, angle):
    robot.go(0.5)
    robot.push(80.0 * math.cos(angle), 80.0 * math.sin(angle))
    robot.go(3.5)
    assert not robot.fallen
    assert not robot.walker.walking


@both_bodies
def test_it_steps_when_only_a_step_can_catch_it(robot):
    robot.go(0.5)
    robot.push(0.0, 155.0)
    robot.go(0.5)
    assert robot.walker.walking
    robot.go(4.5)
    assert not robot.walker.walking
    assert not robot.fallen


def test_it_crouches_and_rises_as_it_is_commanded(robot):
    robot.go(0.5)
    before = dict(zip(robot.leg_names, robot.commands(*robot.leg_names), strict=True))
    height = robot.data.qpos[2]
    targets = crouch(robot, 0.8)
    robot.go(1.0)
    assert robot.data.qpos[2] < height - 0.05
    # The angles are those that were commanded, and the motors bear the weight.
    assert robot.commands(*targets) == pytest.approx(list(targets.values()))
    assert robot.angles(*targets) == pytest.approx(list(targets.values()), abs=0.02)
    crouch(robot, -0.8)
    robot.go(2.0)
    assert robot.tilt < math.radians(3)
    assert robot.commands(*before) == pytest.approx(list(before.values()), abs=0.05)


def test_it_comes_out_of_a_crouch_to_walk(robot):
    robot.go(0.5)
    crouch(robot, 0.6)
    robot.walk(WalkVelocity(forward=0.3), 4.0)
    assert robot.place()[0] > 0.4
    end(robot)
    assert robot.tilt < math.radians(5)


def test_after_a_crouch_it_balances_again_once_it_stands(robot):
    robot.go(0.5)
    crouch(robot, 0.4)
    crouch(robot, -0.4)
    robot.go(2.0)
    robot.push(0.0, 155.0)
    robot.go(0.5)
    assert robot.walker.walking
    robot.go(4.0)
    assert not robot.fallen


def test_a_command_to_hold_the_legs_leaves_it_balanced(robot):
    robot.go(0.5)
    robot.move(dict(zip(robot.leg_names, robot.commands(*robot.leg_names), strict=True)), 0.0)
    robot.go(0.1)
    robot.push(0.0, 155.0)
    robot.go(0.5)
    assert robot.walker.walking
    robot.go(4.0)
    assert not robot.fallen


def test_it_crouches_with_noise_and_walks_from_there(body):
    robot = Humanoid(body, seed=4, noise=Noise())
    robot.go(1.0)
    crouch(robot, 0.8)
    robot.go(1.0)
    robot.walk(WalkVelocity(forward=0.2), 3.0)
    end(robot)
    assert not robot.fallen
    assert robot.tilt < math.radians(6)


def test_the_setpoints_are_those_of_the_inverse_kinematics(robot):
    robot.go(1.0)
    names = robot.leg_names
    given = robot.data.ctrl[[robot.mj.actuator(name).id for name in names]]
    # The motors get more than that, or the weight would bend the legs.
    assert np.abs(given - robot.commands(*names)).max() > 0.005
    assert robot.angles(*names) == pytest.approx(robot.commands(*names), abs=0.01)


def test_arms_swing_until_they_are_commanded(robot):
    robot.walk(WalkVelocity(forward=0.3), 3.0)
    left, right = robot.shoulders
    seen = []
    for _ in range(20):
        robot.go(0.05)
        seen.append(robot.commands(left, right))
    swing = np.ptp(np.array(seen), axis=0)
    assert (swing > 0.2).all()
    robot.move({left: robot.commands(left)[0]}, SPEED)
    robot.go(0.05)
    held = robot.commands(left)
    robot.go(0.5)
    assert robot.commands(left) == held
    assert not robot.fallen


def test_arms_that_wave_do_not_bring_it_down(robot):
    robot.walk(WalkVelocity(forward=0.2), 1.0)
    for sign in (1.0, -1.0, 1.0, -1.0):
        robot.move(dict.fromkeys(robot.shoulders, -0.8 * sign), 2.0)
        robot.go(0.7)
    assert not robot.fallen


def stiffen(robot, stiffness):
    motors = robot.limbs.leg_motors
    robot.simulator.order(
        lambda: robot.simulator.motors.stiffen(motors, np.full(len(motors), stiffness), 0.0)
    )


def test_it_balances_unless_its_legs_are_limp(robot):
    robot.go(0.5)
    assert robot.walker.balances
    crouch(robot, 0.4)
    assert robot.walker.balances
    stiffen(robot, 0.0)
    robot.go(0.02)
    assert not robot.walker.balances


def test_it_does_not_walk_with_limp_legs(robot):
    robot.go(0.5)
    stiffen(robot, 0.0)
    robot.go(0.02)
    with pytest.raises(InvalidCommand, match="limp"):
        robot.walker.command(WalkVelocity(forward=0.2))
    assert not robot.walker.walking


def test_legs_that_become_limp_end_the_walk(robot):
    robot.walk(WalkVelocity(forward=0.2), 1.0)
    stiffen(robot, 0.0)
    robot.go(0.05)
    assert not robot.walker.walking
    assert "limp" in robot.walker.ended


def test_it_does_not_walk_while_it_lies(robot):
    robot.go(0.5)
    stiffen(robot, 0.0)
    robot.go(0.3)
    robot.push(300.0, 0.0, 0.3)
    robot.go(3.0)
    stiffen(robot, 1.0)
    robot.go(0.1)
    assert robot.fallen
    with pytest.raises(InvalidCommand, match="lies"):
        robot.walker.command(WalkVelocity(forward=0.2))


def test_it_does_not_walk_in_the_air(robot):
    robot.go(0.5)
    robot.hang(0.5)
    robot.go(1.5)
    with pytest.raises(InvalidCommand, match="on its feet"):
        robot.walker.command(WalkVelocity(forward=0.2))


def test_it_stops_when_it_is_moved(robot):
    robot.walk(WalkVelocity(forward=0.2), 1.0)
    robot.walker.abandon()
    assert not robot.walker.walking
    assert robot.walker.ended == "the robot was moved"
