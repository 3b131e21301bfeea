import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.bodies.nao import H25
from naoserver.bodies.parts import Wheels
from naoserver.fake import FakeRobot
from naoserver.fake.robot import FakeWalker
from tests.support.bodies import CART
from tests.support.present import present
from zenoh_ice import VirtualClock

assert isinstance(CART.walk, Wheels)
WHEELS = CART.walk
velocities = st.builds(WalkVelocity, st.floats(-0.3, 0.3), st.floats(-0.12, 0.12), st.floats(-0.9, 0.9))


@given(velocities, st.lists(st.floats(0.01, 2.0), min_size=1, max_size=8))
def test_how_often_it_is_asked_makes_no_difference(velocity, pauses):
    clock = VirtualClock()
    often, once = FakeWalker(clock, H25.groups.legs), FakeWalker(clock, H25.groups.legs)
    for walker in (often, once):
        walker.command(velocity)
    for pause in pauses:
        clock.advance(pause)
        often.odometry()
    one, other = often.odometry(), once.odometry()
    assert (one.x, one.y) == pytest.approx((other.x, other.y), abs=1e-9)
    assert math.remainder(one.heading - other.heading, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_a_circle_ends_where_it_began():
    clock = VirtualClock()
    walker = FakeWalker(clock, H25.groups.legs)
    walker.command(WalkVelocity(forward=0.2, turn=0.5))
    clock.advance(math.pi / 0.5)
    half = walker.odometry()
    assert (half.x, half.y) == pytest.approx((0.0, 2 * 0.2 / 0.5), abs=1e-9)
    clock.advance(math.pi / 0.5)
    assert (walker.odometry().x, walker.odometry().y) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_forward_is_where_it_looks():
    clock = VirtualClock()
    walker = FakeWalker(clock, H25.groups.legs)
    walker.command(WalkVelocity(turn=0.5))
    clock.advance(math.pi)
    walker.command(WalkVelocity(forward=0.2, left=0.1))
    clock.advance(2.0)
    walker.command(STILL)
    clock.advance(5.0)
    odometry = walker.odometry()
    assert (odometry.x, odometry.y) == pytest.approx((-0.2, 0.4))
    assert odometry.heading == pytest.approx(math.pi / 2)
    assert not walker.walking


def test_once_closed_it_stays_where_it_is():
    clock = VirtualClock()
    walker = FakeWalker(clock, H25.groups.legs)
    walker.command(WalkVelocity(forward=0.2))
    clock.advance(1.0)
    walker.close()
    clock.advance(1.0)
    walker.command(WalkVelocity(forward=0.2))
    clock.advance(1.0)
    assert walker.odometry().x == pytest.approx(0.2)


def wheels_of(robot):
    """Return angle, speed and setpoint of the left and of the right wheel."""
    reading, joints = robot.read(), robot.body.joint_names
    places = [joints.index(name) for name in (WHEELS.left, WHEELS.right)]
    return [(reading.positions[at], reading.velocities[at], reading.commands[at]) for at in places]


def test_wheels_turn_as_they_drive():
    clock = VirtualClock()
    robot = FakeRobot(clock, body=CART)
    present(robot.walker).command(WalkVelocity(forward=0.2, turn=0.5))
    clock.advance(2.0)
    left, right = (
        (0.2 - 0.5 * WHEELS.distance / 2) / WHEELS.radius,
        (0.2 + 0.5 * WHEELS.distance / 2) / WHEELS.radius,
    )
    assert wheels_of(robot) == [
        pytest.approx((2.0 * left, left, 2.0 * left)),
        pytest.approx((2.0 * right, right, 2.0 * right)),
    ]
    present(robot.walker).command(STILL)
    clock.advance(1.0)
    assert wheels_of(robot)[0] == pytest.approx((2.0 * left, 0.0, 2.0 * left))


def test_a_wheel_is_turned_by_hand_from_where_it_drove():
    clock = VirtualClock()
    robot = FakeRobot(clock, body=CART)
    present(robot.walker).command(WalkVelocity(forward=0.2))
    clock.advance(1.0)
    present(robot.walker).command(STILL)
    robot.command_positions({WHEELS.left: 1.0}, {WHEELS.left: 5.0})
    clock.advance(3.0)
    (left, _, setpoint), (right, _, _) = wheels_of(robot)
    assert (left, setpoint) == pytest.approx((1.0, 1.0))
    assert right == pytest.approx(0.2 / WHEELS.radius)


@given(velocities, st.lists(st.floats(0.01, 2.0), min_size=1, max_size=8))
def test_the_turns_of_wheels_do_not_depend_on_how_often_it_is_asked(velocity, pauses):
    clock = VirtualClock()
    often, once = FakeRobot(clock, body=CART), FakeRobot(clock, body=CART)
    for robot in (often, once):
        present(robot.walker).command(velocity)
    for pause in pauses:
        clock.advance(pause)
        often.read()
    assert often.read().positions == pytest.approx(once.read().positions, abs=1e-9)
