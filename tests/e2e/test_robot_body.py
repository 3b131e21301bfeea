"""The 3D body in the page: its links are where MuJoCo has them, and it stands and falls by its encoders."""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Iterator, Mapping
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from playwright.sync_api import Browser, Page

from naoserver.body import H25
from tests.support.browser import editor_page
from tests.support.editor import editor

JOINTS = {joint.name: joint for joint in H25.joints}
BODY = json.loads((resources.files("visualhfsm._live") / "nao_h25.json").read_text())
POSE = """async ([described, state]) => {
  const entry = document.querySelector('script[src$="/app.js"]').src;
  const {Body} = await import(entry.replace("app.js", "monitor/body.js"));
  const body = new Body(described);
  body.pose(state);
  return Object.fromEntries([...body.links].map(([name, link]) => [name, link.matrixWorld.elements]));
}"""


class Pose(NamedTuple):
    """Where a link is in the world: position in m, and a rotation matrix."""

    position: np.ndarray
    rotation: np.ndarray


@pytest.fixture(scope="module")
def page(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with editor(tmp_path_factory.mktemp("root")) as running, editor_page(browser, running) as shown:
        yield shown.page


def poses(
    page: Page,
    angles: Mapping[str, float],
    tilt: float | None = None,
    torso: tuple[float, ...] | None = None,
) -> dict[str, Pose]:
    """Return the poses of the links as the page has them."""
    state = {"joints": dict(angles), "tilt": tilt, "torso": torso}
    described = {"links": BODY["links"], "soles": BODY["soles"]}
    found: dict[str, list[float]] = page.evaluate(POSE, [described, state])
    matrices = {name: np.array(elements).reshape(4, 4).T for name, elements in found.items()}
    return {name: Pose(matrix[:3, 3], matrix[:3, :3]) for name, matrix in matrices.items()}


@functools.cache
def simulated() -> tuple[Any, Any]:
    import mujoco

    from naoserver_sim.model import build_model

    model = build_model(skin=False)
    return model, mujoco.MjData(model.mj)


@pytest.mark.sim
@settings(max_examples=20, deadline=None)
@given(shares=st.lists(st.floats(0, 1), min_size=len(JOINTS), max_size=len(JOINTS)))
def test_the_links_are_where_the_simulator_has_them(page: Page, shares: list[float]) -> None:
    import mujoco

    angles = {
        joint.name: joint.lower + share * (joint.upper - joint.lower)
        for joint, share in zip(H25.joints, shares, strict=True)
    }
    model, data = simulated()
    for joint, address in zip(model.robot.joints, model.robot.qpos, strict=True):
        data.qpos[address] = angles[joint.name]
    data.qpos[model.base.qpos : model.base.qpos + 7] = [1, 2, 3, 0.5, 0.5, 0.5, 0.5]
    mujoco.mj_kinematics(model.mj, data)
    for name, pose in poses(page, angles, torso=(1, 2, 3, 0.5, 0.5, 0.5, 0.5)).items():
        assert data.body(name).xpos == pytest.approx(pose.position, abs=1e-5)
        assert data.body(name).xmat.reshape(3, 3) == pytest.approx(pose.rotation, abs=1e-5)


def sole_heights(found: Mapping[str, Pose]) -> dict[str, list[float]]:
    return {
        foot: [float((found[foot].rotation @ point + found[foot].position)[2]) for point in outline]
        for foot, outline in BODY["soles"].items()
    }


def test_the_body_stands_level_on_both_soles_in_its_posture(page: Page) -> None:
    found = poses(page, H25.facts["postures"]["STAND"])
    for heights in sole_heights(found).values():
        assert heights == pytest.approx([0.0] * len(heights), abs=0.002)
    middle = (found["l_foot"].position + found["r_foot"].position) / 2
    assert middle[:2] == pytest.approx((0, 0), abs=1e-9)
    assert found["torso"].position[2] == pytest.approx(0.33, abs=0.02)


def test_the_body_leans_with_its_ankles(page: Page) -> None:
    lean = 0.1
    found = poses(page, {"LAnklePitch": lean, "RAnklePitch": lean})
    back = np.array([[math.cos(lean), 0, -math.sin(lean)], [0, 1, 0], [math.sin(lean), 0, math.cos(lean)]])
    assert found["torso"].rotation == pytest.approx(back, abs=1e-9)
    assert sole_heights(found)["l_foot"] == pytest.approx([0.0] * 20, abs=1e-9)


def test_the_body_stands_on_the_lower_foot(page: Page) -> None:
    heights = sole_heights(poses(page, {"LHipPitch": -0.6, "LKneePitch": 0.9, "LAnklePitch": -0.3}))
    assert min(heights["r_foot"]) == pytest.approx(0.0, abs=1e-9)
    assert min(heights["l_foot"]) > 0.01


def test_the_head_turns_and_nothing_else(page: Page) -> None:
    still, turned = poses(page, {}), poses(page, {"HeadYaw": 0.5})
    moved = {name for name in still if not np.array_equal(still[name].rotation, turned[name].rotation)}
    assert moved == {"neck", "head"}
    assert all(np.array_equal(still[name].position, turned[name].position) for name in still)


@pytest.mark.parametrize("tilt", [0.6, 1.5, 3.0])
@pytest.mark.parametrize("joints", [{}, {"LAnkleRoll": 0.2, "RAnkleRoll": 0.2}])
def test_a_body_that_has_fallen_lies_on_the_floor_as_far_as_it_is_tilted(
    page: Page, tilt: float, joints: dict[str, float]
) -> None:
    found = poses(page, joints, tilt)
    assert math.acos(found["torso"].rotation[2, 2]) == pytest.approx(tilt)
    assert 0.0 < min(pose.position[2] for pose in found.values()) < 0.1


def test_a_body_that_stands_about_as_it_is_tilted_stands_on_its_soles(page: Page) -> None:
    tilted, upright = poses(page, {}, 0.1), poses(page, {})
    for name, pose in upright.items():
        assert np.array_equal(tilted[name].position, pose.position)
        assert np.array_equal(tilted[name].rotation, pose.rotation)
