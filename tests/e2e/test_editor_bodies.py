"""Another robot than the Nao in the page: chosen, simulated, tried, and seen in 3D, in Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from naoserver.bodies import find_body
from tests.support.arm import ARM, ARM_TOML
from tests.support.browser import EditorPage, editor_page
from tests.support.limits import RUN_LIMIT
from tests.support.monitor import comes_true, editor_without_robot, monitor_page, robot_and_editor, status
from tests.support.plugins import OWN_ROBOTS
from tests.support.processes import children

STARTED = RUN_LIMIT * 1000
LINKS = """(names) => {
  const body = document.querySelector("hfsm-robot-view")?.drawing?.body;
  return body?.torso.visible && names.every((name) => body.links.has(name));
}"""
ON_THE_FLOOR = """() => {
  const {height} = document.querySelector("hfsm-robot-view").drawing.body.size;
  return height > 0.3 && height < 1;
}"""

PICTURES = """() => {
  const images = [...document.querySelectorAll("hfsm-start .robot-cards img")];
  return images.length === 5 && images.every((each) => each.naturalWidth === 144);
}"""


@pytest.fixture
def shown(browser: Browser, tmp_path: Path) -> Iterator[EditorPage]:
    robots = tmp_path / "robots"
    robots.mkdir()
    (robots / "arm.toml").write_text(ARM_TOML)
    (robots / "arm.urdf").write_text(ARM)
    (robots / "faulty.toml").write_text('model = "arm.urdf"\nmounted = 7\n')
    with editor_without_robot(tmp_path) as running, editor_page(browser, running) as shown:
        yield shown
    assert not children("naoserver_sim")


@OWN_ROBOTS
@pytest.mark.sim
def test_a_robot_of_the_project_is_chosen_on_the_start_page_and_seen_in_3d(shown: EditorPage) -> None:
    page = shown.page
    choice = page.get_by_role("radiogroup", name="Robot")
    expect(choice.get_by_role("radio", name="Nao H25")).to_be_checked()
    expect(choice.get_by_role("radio")).to_have_count(7)
    comes_true(shown, PICTURES)  # those that come with the page
    assert shown.violations("hfsm-start") == []
    choice.get_by_text("faulty").click()
    shown.button("No robot: start a simulation").click()
    expect(page.get_by_text("robots/faulty.toml:2")).to_be_visible(timeout=STARTED)
    choice.get_by_text("An arm").click()
    shown.button("No robot: start a simulation").click()
    expect(page.get_by_role("button", name="Simulated An arm")).to_be_visible(timeout=STARTED)
    shown.button("Empty Start with a blank sheet.").click()
    shown.press("Alt+l")
    expect(page.get_by_role("tab", name="3D")).to_have_attribute("aria-selected", "true")
    comes_true(shown, LINKS, ["base", "upper", "hand"])
    assert page.evaluate(f"({ON_THE_FLOOR})()")
    expect(page.locator(".view-tools").get_by_role("button", name="Head")).to_have_count(
        0
    )  # it has no camera

    shown.press("Alt+b")
    menu = page.get_by_role("dialog", name="Robot")
    expect(menu.get_by_label("Robot")).to_have_value("robots/arm.toml")
    menu.get_by_label("Robot").select_option("H21")
    shown.button("Restart the simulation with these").click()
    expect(page.get_by_role("button", name="Simulated Nao H21")).to_be_visible(timeout=STARTED)
    comes_true(shown, LINKS, ["torso", "l_foot", "r_foot"])
    expect(page.locator(".view-tools").get_by_role("button", name="Head")).to_be_visible()


def test_try_it_moves_the_robot_that_was_chosen(shown: EditorPage) -> None:
    page = shown.page
    page.get_by_role("radiogroup", name="Robot").get_by_text("Booster T1").click()
    shown.button("Dance Both arms move from pose to pose.").click()
    page.locator(".state").first.wait_for()
    shown.press("Alt+Shift+t")
    expect(status(shown)).to_contain_text("Trying", timeout=STARTED)
    page.get_by_role("tab", name="3D").click()
    comes_true(shown, LINKS, [link.name for link in find_body("T1").links])
    page.get_by_role("tab", name="Joints").click()
    row = page.get_by_role("row").filter(has_text=find_body("T1").groups.left_arm[0])
    expect(row).to_be_visible()


@OWN_ROBOTS
@pytest.mark.sim
def test_a_run_is_on_the_robot_that_is_lit_on_the_start_page(shown: EditorPage) -> None:
    page = shown.page
    cards = page.get_by_role("radiogroup", name="Robot")
    cards.get_by_text("An arm").click()
    shown.button("No robot: start a simulation").click()
    expect(page.get_by_role("button", name="Simulated An arm")).to_be_visible(timeout=STARTED)
    shown.press("Alt+b")
    menu = page.get_by_role("dialog", name="Robot")
    menu.get_by_label("Robot").select_option("H21")
    expect(cards.get_by_role("radio", name="Nao H21")).to_be_checked()
    shown.press("Escape")
    shown.button("Dance Both arms move from pose to pose.").click()
    page.locator(".state").first.wait_for()
    shown.press("F5")
    expect(status(shown)).to_have_text("Running", timeout=STARTED)
    expect(page.get_by_role("button", name="Simulated Nao H21")).to_be_visible()

    shown.press("Alt+b")
    menu.get_by_label("Robot").select_option("T1")
    shown.press("Escape", "F5")
    page.get_by_role("dialog", name="dance runs").get_by_role("button", name="Run again").click()
    asked = page.get_by_role("dialog", name="Another robot is chosen")
    expect(asked).to_contain_text("dance runs on Nao H21. Restart the simulation with T1 and run?")
    asked.get_by_role("button", name="Run here").click()
    expect(asked).to_have_count(0)
    shown.press("Alt+b")
    expect(menu.get_by_label("Robot")).to_have_value("H21")


def test_a_robot_of_somebody_else_leaves_no_choice_on_the_start_page(
    browser: Browser, tmp_path: Path
) -> None:
    with (
        robot_and_editor(tmp_path / "walk.xml") as (_, running),
        monitor_page(browser, running) as shown,
    ):
        page = shown.page
        page.locator(".robot-pill.here").wait_for()
        shown.press("Alt+w")
        page.get_by_role("heading", name="Draw what your robot does").wait_for()
        expect(page.get_by_role("radiogroup", name="Robot")).to_have_count(0)


@OWN_ROBOTS
@pytest.mark.sim
def test_the_tour_runs_on_the_robot_that_is_lit_and_says_when_that_cannot_be(shown: EditorPage) -> None:
    page = shown.page
    cards = page.get_by_role("radiogroup", name="Robot")
    cards.get_by_text("Nao H21").click()
    shown.button("No robot: start a simulation").click()
    expect(page.get_by_role("button", name="Simulated Nao H21")).to_be_visible(timeout=STARTED)
    cards.get_by_text("An arm").click()
    shown.button("Take the tour").click()
    tour = page.get_by_role("dialog", name="The canvas")
    tour.wait_for()
    for _ in range(7):
        shown.press("ArrowRight")
    expect(page.get_by_role("dialog", name="It does not run")).to_be_visible(timeout=STARTED)
    expect(page.get_by_role("button", name="Simulated An arm")).to_be_visible()
