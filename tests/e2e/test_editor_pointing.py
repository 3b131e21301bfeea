"""Places by a click: the selected state gets the place at which somebody points in 3D, and a mark shows it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from codegen.hfsm.document import Document
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.browser import EditorPage, editor_page, saved
from tests.support.monitor import comes_true, monitor_page, robot_and_editor, run
from tests.support.robot_server import eventually

SHOWN = "() => document.querySelector('hfsm-robot-view')?.pointing?.drawing.body?.torso.visible"
ON_SCREEN = """async ([x, y, z]) => {
  const {drawing} = document.querySelector("hfsm-robot-view");
  const {Vector3} = await import("three");
  await drawing.drawn();
  const {left, top, width, height} = drawing.stage.getBoundingClientRect();
  const at = new Vector3(x, y, z).project(drawing.viewpoints.camera);
  return [left + (1 + at.x) * width / 2, top + (1 - at.y) * height / 2];
}"""
MARK = """() => {
  const {mark} = document.querySelector("hfsm-robot-view").pointing;
  return mark.visible ? mark.position.toArray() : null;
}"""
STAND = """() => {
  const {torso, head, eye} = document.querySelector("hfsm-robot-view").drawing.body;
  return [...torso.position.toArray(), ...head.localToWorld(torso.position.clone().fromArray(eye.position)).toArray()];
}"""


@pytest.fixture
def shown(browser: Browser, tmp_path: Path) -> Iterator[EditorPage]:
    with robot_and_editor(tmp_path / "walk.xml") as (_, running), monitor_page(browser, running) as shown:
        shown.show_robot()
        comes_true(shown, SHOWN)
        shown.page.locator(".view-tools").get_by_role("button", name="Top").click()  # nothing hides the floor
        yield shown


def draw(shown: EditorPage, title: str) -> None:
    """Draw a ready state, and select it."""
    shown.page.get_by_role("option", name=title, exact=True).click()
    shown.state(title.lower()).click()


def arguments(document: Document, state: str) -> dict[str, float]:
    assert document.root is not None
    (found,) = (each for each in document.root.states if each.name == state)
    return {each.name: float(each.value.text) for each in found.arguments}


def point_at(shown: EditorPage, *place: float) -> None:
    shown.page.mouse.click(*shown.page.evaluate(ON_SCREEN, place))


def test_a_place_that_is_pointed_at_becomes_the_arguments_of_the_selected_state_in_one_step(
    shown: EditorPage, tmp_path: Path
) -> None:
    hint = shown.page.locator(".robot-hint")
    draw(shown, "Walk to")
    expect(hint).to_have_text("Click a place for the state “walk to”.")
    expect(hint).to_be_visible()
    expect(shown.page.locator(".pointable canvas")).to_have_css("cursor", "crosshair")
    x, y, _, *eye = shown.page.evaluate(STAND)
    comes_true(shown, f"() => Math.abs(({MARK})()?.[0] - {x} - 0.5) < 0.01")  # by default
    point_at(shown, x + 0.3, y + 0.2, 0.0)
    comes_true(shown, f"() => Math.abs(({MARK})()[0] - {x} - 0.3) < 0.02 && ({MARK})()[1] > {y} + 0.1")
    found = arguments(saved(shown, tmp_path / "walk.xml"), "walk to")
    assert found == pytest.approx({"forward": 0.3, "left": 0.2, "turn": 0.0}, abs=0.02)

    shown.press("Escape", "Control+z")  # one step
    shown.state("walk to").click()
    comes_true(shown, f"() => Math.abs(({MARK})()?.[0] - {x} - 0.5) < 0.01")
    assert arguments(saved(shown, tmp_path / "walk.xml"), "walk to") == {
        "forward": 0.5,
        "left": 0.0,
        "turn": 0.0,
    }

    draw(shown, "Turn")
    point_at(shown, x, y + 0.3, 0.0)
    comes_true(shown, f"() => Math.abs(({MARK})()[1] - {y} - 1) < 0.05")
    draw(shown, "Look at")
    point_at(shown, x + 0.3, y + 0.3, 0.0)
    comes_true(shown, f"() => ({MARK})()?.[2] < 0.05 && Math.abs(({MARK})()[0] - {x} - 0.3) < 0.05")
    document = saved(shown, tmp_path / "walk.xml")
    assert arguments(document, "turn") == pytest.approx({"left": 90.0}, abs=3.0)
    looks = arguments(document, "look at")
    assert looks["speed"] == 0.3
    assert math.tan(math.radians(-looks["up"])) == pytest.approx(
        eye[2] / math.hypot(x + 0.3 - eye[0], y + 0.3 - eye[1]), abs=0.1
    )

    # To turn the view, or to click while another state is selected, says nothing.
    mouse = shown.page.mouse
    mouse.move(*shown.page.evaluate(ON_SCREEN, [x + 0.3, y, 0.0]))
    mouse.down()
    mouse.move(900, 500, steps=4)
    mouse.up()
    shown.state("go").click()
    eventually(lambda: shown.page.evaluate(MARK) is None)
    point_at(shown, x + 0.3, y - 0.3, 0.0)
    expect(hint).not_to_contain_text("Click a place")
    assert saved(shown, tmp_path / "walk.xml") == document


@pytest.mark.sim
def test_the_place_of_a_walk_stays_where_it_is_while_the_robot_walks_there(
    browser: Browser, tmp_path: Path
) -> None:
    empty = '<VisualHFSM><SubAutomata id="1" idFather="0"/></VisualHFSM>'
    nao = SimulatedRobot(skin=False, world=load_world("room"))
    with (
        robot_and_editor(tmp_path / "go.xml", empty, nao) as (_, running),
        editor_page(browser, running) as shown,
    ):
        shown.show_robot()
        comes_true(shown, SHOWN)
        shown.page.locator(".view-tools").get_by_role("button", name="Top").click()
        draw(shown, "Walk to")
        x, y, *_ = shown.page.evaluate(STAND)
        point_at(shown, x + 0.3, y + 0.2, 0.0)
        comes_true(shown, f"() => Math.abs(({MARK})()?.[0] - {x} - 0.3) < 0.02")
        place = shown.page.evaluate(MARK)
        run(shown)
        comes_true(shown, f"() => ({STAND})()[0] > {x} + 0.15")
        assert shown.page.evaluate(MARK) == pytest.approx(place, abs=0.03)
