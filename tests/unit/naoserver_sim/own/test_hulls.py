"""The hulls by which the links of a user's model touch."""

import mujoco
import numpy as np
import pytest

from naoserver.parts import MOST_POINTS
from naoserver_sim._own.hulls import coarsen_hulls, hull_of

pytestmark = pytest.mark.sim


def of_points(points, **place):
    """Return a model with one geom: the mesh with these vertices."""
    spec = mujoco.MjSpec()
    shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    spec.add_mesh(name="mesh", uservert=np.ravel(points), inertia=shell)
    body = spec.worldbody.add_body()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh", **place)
    coarsen_hulls(spec)
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
