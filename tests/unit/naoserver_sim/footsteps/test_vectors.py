"""Turns and products of vectors."""

import mujoco
import numpy as np
import pytest

from naoserver_sim._footsteps.vectors import axes, inclination, quaternion, turn_between


def test_axes_and_quaternion_are_the_same_turn():
    turned = np.zeros(9)
    mujoco.mju_quat2Mat(turned, np.array(quaternion(0.5, -0.2, 0.3)))
    assert turned.reshape(3, 3) == pytest.approx(axes(0.5, -0.2, 0.3))


def test_roll_and_pitch_are_found_again():
    assert inclination(axes(2.5, -0.2, 0.3)) == pytest.approx((-0.2, 0.3))


def test_a_small_turn_is_a_vector():
    begin = axes(0.4, 0.1, 0.2)
    assert turn_between(begin, axes(0.01) @ begin) == pytest.approx([0.0, 0.0, 0.01], abs=1e-5)
