"""Bodies and their looks as viewers without MuJoCo receive them: what MuJoCo draws, where it draws it."""

import base64

import mujoco
import numpy as np
import pytest

from naoserver.bodies.description import describe_looks
from naoserver.bodies.looks import read_looks, skin_names
from tests.support.looks import COLORS, model_of

pytestmark = pytest.mark.sim


def test_a_lamp_of_which_no_color_is_known_is_off():
    described = describe_looks(read_looks("nao"), {"LeftEye": (1.0, 1.0, 1.0)})
    assert sum(shape.glow > 0.0 for shape in described.shapes) == 1


@pytest.mark.parametrize("name", skin_names())
def test_viewers_receive_the_shapes_that_mujoco_draws(name):
    mj = model_of(name)
    described = describe_looks(read_looks(name), COLORS)
    geoms = {
        mj.body(number).name: iter(np.flatnonzero(mj.geom_bodyid == number)) for number in range(mj.nbody)
    }
    for shape in described.shapes:
        geom = next(geoms[shape.link])
        material = mj.geom_matid[geom]
        assert mj.geom_type[geom] == getattr(mujoco.mjtGeom, f"mjGEOM_{shape.kind.upper()}")
        assert shape.color == pytest.approx(mj.mat_rgba[material, :3], abs=1e-3)
        assert shape.glow == pytest.approx(mj.mat_emission[material], abs=1e-3)
        if shape.kind == "mesh":
            continue
        assert shape.size == pytest.approx(mj.geom_size[geom], abs=1e-5)
        assert shape.position == pytest.approx(mj.geom_pos[geom], abs=1e-5)
        assert shape.quaternion is not None
        turn = np.roll(shape.quaternion, 1)
        assert abs(turn @ mj.geom_quat[geom]) == pytest.approx(1.0, abs=1e-4)
    assert all(next(rest, None) is None for rest in geoms.values())


@pytest.mark.parametrize("name", skin_names())
def test_viewers_receive_the_meshes(name):
    described = describe_looks(read_looks(name), COLORS)
    for mesh, received in zip(read_looks(name).meshes.values(), described.meshes, strict=True):
        vertices = np.frombuffer(base64.b64decode(received.vertices), "<i2").reshape(-1, 3)
        faces = np.frombuffer(base64.b64decode(received.indices), "<u2").reshape(-1, 3)
        assert vertices * described.mesh_unit == pytest.approx(mesh.vertices, abs=1e-4)
        assert np.array_equal(faces, mesh.faces)
