"""Turns and products of vectors."""

import mujoco
import numpy as np
import pytest

from naoserver_sim._footsteps.limbs import inclination, quaternion


def test_a_quaternion_turns_about_x_then_y_then_z():
    wanted = np.array([1.0, 0.0, 0.0, 0.0])
    for angle, axis in ((-0.2, (1.0, 0.0, 0.0)), (0.3, (0.0, 1.0, 0.0)), (0.5, (0.0, 0.0, 1.0))):
        turn = np.zeros(4)
        mujoco.mju_axisAngle2Quat(turn, np.array(axis), angle)
        mujoco.mju_mulQuat(wanted, turn, wanted.copy())
    assert quaternion(0.5, -0.2, 0.3) == pytest.approx(tuple(wanted))


def test_roll_and_pitch_are_found_again():
    turned = np.zeros(9)
    mujoco.mju_quat2Mat(turned, np.array(quaternion(2.5, -0.2, 0.3)))
    assert inclination(turned.reshape(3, 3)) == pytest.approx((-0.2, 0.3))
