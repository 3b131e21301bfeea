"""The odometry alone, on legs that the test moves."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.bodies.capabilities import InertialReading
from naoserver.bodies.nao import H25
from naoserver_sim._walk.legs import FootPose, Legs, Odometer
from tests.support.examples import examples

TICK = 0.01
STANDING = (25.0, 25.0)


def joints(forward=0.0, left=0.0):
    """Return the angles of the legs when both soles are somewhere below the torso."""
    yaw, *angles = Legs(H25).solve(FootPose(forward, left + 0.05, -0.3), FootPose(forward, left - 0.05, -0.3))
    return [yaw, *angles[:5], yaw, *angles[5:]]


def turning(rate):
    return InertialReading((0.0, 0.0, 9.81), (0.0, 0.0, rate), 0.0, 0.0)


@given(st.floats(-0.04, 0.04), st.floats(-0.03, 0.03), st.floats(0.0, 50.0), st.floats(1.0, 50.0))
@settings(max_examples=examples(40))
def test_the_torso_moves_as_far_as_the_soles_that_carry_move_below_it(forward, left, one, other):
    odometer = Odometer(Legs(H25))
    odometer.tick(TICK, joints(), turning(0.0), (one, other))
    odometer.tick(TICK, joints(forward, left), turning(0.0), (one, other))
    assert odometer.pose[:2] == pytest.approx((-forward, -left), abs=1e-6)


def test_a_sole_that_carries_nothing_does_not_count():
    odometer = Odometer(Legs(H25))
    still, moved = joints(), joints(0.04)
    odometer.tick(TICK, still, turning(0.0), (50.0, 0.0))
    odometer.tick(TICK, still[:6] + moved[6:], turning(0.0), (50.0, 0.0))
    assert odometer.pose[0] == pytest.approx(0.0, abs=1e-9)
    odometer.tick(TICK, joints(), turning(0.0), (0.0, 0.0))
    assert odometer.pose[0] == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-3.0, 3.0))
@settings(max_examples=examples(20))
def test_forward_is_where_the_robot_has_turned_to(angle):
    odometer = Odometer(Legs(H25))
    odometer.tick(1.0, joints(), turning(angle), STANDING)
    x, y, _ = odometer.pose
    odometer.tick(TICK, joints(), turning(0.0), STANDING)
    odometer.tick(TICK, joints(-0.04), turning(0.0), STANDING)
    assert odometer.pose[2] == pytest.approx(angle)
    moved = (odometer.pose[0] - x, odometer.pose[1] - y)
    assert moved == pytest.approx((0.04 * math.cos(angle), 0.04 * math.sin(angle)), abs=1e-6)


def test_the_heading_of_a_robot_that_turns_on_and_on_stays_within_a_turn():
    odometer = Odometer(Legs(H25))
    for _ in range(400):
        odometer.tick(0.1, joints(), turning(1.0), STANDING)
        assert -math.pi < odometer.pose[2] <= math.pi
    assert odometer.pose[2] == pytest.approx(math.remainder(40.0, math.tau))


def test_the_gyrometer_of_a_standing_robot_reads_its_offset():
    odometer = Odometer(Legs(H25))
    for _ in range(300):
        odometer.tick(TICK, joints(), turning(0.02), STANDING, resting=True)
    begin = odometer.pose[2]
    for _ in range(3000):
        odometer.tick(TICK, joints(), turning(0.02), STANDING)
    assert odometer.pose[2] == pytest.approx(begin, abs=1e-6)
    for _ in range(100):
        odometer.tick(TICK, joints(), turning(0.52), STANDING)
    assert odometer.pose[2] == pytest.approx(begin + 0.5)


def test_a_robot_that_is_turned_while_it_rests_has_turned():
    odometer = Odometer(Legs(H25))
    for _ in range(100):
        odometer.tick(TICK, joints(), turning(0.5), STANDING, resting=True)
    assert odometer.pose[2] == pytest.approx(0.5)


def test_soles_that_were_put_elsewhere_have_not_moved_the_robot():
    odometer = Odometer(Legs(H25))
    odometer.tick(TICK, joints(), turning(0.0), STANDING)
    odometer.lose_footing()
    for _ in range(10):
        odometer.tick(TICK, joints(0.05), turning(0.0), STANDING)
    assert odometer.pose[0] == pytest.approx(0.0, abs=1e-9)
