"""The inertial unit, compared with the motion of the torso computed from its positions."""

import itertools
import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.bodies.nao import H25
from tests.support.examples import examples
from tests.support.physics import GRAVITY, Lab, rotation
from tests.support.present import present

pytestmark = pytest.mark.sim

_TOGETHER = 20


@pytest.fixture(scope="module")
def standing():
    return Lab()


def test_at_rest_it_feels_gravity(standing):
    standing.step(400)
    reading = standing.record.newest.inertial
    _, axes = standing.pose()
    assert reading.acceleration == pytest.approx(-axes.T @ GRAVITY, abs=0.02)
    assert reading.angular_velocity == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


def test_in_free_fall_it_feels_nothing():
    lab = Lab()
    lab.lift(1.0)
    lab.step(20)
    lab.step(20)
    assert np.linalg.norm(lab.record.newest.inertial.acceleration) < 0.1


@pytest.mark.parametrize("rate", [(0.0, 0.0, 5.0), (3.0, 0.0, 0.0), (1.0, -4.0, 2.0)])
def test_while_it_falls_and_turns_it_feels_what_moves_the_unit(rate):
    lab = Lab()
    lab.lift(1.0)
    lab.spin(np.array(rate))
    _compare_with_motion(lab, steps=60)


def test_while_it_topples_and_hits_the_floor():
    lab = Lab()
    lab.data.qvel[lab.dof] = 1.5  # m/s forwards, more than it can catch
    _compare_with_motion(lab, steps=400)


@settings(max_examples=examples(30))
@given(
    roll=st.floats(-math.pi, math.pi),
    pitch=st.floats(-1.5, 1.5),
    yaw=st.floats(-math.pi, math.pi),
)
def test_roll_and_pitch_are_reported_against_the_vertical(standing, roll, pitch, yaw):
    def about(axis, angle):
        half = angle / 2
        quaternion = np.array([math.cos(half), 0.0, 0.0, 0.0])
        quaternion[1 + axis] = math.sin(half)
        return rotation(quaternion)

    wanted = about(2, yaw) @ about(1, pitch) @ about(0, roll)
    w = math.sqrt(max(0.0, 1.0 + np.trace(wanted))) / 2
    if w < 0.05:
        return  # this way back from a matrix needs another pivot there
    x, y, z = (wanted[2, 1] - wanted[1, 2], wanted[0, 2] - wanted[2, 0], wanted[1, 0] - wanted[0, 1])
    standing.data.qpos[standing.base + 3 : standing.base + 7] = [w, *(part / (4 * w) for part in (x, y, z))]
    mujoco.mj_forward(standing.mj, standing.data)
    standing.record.sample(0.0)
    reported = standing.record.newest.inertial
    assert math.sin(reported.roll - roll) == pytest.approx(0.0, abs=1e-6)
    assert reported.pitch == pytest.approx(pitch, abs=1e-6)


def test_positive_is_forwards_and_to_the_right_side(standing):
    for axis, name in ((1, "roll"), (2, "pitch")):
        quaternion = np.array([math.cos(0.1), 0.0, 0.0, 0.0])
        quaternion[axis] = math.sin(0.1)
        standing.data.qpos[standing.base + 3 : standing.base + 7] = quaternion
        mujoco.mj_forward(standing.mj, standing.data)
        standing.record.sample(0.0)
        assert getattr(standing.record.newest.inertial, name) == pytest.approx(0.2)
    _, axes = standing.pose()
    assert axes[2, 0] < 0  # pitched by 0.2 rad, its x axis looks down


def _compare_with_motion(lab, steps):
    """Compare what is felt with the differences of where the unit is, both over a few steps."""
    step = lab.mj.opt.timestep
    unit = np.array(present(H25.inertial_unit).accelerometer)
    places, axes, felt, turned = [], [], [], []
    for _ in range(steps):
        place, turn = lab.pose()
        places.append(place + turn @ unit)
        axes.append(turn)
        lab.step()
        reading = lab.record.newest.inertial  # of the state in which the step began
        felt.append(turn @ reading.acceleration)
        turned.append(reading.angular_velocity)
    moved = np.diff(places, 2, axis=0) / step**2 - GRAVITY
    # The integrator damps the joints more than the forces that it reports: over some steps that evens out.
    assert _means(felt[1:-1]) == pytest.approx(_means(moved), rel=0.05, abs=0.5)
    between = [before.T @ after for before, after in itertools.pairwise(axes)]
    rates = [
        np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (2 * step)
        for turn in between
    ]
    # The rate of a step is that of its end: MuJoCo moves by the velocity that it has just changed.
    assert np.array(turned[1:]) == pytest.approx(np.array(rates), rel=0.01, abs=0.01)


def _means(vectors):
    """Return the means over groups of steps."""
    whole = len(vectors) // _TOGETHER * _TOGETHER
    return np.array(vectors[:whole]).reshape(-1, _TOGETHER, 3).mean(axis=1)
