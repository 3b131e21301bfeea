"""Where the parts of a model are at rest, and what its joints carry."""

import math

import mujoco
import numpy as np
import pytest

from naoserver.bodies.parts import MOST_POINTS
from visualhfsm_own_robots._figure import Figure, hull_of

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


def of_points(points, **place):
    """Return a model with one geom: the mesh with these vertices."""
    spec = mujoco.MjSpec()
    shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    spec.add_mesh(name="mesh", uservert=np.ravel(points), inertia=shell)
    body = spec.worldbody.add_body()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh", **place)
    spec.meshes[0].maxhullvert = MOST_POINTS
    return spec.compile()


def test_the_hull_of_a_cube_is_its_corners_where_the_geom_is():
    corners = [[x, y, z] for x in (0, 0.2) for y in (0, 0.4) for z in (0, 0.6)]
    inside = [[0.1, 0.1, 0.1], [0.1, 0.3, 0.5]]
    hull = hull_of(of_points(corners + inside, pos=[1, 0, 0], quat=[0.5**0.5, 0, 0, 0.5**0.5]), 0)
    expected = sorted((1 - y, x, z) for x, y, z in corners)  # turned to the left by a quarter
    assert np.array(sorted(hull.round(6).tolist())) == pytest.approx(np.array(expected), abs=1e-6)


def test_a_fine_hull_keeps_its_extent_with_few_corners():
    points = np.random.default_rng(1).normal(size=(1000, 3))
    points *= [0.1, 0.05, 0.02] / np.linalg.norm(points, axis=1, keepdims=True)
    coarse = hull_of(of_points(points), 0)
    assert len(coarse) <= MOST_POINTS
    assert np.ptp(coarse, axis=0) == pytest.approx(np.ptp(points, axis=0), rel=0.03)


def test_a_mesh_that_is_as_good_as_flat_has_no_hull():
    flat = [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0], [0.05, 0.05, 1e-4]]
    assert len(hull_of(of_points(flat), 0)) == 0


def test_another_shape_has_no_hull():
    mj = mujoco.MjModel.from_xml_string('<mujoco><worldbody><geom size="1"/></worldbody></mujoco>')
    assert len(hull_of(mj, 0)) == 0
