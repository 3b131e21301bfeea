"""The positions of the body's parts: compared with MuJoCo, and with measurements at rest."""

from functools import cache

import mujoco
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.body import H25
from naoserver.kinematics import angles_of, place_of, rotation
from naoserver_sim.model import build_model
from tests.support.examples import examples

pytestmark = pytest.mark.sim


@cache
def model():
    return build_model(skin=False)


@settings(max_examples=examples(40))
@given(st.lists(st.floats(0.0, 1.0), min_size=len(H25.joints), max_size=len(H25.joints)))
def test_joints_are_where_mujoco_has_their_links(shares):
    angles = {
        joint.name: joint.lower + share * (joint.upper - joint.lower)
        for joint, share in zip(H25.joints, shares, strict=True)
    }
    data = mujoco.MjData(model().mj)
    for joint, angle in angles.items():
        if not joint.endswith("Hand"):
            data.joint(joint).qpos[0] = angle
    mujoco.mj_kinematics(model().mj, data)
    torso = data.body("torso")
    axes = torso.xmat.reshape(3, 3)
    for name in ("HeadPitch", "LWristYaw", "RElbowRoll", "LAnkleRoll", "RHipYawPitch"):
        body = data.body(next(joint.child for joint in H25.joints if joint.name == name))
        place = place_of(name, angles)
        assert place[:3, 3] == pytest.approx(axes.T @ (body.xpos - torso.xpos), abs=1e-9)
        assert place[:3, :3] == pytest.approx(axes.T @ body.xmat.reshape(3, 3), abs=1e-9)


def test_effectors_at_rest():
    angles = dict.fromkeys(H25.joint_names, 0.0)
    checks = H25.facts["checks"]
    assert place_of("LArm", angles)[0, 3] == pytest.approx(checks["arm_reach_shoulder_to_hand_point"])
    assert place_of("RLeg", angles)[2, 3] == pytest.approx(-checks["torso_height_above_sole_zero_pose"])
    camera = place_of("CameraTop", angles)
    assert camera[2, 3] + checks["torso_height_above_sole_zero_pose"] == pytest.approx(
        checks["top_camera_height_zero_pose"], abs=1e-4
    )
    assert angles_of(camera) == pytest.approx((0.0, H25.cameras[0].tilt, 0.0))


def test_angles_are_those_about_x_then_y_then_z():
    turned = rotation((0, 0, 1), 0.3) @ rotation((0, 1, 0), -0.2) @ rotation((1, 0, 0), 0.1)
    assert angles_of(turned) == pytest.approx((0.1, -0.2, 0.3))
