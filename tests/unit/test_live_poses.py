"""The body in 3D: its geometry is current, and its links are where MuJoCo has them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from importlib import resources
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.body import H25
from visualhfsm.live.poses import BodyGeometry, Pose, load_body

JOINTS = {joint.name: joint for joint in H25.joints}


@pytest.mark.sim
def test_the_geometry_is_current() -> None:
    from naoserver_sim.geometry import describe_body

    packaged = (resources.files("visualhfsm.live") / "nao_h25.json").read_text()
    assert json.loads(packaged) == describe_body(), (
        "type: python -m naoserver_sim.geometry visualhfsm/live/nao_h25.json"
    )


@pytest.mark.sim
@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(0, 1), min_size=len(JOINTS), max_size=len(JOINTS)))
def test_the_links_are_where_the_simulator_has_them(shares: list[float]) -> None:
    import mujoco

    angles = {
        joint.name: joint.lower + share * (joint.upper - joint.lower)
        for joint, share in zip(H25.joints, shares, strict=True)
    }
    model, data = simulated()
    for joint, address in zip(model.robot.joints, model.robot.qpos, strict=True):
        data.qpos[address] = angles[joint.name]
    data.qpos[model.base.qpos : model.base.qpos + 7] = [0, 0, 0, 1, 0, 0, 0]
    mujoco.mj_kinematics(model.mj, data)
    for name, pose in load_body().poses_in_torso(angles).items():
        x, y, z, w = pose.rotation
        assert data.body(name).xpos == pytest.approx(pose.position, abs=1e-5)
        assert abs(np.dot(data.body(name).xquat, (w, x, y, z))) == pytest.approx(1, abs=1e-6)


def simulated():
    import mujoco

    from naoserver_sim.model import build_model

    if not _MODEL:
        model = build_model(skin=False)
        _MODEL.append((model, mujoco.MjData(model.mj)))
    return _MODEL[0]


_MODEL: list[tuple[Any, Any]] = []


def sole_heights(body: BodyGeometry, angles: Mapping[str, float]) -> dict[str, list[float]]:
    from visualhfsm.live.poses import _moved

    poses = body.poses(angles)
    soles = json.loads(body.text)["soles"]
    return {
        foot: [_moved(poses[foot], tuple(point))[2] for point in outline] for foot, outline in soles.items()
    }


def test_the_body_stands_level_on_both_soles_in_its_posture() -> None:
    body = load_body()
    poses = body.poses(H25.facts["postures"]["STAND"])
    for heights in sole_heights(body, H25.facts["postures"]["STAND"]).values():
        assert heights == pytest.approx([0.0] * len(heights), abs=0.002)
    middle = (np.array(poses["l_foot"].position) + poses["r_foot"].position) / 2
    assert middle[:2] == pytest.approx((0, 0), abs=1e-9)
    assert poses["torso"].position[2] == pytest.approx(0.33, abs=0.02)


def test_the_body_leans_with_its_ankles() -> None:
    body = load_body()
    lean = 0.1
    poses = body.poses({"LAnklePitch": lean, "RAnklePitch": lean})
    x, y, z, _ = poses["torso"].rotation
    assert 2 * math.asin(y) == pytest.approx(-lean)
    assert (x, z) == pytest.approx((0, 0))
    assert sole_heights(body, {"LAnklePitch": lean, "RAnklePitch": lean})["l_foot"] == pytest.approx(
        [0.0] * 20, abs=1e-9
    )


def test_the_body_stands_on_the_lower_foot() -> None:
    body = load_body()
    heights = sole_heights(body, {"LHipPitch": -0.6, "LKneePitch": 0.9, "LAnklePitch": -0.3})
    assert min(heights["r_foot"]) == pytest.approx(0.0, abs=1e-9)
    assert min(heights["l_foot"]) > 0.01


def test_the_head_turns_and_nothing_else() -> None:
    body = load_body()
    still, turned = body.poses({}), body.poses({"HeadYaw": 0.5})
    moved = {name for name in still if still[name] != turned[name]}
    assert moved == {"neck", "head"}


def tilt_of(poses: Mapping[str, Pose]) -> float:
    x, y, _, _ = poses["torso"].rotation
    return math.acos(1 - 2 * (x * x + y * y))


@pytest.mark.parametrize("tilt", [0.6, 1.5, 3.0])
@pytest.mark.parametrize("joints", [{}, {"LAnkleRoll": 0.2, "RAnkleRoll": 0.2}])
def test_a_body_that_has_fallen_lies_on_the_floor_as_far_as_it_is_tilted(
    tilt: float, joints: dict[str, float]
) -> None:
    poses = load_body().poses(joints, tilt)
    assert tilt_of(poses) == pytest.approx(tilt)
    assert 0.0 < min(pose.position[2] for pose in poses.values()) < 0.1


def test_a_body_that_stands_about_as_it_is_tilted_stands_on_its_soles() -> None:
    body = load_body()
    assert body.poses({}, 0.1) == body.poses({})
