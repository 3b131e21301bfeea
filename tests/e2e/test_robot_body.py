"""The 3D body in the page: its links are where MuJoCo has them, and it stands and falls by its encoders."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from playwright.sync_api import Browser, Page

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.nao import H25
from naoserver.bodies.parts import Joint, Link
from naoserver.body import Body
from naoserver_sim.named_body import named_body
from tests.support.browser import editor_page
from tests.support.drawn import drawn
from tests.support.editor import editor
from tests.support.meshes import cone, write_stl
from tests.support.plugins import OWN_ROBOTS

NAO = drawn(H25)
LIFT = Body(
    name="Lift",
    links=tuple(Link(name=name, mass=1.0) for name in ("base", "lift", "tray")),
    joints=(
        Joint(
            name="Lift",
            parent="base",
            child="lift",
            axis=(0.0, 0.0, 1.0),
            origin=(0.1, 0.2, 0.3),
            turn=(math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0),
            sliding=True,
            max_velocity=1.0,
            max_torque=1.0,
        ),
    ),
    fixed_joints=(
        Joint(
            name="Tray",
            parent="lift",
            child="tray",
            axis=(0.0, 0.0, 1.0),
            origin=(0.0, 0.0, 1.0),
            turn=(math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)),
            max_velocity=1.0,
            max_torque=1.0,
        ),
    ),
)
"""A lift that slides forwards, because it is turned, with a tray that is turned about that direction."""
POSE = """async ([described, state]) => {
  const entry = document.querySelector('script[src$="/app.js"]').src;
  const {Body} = await import(entry.replace("shell/app.js", "robot3d/body.js"));
  const body = new Body(described);
  body.pose(state);
  return Object.fromEntries([...body.links].map(([name, link]) => [name, link.matrixWorld.elements]));
}"""


EXTENT = """async (described) => {
  const entry = document.querySelector('script[src$="/app.js"]').src;
  const {RobotDrawing} = await import(entry.replace("shell/app.js", "robot3d/robot-drawing.js"));
  const {Box3} = await import("three");
  const drawing = new RobotDrawing(document.createElement("div"));
  drawing.build(described);
  drawing.body.pose({joints: {}, tilt: null, torso: null});
  const {min, max} = new Box3().setFromObject(drawing.body.torso);
  drawing.close();
  return [min.z, max.z];
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
    body: Mapping[str, Any] = NAO,
) -> dict[str, Pose]:
    """Return the poses of the links of a body as the page has them."""
    state = {"joints": dict(angles), "tilt": tilt, "torso": torso}
    described = {"links": body["links"], "soles": body["soles"]}
    found: dict[str, list[float]] = page.evaluate(POSE, [described, state])
    matrices = {name: np.array(elements).reshape(4, 4).T for name, elements in found.items()}
    return {name: Pose(matrix[:3, 3], matrix[:3, :3]) for name, matrix in matrices.items()}


@functools.cache
def simulated(name: str) -> tuple[Any, Any, dict[str, Any]]:
    import mujoco

    from naoserver_sim.model import build_model

    model = build_model(skin=False, body=find_body(name))
    return model, mujoco.MjData(model.mj), drawn(model.body)


@pytest.mark.sim
@settings(
    max_examples=20, deadline=None, phases=[Phase.generate]
)  # a failure is not worth minutes of shrinking
@given(name=st.sampled_from(BODY_NAMES), data=st.data())
def test_the_links_are_where_the_simulator_has_them(page: Page, name: str, data: st.DataObject) -> None:
    import mujoco

    angles = {
        joint.name: data.draw(st.floats(max(joint.lower, -3.0), min(joint.upper, 3.0)))
        for joint in find_body(name).joints
    }
    model, state, described = simulated(name)
    for joint, address in zip(model.robot.joints, model.robot.qpos, strict=True):
        state.qpos[address] = angles[joint.name]
    state.qpos[model.base.qpos : model.base.qpos + 7] = [1, 2, 3, 0.5, 0.5, 0.5, 0.5]
    mujoco.mj_kinematics(model.mj, state)
    for link, pose in poses(page, angles, torso=(1, 2, 3, 0.5, 0.5, 0.5, 0.5), body=described).items():
        assert state.body(link).xpos == pytest.approx(pose.position, abs=1e-5)
        assert state.body(link).xmat.reshape(3, 3) == pytest.approx(pose.rotation, abs=1e-5)


def test_a_link_slides_along_its_turned_axis_and_carries_what_is_fixed_to_it(page: Page) -> None:
    found = poses(page, {"Lift": 0.5}, torso=(0, 0, 0, 0, 0, 0, 1), body=drawn(LIFT))
    assert found["lift"].position == pytest.approx((0.6, 0.2, 0.3))
    assert found["tray"].position == pytest.approx((1.6, 0.2, 0.3))
    assert found["tray"].rotation[:, 1] == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)


@pytest.mark.parametrize(("name", "height"), [("H25", 0.575), ("T1", 1.18), ("G1", 1.32), ("Cart", 0.42)])
def test_the_shell_of_a_body_stands_on_the_floor_and_is_as_high_as_the_robot(
    page: Page, name: str, height: float
) -> None:
    lowest, highest = page.evaluate(EXTENT, drawn(find_body(name)))
    assert lowest == pytest.approx(0.0, abs=0.003)
    assert highest == pytest.approx(height, abs=0.01)


@OWN_ROBOTS
@pytest.mark.sim
def test_a_mesh_of_ones_own_model_is_turned_as_the_model_says(page: Page, tmp_path: Path) -> None:
    write_stl(tmp_path / "cone.stl", cone(0.1, 0.3, sides=48))
    (tmp_path / "own.xml").write_text(
        """<mujoco><asset><mesh file="cone.stl"/></asset><worldbody><body name="base"><freejoint/>
          <geom type="mesh" mesh="cone" euler="0 90 0" pos="0.4 0 1"/></body></worldbody></mujoco>"""
    )
    (tmp_path / "own.toml").write_text('model = "own.xml"\n')
    lowest, highest = page.evaluate(EXTENT, drawn(named_body(tmp_path / "own.toml")))
    assert (lowest, highest) == (pytest.approx(0.0, abs=0.001), pytest.approx(0.2, abs=0.002))


def sole_heights(found: Mapping[str, Pose]) -> dict[str, list[float]]:
    return {
        foot: [float((found[foot].rotation @ point + found[foot].position)[2]) for point in outline]
        for foot, outline in NAO["soles"].items()
    }


def test_the_body_stands_level_on_both_soles_in_its_posture(page: Page) -> None:
    found = poses(page, H25.postures["Stand"].angles)
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
