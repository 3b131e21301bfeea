"""The appearance of the robot: the shapes and the meshes of its looks, in a compiled model."""

from contextlib import closing

import mujoco
import numpy as np
import pytest

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.looks import read_looks, skin_names
from naoserver_sim._simulator import Snapshot
from naoserver_sim.appearance import VISUAL_GROUP, Lamps
from naoserver_sim.cameras import CameraRenderer, create_context, put_cameras
from naoserver_sim.model import build_model
from naoserver_sim.standing import build_standing
from naoserver_sim.world import load_world
from tests.support.looks import model_of
from tests.support.soak import cases

pytestmark = pytest.mark.sim

HIDDEN = 5
"""A group of geoms that no camera sees."""


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
@pytest.mark.parametrize("name", skin_names())
def test_links_of_the_right_side_mirror_those_of_the_left(name, skin):
    mj = model_of(name, skin=skin)
    for sides in read_looks(name).skin.mirror.items():
        left, right = (seen(mj, link) for link in sides)
        assert mj.geom_type[left].tolist() == mj.geom_type[right].tolist()
        assert mj.geom_pos[right] == pytest.approx(mj.geom_pos[left] * [1, -1, 1], abs=1e-4)
        assert mj.geom_rbound[right] == pytest.approx(mj.geom_rbound[left], abs=1e-4)


@pytest.mark.parametrize("link", ["upper_arm", "forearm", "wrist_hand", "thigh", "tibia", "foot"])
@pytest.mark.parametrize("skin", [True, False], ids=["shell", "blocks"])
def test_each_limb_is_seen_on_both_sides(skin, link):
    mj = build_model(skin=skin).mj
    assert len(seen(mj, f"l_{link}")) == len(seen(mj, f"r_{link}")) > 0


def test_closed_shells_face_outwards_on_both_sides():
    mj = build_model().mj
    for link in ("head", "torso", "l_thigh", "r_thigh", "l_foot", "r_foot"):
        assert volume(mj, seen(mj, link)[0]) > 1e-4


def picture_of(model, data):
    """Return what the body's first camera sees."""
    of_motors = data.ctrl, data.ctrl, data.ctrl, data.ctrl
    state = Snapshot(0.0, data.qpos, data.qpos, data.qvel, *of_motors, data.qpos, data.qvel)
    renderer = CameraRenderer(model.mj, model.cameras, lambda _: state, Lamps(model.mj, dict), virtual=True)
    with closing(renderer):
        return np.array(renderer.capture(model.cameras[0].name, 320, 240).pixels)


@pytest.mark.gl
@pytest.mark.parametrize("skin", [True, False], ids=["shell", "blocks"])
@pytest.mark.parametrize("name", BODY_NAMES)
def test_a_camera_looks_out_of_the_link_that_carries_it(name, skin):
    body = find_body(name)
    model, data = build_standing(load_world("empty"), None, skin=skin, body=body)
    picture = picture_of(model, data)
    model.mj.geom_group[seen(model.mj, body.cameras[0].link)] = HIDDEN
    assert np.array_equal(picture, picture_of(model, data))


def drawn_whole(mj, data, camera):
    """Return what a camera sees when MuJoCo draws every geom."""
    options, view = mujoco.MjvOption(), mujoco.MjvCamera()
    options.geomgroup[:] = [1, 1, 0, 0, 0, 0]
    options.sitegroup[:] = 0
    view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, mj.camera(camera).id
    scene = mujoco.MjvScene(mj, mj.ngeom)
    everything = mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(mj, data, options, mujoco.MjvPerturb(), view, everything, scene)
    for flag in ("SHADOW", "REFLECTION", "FOG", "HAZE"):
        scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{flag}")] = 0
    picture, viewport = np.empty((240, 320, 3), np.uint8), mujoco.MjrRect(0, 0, 320, 240)
    context = create_context(320, 240)
    with context.as_current():
        resources = mujoco.MjrContext(mj, mujoco.mjtFontScale.mjFONTSCALE_50)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, resources)
        mujoco.mjr_render(viewport, scene, resources)
        mujoco.mjr_readPixels(picture, None, viewport, resources)
        resources.free()
    context.free()
    return picture[::-1]


@pytest.mark.gl
@pytest.mark.parametrize("name", BODY_NAMES)
@pytest.mark.parametrize("seed", cases([0], [1, 2]))
def test_a_picture_lacks_nothing_of_what_mujoco_draws(name, seed):
    model, data = build_standing(load_world("soccer"), None, skin=True, body=find_body(name))
    data.qpos[:] += np.random.default_rng(seed).normal(0.0, 0.2, model.mj.nq)
    picture = picture_of(model, data)
    put_cameras(model.mj, data, data.qpos)
    assert np.array_equal(picture, drawn_whole(model.mj, data, model.cameras[0].name))
