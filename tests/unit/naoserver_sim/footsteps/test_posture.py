"""Inverse kinematics of the legs."""

import mujoco
import numpy as np
import pytest

from naoserver_sim._footsteps.limbs import quaternion
from naoserver_sim._footsteps.posture import Posture, Target, walking_stance
from tests.support.humanoids import BODIES, Humanoid

pytestmark = pytest.mark.sim


def places(left, right, center):
    return tuple(left), tuple(right), tuple(center)


@pytest.fixture(params=sorted(BODIES))
def robot(request):
    return Humanoid(request.param)


def test_the_stance_is_as_high_and_as_wide_as_the_parameters_say(robot):
    footsteps, limbs = robot.footsteps, robot.limbs
    angles = walking_stance(robot.mj, limbs, footsteps, robot.data.qpos[limbs.qpos])
    data = mujoco.MjData(robot.mj)
    data.qpos[limbs.qpos] = angles
    mujoco.mj_kinematics(robot.mj, data)
    mujoco.mj_comPos(robot.mj, data)
    sole = np.array(footsteps.sole_middle)
    left, right = (data.xpos[foot] + data.xmat[foot].reshape(3, 3) @ sole for foot in limbs.feet)
    assert left - right == pytest.approx([0.0, footsteps.width, 0.0], abs=1e-4)
    over = data.subtree_com[limbs.base] - 0.5 * (left + right)
    assert over == pytest.approx([0.0, 0.0, footsteps.com_height], abs=1e-4)


def test_a_foot_goes_where_it_is_wanted_and_the_body_stays(robot):
    limbs = robot.limbs
    posture = Posture(robot.mj, limbs)
    posture.put(robot.data.qpos[:3].copy(), robot.data.qpos)
    angles = robot.data.qpos[limbs.qpos]
    posture.update()
    center = posture.data.subtree_com[limbs.base].copy()
    wanted = limbs.soles(posture.data) + np.array([[0.1, 0.02, 0.05], [0.0, 0.0, 0.0]])
    turns = quaternion(0.2), quaternion(0.0), quaternion(0.1)
    target = Target(places(wanted[0], wanted[1], center), turns)
    posture.solve(target, angles, 20)
    posture.update()
    assert limbs.soles(posture.data) == pytest.approx(wanted, abs=1e-4)
    assert posture.data.subtree_com[limbs.base] == pytest.approx(center, abs=1e-4)
    assert posture.data.xquat[limbs.feet[0]] == pytest.approx(quaternion(0.2), abs=1e-3)
    assert posture.data.xquat[limbs.pelvis] == pytest.approx(quaternion(0.1), abs=1e-3)


def test_angles_stay_within_the_ranges_of_the_joints(robot):
    limbs = robot.limbs
    posture = Posture(robot.mj, limbs)
    posture.put(robot.data.qpos[:3].copy(), robot.data.qpos)
    posture.update()
    soles = limbs.soles(posture.data)
    center = posture.data.subtree_com[limbs.base] + np.array([0.0, 0.0, 1.0])
    target = Target(places(soles[0], soles[1], center), 3 * (quaternion(0.0),))
    posture.solve(target, robot.data.qpos[limbs.qpos], 50)
    lower, upper = robot.mj.jnt_range[robot.mj.dof_jntid[limbs.leg_dofs]].T
    assert (posture.legs >= lower).all()
    assert (posture.legs <= upper).all()
