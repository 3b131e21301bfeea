"""The model, compared with the facts that it was built from."""

import math

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.nao import H25
from naoserver.bodies.parts import TouchSensor
from naoserver.errors import RobotError
from naoserver_sim._body import sole
from naoserver_sim.model import build_model
from naoserver_sim.standing import standing
from naoserver_sim.world import load_world
from tests.support import published

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def model():
    return build_model(skin=False)


@pytest.fixture
def zero_pose(model):
    """All joints at 0, the torso upright so high that the soles touch the floor."""
    data = mujoco.MjData(model.mj)
    data.qpos[2] = published.TORSO_HEIGHT
    mujoco.mj_forward(model.mj, data)
    return data


@pytest.mark.parametrize(
    ("link", "height"),
    [
        ("l_hip", published.HIP_HEIGHT),
        ("r_hip", published.HIP_HEIGHT),
        ("torso", published.TORSO_HEIGHT),
        ("neck", published.NECK_HEIGHT),
    ],
)
def test_link_stands_at_its_published_height(zero_pose, link, height):
    assert zero_pose.body(link).xpos[2] == pytest.approx(height, abs=1e-5)


@pytest.mark.parametrize(
    ("camera", "height"),
    [
        ("Camera", published.TOP_CAMERA_HEIGHT),
        ("CameraBottom", published.BOTTOM_CAMERA_HEIGHT),
    ],
)
def test_camera_stands_at_its_published_height(zero_pose, camera, height):
    assert zero_pose.camera(camera).xpos[2] == pytest.approx(height, abs=1e-5)


@pytest.mark.parametrize("facts", H25.cameras, ids=lambda facts: facts.name)
def test_head_camera_looks_forward_and_down_by_its_tilt(zero_pose, facts):
    forward = -zero_pose.camera(facts.name).xmat.reshape(3, 3)[:, 2]
    assert forward == pytest.approx([math.cos(facts.tilt), 0, -math.sin(facts.tilt)], abs=1e-6)


@pytest.mark.parametrize("facts", H25.cameras, ids=lambda facts: facts.name)
def test_camera_sees_its_horizontal_field_of_view(model, facts):
    vertical = math.radians(model.mj.camera(facts.name).fovy[0])
    horizontal = 2 * math.atan(math.tan(vertical / 2) * 4 / 3)
    assert horizontal == pytest.approx(facts.horizontal_fov, abs=1e-6)


def test_soles_touch_the_floor(model, zero_pose):
    for side in ("left", "right"):
        lowest = zero_pose.geom(sole(side)).xpos[2] - model.mj.geom(sole(side)).size[2]
        assert lowest == pytest.approx(0, abs=1e-5)


def test_body_weighs_what_the_facts_say(model):
    mass = sum(float(model.mj.body(link.name).mass[0]) for link in H25.links)
    assert mass == pytest.approx(published.TOTAL_MASS, abs=1e-4)


def test_center_of_mass_is_where_the_facts_say(model, zero_pose):
    torso = model.mj.body("torso").id
    x, y, z = zero_pose.subtree_com[torso]
    assert (x, y, z) == pytest.approx(published.CENTER_OF_MASS, abs=1e-4)


@pytest.mark.parametrize("link", [link for link in H25.links if link.mass], ids=lambda link: link.name)
def test_link_has_its_inertia(model, link):
    body = model.mj.body(link.name)
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, body.iquat)
    axes = flat.reshape(3, 3)
    inertia = axes @ np.diag(body.inertia) @ axes.T
    facts = link.inertia
    assert body.ipos == pytest.approx(link.com)
    assert np.diag(inertia) == pytest.approx([facts.ixx, facts.iyy, facts.izz], rel=1e-3)
    assert inertia[[0, 0, 1], [1, 2, 2]] == pytest.approx([facts.ixy, facts.ixz, facts.iyz], abs=1e-6)


@pytest.mark.parametrize("joint", H25.joints, ids=lambda joint: joint.name)
def test_joint_has_its_range_axis_and_place(model, joint):
    hinge = model.mj.joint(joint.name)
    assert hinge.range == pytest.approx([joint.lower, joint.upper])
    assert hinge.axis == pytest.approx(joint.axis, abs=1e-6)
    assert model.mj.body(joint.child).pos == pytest.approx(joint.origin)


@pytest.mark.parametrize("place", range(len(H25.joints)), ids=H25.joint_names)
def test_motor_of_a_joint_has_its_torque(model, place):
    joint = H25.joints[place]
    motor = model.mj.actuator(int(model.robot.motors[place]))
    assert motor.forcerange == pytest.approx([-joint.max_torque, joint.max_torque])


def test_the_two_hip_yaw_pitch_joints_share_a_motor(model):
    left, right = (H25.joint_names.index(f"{side}HipYawPitch") for side in "LR")
    assert model.robot.motors[left] == model.robot.motors[right]


def test_every_other_joint_has_a_motor_of_its_own(model):
    assert len(set(model.robot.motors.tolist())) == len(H25.joints) - 1


@pytest.mark.parametrize("posture", ["Stand", "StandInit", "StandZero", "Crouch"])
def test_robot_stands_still_in_a_posture(model, posture):
    data = standing(model, H25.postures[posture].angles)
    height = data.body("torso").xpos[2]
    mujoco.mj_step(model.mj, data, nstep=800)
    assert data.body("torso").xpos[2] == pytest.approx(height, abs=0.002)
    assert data.body("torso").xmat[8] > math.cos(math.radians(10))


def test_robot_stands_over_the_origin_and_looks_along_x(model):
    data = standing(model, H25.postures["StandInit"].angles)
    feet = (data.body("l_foot").xpos + data.body("r_foot").xpos) / 2
    assert feet[:2] == pytest.approx([0, 0], abs=0.005)
    assert data.body("torso").xmat[0] == pytest.approx(1, abs=0.02)


def test_skin_changes_nothing_but_the_looks(model):
    dressed = build_model(skin=True)
    assert dressed.mj.body_mass == pytest.approx(model.mj.body_mass)
    touching = [m.mj.geom_contype.astype(bool).sum() for m in (dressed, model)]
    assert touching[0] == touching[1]


def test_larger_images_than_a_software_renderer_manages_are_not_offered(model):
    for camera in model.cameras:
        assert max(camera.sizes) <= (1280, 960)
        assert len(camera.sizes) == len(camera.rates)


def test_a_camera_of_which_no_image_can_be_drawn_is_refused():
    wide = replace(H25.cameras[0], sizes=((1920, 1080),), rates=(30.0,))
    with pytest.raises(RobotError, match="camera Camera: its first size is wider than 1280 pixels"):
        build_model(skin=False, body=replace(H25, cameras=(wide,)))


def test_a_name_that_the_model_has_already_is_refused():
    bumper = TouchSensor(link="torso", field=((0.0, 0.0, 0.0), (0.1, 0.1, 0.1)))
    with pytest.raises(RobotError, match=r"body H25 cannot be simulated: .*repeated name 'acceleration'"):
        build_model(skin=False, body=replace(H25, touch={"acceleration": bumper}))


@pytest.mark.parametrize("name", BODY_NAMES)
def test_the_spectator_sees_all_of_the_robot(name):
    model = build_model(load_world("empty"), body=find_body(name))
    mj, data = model.mj, standing(model, model.body.resting_angles)
    camera = data.camera("CameraOutside")
    own = np.flatnonzero(mj.body_rootid[mj.geom_bodyid] == model.base.body)
    seen = (data.geom_xpos[own] - camera.xpos) @ camera.xmat.reshape(3, 3)  # to the right, up, backwards
    radii = mj.geom_rbound[own]
    half = math.tan(math.radians(mj.camera("CameraOutside").fovy[0]) / 2)
    share = (np.abs(seen[:, 1]) + radii) / (-seen[:, 2] * half)  # of the half of the picture
    assert share.max() < 0.95
    assert (np.abs(seen[:, 0]) + radii).max() < (-seen[:, 2] * half * 4 / 3).min()


def test_the_spectator_of_a_nao_stands_where_it_stood(model):
    assert model.mj.camera("CameraOutside").pos.tolist() == [1.15, -1.6, 0.75]
    assert model.cameras[-1].position == (1.15, -1.6, 0.75)


def test_the_spectator_of_a_tall_robot_is_reported_where_it_stands():
    model = build_model(load_world("empty"), body=find_body("G1"))
    place = model.cameras[-1].position
    assert model.mj.camera("CameraOutside").pos == pytest.approx(place)
    assert place[2] > 1.0
