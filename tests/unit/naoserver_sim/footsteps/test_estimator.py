"""What is estimated from the sensors of a body."""

import math

import numpy as np
import pytest

from naoserver.bodies.capabilities import InertialReading, WalkVelocity
from naoserver_sim._footsteps.estimator import Estimator
from tests.support.humanoids import BODIES, Humanoid

pytestmark = pytest.mark.sim

TICK = 0.01
BOTH = (0.5, 0.5)


@pytest.fixture(params=sorted(BODIES))
def robot(request):
    return Humanoid(request.param)


@pytest.fixture
def estimator(robot):
    found = Estimator(robot.mj, robot.limbs, robot.footsteps)
    found.lose_footing()
    return found


def feel(estimator, inertial, angles, *, resting=False):
    """Let a tick pass in which the joints rest."""
    estimator.turn(TICK, inertial, resting=resting)
    estimator.tick(TICK, inertial, angles, np.zeros_like(angles), BOTH)


def reading(roll=0.0, pitch=0.0, turning=(0.0, 0.0, 0.0)):
    return InertialReading((0.0, 0.0, 9.81), turning, roll, pitch)


def test_the_center_of_mass_is_over_the_feet_of_a_stance(robot, estimator):
    angles = robot.data.qpos[robot.limbs.qpos]
    feel(estimator, reading(), angles)
    middle = 0.5 * (estimator.place_of(0) + estimator.place_of(1))
    assert estimator.center == pytest.approx(middle, abs=1e-3)
    assert estimator.height == pytest.approx(robot.footsteps.com_height, abs=1e-3)


def inertia_about_the_floor(robot):
    """Return the moment of inertia in kg m2 about the axis y through the middle between the soles."""
    mj, data = robot.mj, robot.data
    found = 0.0
    for link in range(robot.limbs.base, mj.nbody):
        x, _, z = data.xipos[link]
        axis = data.ximat[link].reshape(3, 3)[1]
        found += mj.body_mass[link] * (x * x + z * z) + axis**2 @ mj.body_inertia[link]
    return found


def test_a_body_that_turns_over_its_feet_moves_its_capture_point(robot, estimator):
    angles = robot.data.qpos[robot.limbs.qpos]
    feel(estimator, reading(), angles)
    before = estimator.capture_point
    for tick in range(-40, 1):  # until it is upright
        feel(estimator, reading(pitch=0.5 * TICK * tick, turning=(0.0, 0.5, 0.0)), angles)
    forward = (estimator.capture_point - before).real
    momentum = 0.5 * inertia_about_the_floor(robot)
    speed = momentum / (robot.body.mass * robot.footsteps.com_height)
    assert forward == pytest.approx(speed / robot.footsteps.frequency, rel=0.05)


def test_a_unit_that_is_mounted_askew_is_found_out_while_it_stands(robot, estimator):
    angles = robot.data.qpos[robot.limbs.qpos]
    askew = reading(roll=0.01, pitch=-0.015, turning=(0.0, 0.0, 0.02))
    for _ in range(100):
        feel(estimator, askew, angles, resting=True)
    middle = 0.5 * (estimator.place_of(0) + estimator.place_of(1))
    assert estimator.center == pytest.approx(middle, abs=1e-3)
    heading = estimator.heading
    feel(estimator, askew, angles)
    assert estimator.heading == pytest.approx(heading, abs=1e-6)


def test_the_feet_keep_their_headings_beyond_half_a_turn(robot, estimator):
    angles = robot.data.qpos[robot.limbs.qpos]
    for _ in range(400):
        feel(estimator, reading(turning=(0.0, 0.0, 1.0)), angles)
    assert estimator.heading == pytest.approx(4.0)
    assert estimator.heading_of(0) == pytest.approx(4.0, abs=0.05)


def test_looking_ahead_goes_on_as_the_pendulum_falls(robot, estimator):
    angles = robot.data.qpos[robot.limbs.qpos]
    feel(estimator, reading(), angles)
    place = estimator.capture_point
    estimator.look_ahead(0.02, place - 0.1)
    growth = math.exp(robot.footsteps.frequency * 0.02)
    assert estimator.capture_point - (place - 0.1) == pytest.approx(0.1 * growth, rel=1e-3)


def test_it_measures_what_the_physics_does_while_the_robot_walks(robot):
    robot.go(0.5)
    robot.walk(WalkVelocity(forward=0.3), 3.0)
    x, y, heading = robot.place()
    odometry = robot.walker.odometry()
    assert (odometry.x, odometry.y) == pytest.approx((x, y), abs=0.03)
    assert odometry.heading == pytest.approx(heading, abs=0.01)


def test_a_robot_that_is_put_elsewhere_is_as_it_is_measured_there_at_once(robot, estimator):
    angles = np.zeros(len(robot.limbs.qpos))
    for _ in range(20):
        feel(estimator, reading(roll=0.05), angles)
    estimator.turn(TICK, reading(roll=0.05))
    estimator.tick(TICK, reading(roll=0.05), angles, np.ones_like(angles), BOTH)  # its joints move
    estimator.lose_footing()
    feel(estimator, reading(), angles)
    upright = estimator.data.qpos[robot.limbs.base_qpos + 3]
    assert upright == pytest.approx(1.0, abs=1e-9)
    fresh = Estimator(robot.mj, robot.limbs, robot.footsteps)
    fresh.lose_footing()
    feel(fresh, reading(), angles)
    assert estimator.velocity == pytest.approx(fresh.velocity, abs=1e-9)
