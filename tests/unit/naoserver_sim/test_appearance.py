"""The appearance of the robot: the shapes of skin.toml and the meshes of skin.obj, in a compiled model."""

import numpy as np
import pytest

from naoserver_sim.appearance import VISUAL_GROUP
from naoserver_sim.model import build_model

pytestmark = pytest.mark.sim


def seen(mj, link):
    """Return the materials and the vertices, in the link's frame, of what is seen of a link."""
    body = mj.body(link).id
    return [
        geom
        for geom in range(mj.ngeom)
        if mj.geom_bodyid[geom] == body and mj.geom_group[geom] == VISUAL_GROUP
    ]


def volume(mj, geom):
    """Return the volume in m3 that a mesh encloses; negative when its faces look inwards."""
    mesh = mj.geom_dataid[geom]
    first, count = mj.mesh_vertadr[mesh], mj.mesh_vertnum[mesh]
    vertices = mj.mesh_vert[first : first + count].astype(float)
    first, count = mj.mesh_faceadr[mesh], mj.mesh_facenum[mesh]
    a, b, c = (vertices[mj.mesh_face[first : first + count, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("skin", [True, False], ids=["shell", "blocks"])
def test_the_right_side_mirrors_the_left(skin):
    mj = build_model(skin=skin).mj
    for link in ("upper_arm", "forearm", "wrist_hand", "thigh", "tibia", "foot"):
        left, right = seen(mj, f"l_{link}"), seen(mj, f"r_{link}")
        assert left
        assert [mj.geom_type[geom] for geom in left] == [mj.geom_type[geom] for geom in right]
        assert mj.geom_pos[right] == pytest.approx(mj.geom_pos[left] * [1, -1, 1], abs=1e-4)
        assert mj.geom_rbound[right] == pytest.approx(mj.geom_rbound[left], abs=1e-4)


def test_closed_shells_face_outwards_on_both_sides():
    mj = build_model().mj
    for link in ("head", "torso", "l_thigh", "r_thigh", "l_foot", "r_foot"):
        assert volume(mj, seen(mj, link)[0]) > 1e-4
