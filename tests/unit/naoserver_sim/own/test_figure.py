"""Where the parts of a model are at rest, and what its joints carry."""

import math

import mujoco
import pytest

from naoserver_sim._own.figure import Figure

pytestmark = pytest.mark.sim

LEG = """<mujoco><worldbody><geom type="plane" size="5 5 1"/><body name="trunk" pos="0 0 1"><freejoint/>
  <geom type="box" size="0.1 0.1 0.1" mass="10"/>
  <body name="leg"><joint name="hip" axis="0 1 0" range="20 90"/>
    <geom type="capsule" fromto="0 0 -0.2 0 0 -0.6" size="0.05" mass="2"/></body></body></worldbody>{}</mujoco>"""


def figure(text=LEG, more=""):
    return Figure(mujoco.MjModel.from_xml_string(text.format(more)))


def test_joints_are_at_0_or_bent_a_little_where_their_range_has_none():
    assert figure().data.qpos[7] == pytest.approx(math.radians(20 + 0.3 * 70))
    assert figure(LEG.replace("20 90", "-20 90")).data.qpos[7] == 0.0


def test_a_keyframe_in_which_a_robot_waits_is_its_rest():
    key = '<keyframe><key name="{}" qpos="0 0 1 1 0 0 0 1"/></keyframe>'
    assert figure(more=key.format("Stand")).data.qpos[7] == 1.0
    assert figure(more=key.format("fall")).key is None


def test_gravity_pulls_at_a_joint_with_all_that_it_carries():
    assert figure().load(1) == pytest.approx(9.81 * 2 * 0.4, rel=1e-3)


def test_a_leg_carries_the_rest_of_the_robot_unless_that_is_mounted():
    here = figure()
    assert here.torque(1, mounted=True) == pytest.approx(2 * here.load(1), rel=0.05)
    assert here.torque(1, mounted=False) == pytest.approx(0.5 * 9.81 * 10 * 0.65, rel=0.05)
    assert here.tips(1, mounted=False) == pytest.approx(0.0)  # its center is at the joint
    assert here.tips(1, mounted=True) == 0.0


def test_the_floor_is_under_what_touches():
    low, _ = figure(LEG.replace('size="0.05"', 'size="0.05" contype="0" conaffinity="0"')).box
    assert low[2] == pytest.approx(0.9)


def test_without_a_shape_that_touches_all_touch():
    ghost = LEG.replace("mass=", 'contype="0" conaffinity="0" mass=')
    assert (len(figure(ghost).solid), figure(ghost).says_what_touches) == (2, False)
    assert figure().says_what_touches


def test_a_joint_moves_less_inertia_if_the_trunk_is_free():
    held, free = (inertia[6] for inertia in figure().inertias)
    assert free < held
