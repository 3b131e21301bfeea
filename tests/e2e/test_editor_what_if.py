"""What if a part of the robot fails? It is picked in a list or in 3D, seen in red, and healed, while the run goes on."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import pytest
from playwright.sync_api import Browser, Locator, expect

from interfaces.nao import FaultsPrx
from naoserver.fake import FakeRobot
from naoserver.protocol.faults import Faults
from naoserver.robot import Robot
from tests.support.browser import Box, EditorPage, editor_page, new_context, shared_address
from tests.support.editor import Editor
from tests.support.monitor import (
    DOCUMENT,
    comes_true,
    expect_current,
    monitor_page,
    robot_and_editor,
    run,
    status,
)
from tests.support.robot_server import ServedRobot, eventually

IS_DRAWN = "() => document.querySelector('hfsm-robot-view')?.drawing?.body?.torso.visible"
PAINT = """part => {
  const {drawing, whatIf} = document.querySelector("hfsm-robot-view");
  const {red, chosen} = whatIf.painting;
  const shapes = drawing.body.shapesOf(part);
  const are = (paint) => shapes.length > 0 && shapes.every(({material}) => material === paint);
  return are(red) ? "red" : are(chosen) ? "chosen" : "";
}"""
"""The paint of all shapes of a part."""
PLACE = """async part => {
  const {drawing} = document.querySelector("hfsm-robot-view");
  await drawing.drawn();
  const [shape] = drawing.body.shapesOf(part);
  shape.geometry.computeBoundingSphere();
  const at = shape.localToWorld(shape.geometry.boundingSphere.center.clone()).project(drawing.viewpoints.camera);
  const {left, top, width, height} = drawing.stage.getBoundingClientRect();
  return [left + (1 + at.x) * width / 2, top + (1 - at.y) * height / 2];
}"""
"""Where a part is on the screen."""


@pytest.fixture
def document() -> str:
    return DOCUMENT


@pytest.fixture
def shown(live_page: EditorPage, robot: ServedRobot) -> Iterator[EditorPage]:
    yield live_page
    faults_of(robot).heal()


class Unfailing:
    """A robot that fails by itself only, as a real one does."""

    faults = None

    def __init__(self, robot: FakeRobot) -> None:
        self._robot = robot

    def __getattr__(self, name: str) -> Any:
        return getattr(self._robot, name)


def ask(shown: EditorPage) -> Locator:
    """Ask what should fail, by the keyboard, and wait until the robot is drawn."""
    shown.press("Control+k")
    shown.type("what if")
    shown.press("Enter")
    section = shown.page.get_by_role("region", name="What if…")
    expect(section.get_by_role("combobox", name="Part that is to fail")).to_be_focused()
    comes_true(shown, IS_DRAWN)
    return section


def faults_of(robot: ServedRobot) -> Faults:
    faults = robot.robot.faults
    assert faults is not None
    return faults


def failures(robot: ServedRobot) -> dict[tuple[str, str], float]:
    return {of: fault.amount for of, fault in faults_of(robot).current().items()}


def chosen(section: Locator) -> Locator:
    return section.locator("[role=option][aria-selected=true]")


def test_a_part_is_found_by_keys_fails_is_seen_and_heals_while_the_run_goes_on(
    shown: EditorPage, robot: ServedRobot
) -> None:
    run(shown)
    section = ask(shown)
    groups = [
        each.get_attribute("aria-label") for each in section.locator("[role=listbox] > [role=group]").all()
    ]
    assert groups == [
        "Joints and motors",
        "Senses, lights and voice",
        "Cameras",
        "Server and network",
    ]  # nothing pulls at a fake robot
    shown.type("knee")
    expect(section.locator("[role=option]")).to_have_text(["LKneePitch", "RKneePitch"])
    shown.press("ArrowDown")
    expect(chosen(section)).to_have_text("RKneePitch")
    comes_true(shown, f"() => ({PAINT})('RKneePitch') === 'chosen'")
    shown.press("Enter")
    expect(section.get_by_role("combobox", name="How RKneePitch fails")).to_be_focused()
    shown.type("limp")
    shown.press("Tab", "Enter")
    heal = section.get_by_role("button", name="Heal RKneePitch: limp")
    expect(heal).to_be_visible()
    assert failures(robot) == {("RKneePitch", "limp"): 0.0}
    comes_true(shown, f"() => ({PAINT})('RKneePitch') === 'red' && ({PAINT})('LKneePitch') === ''")
    said = shown.page.locator("hfsm-robot-view p.for-readers")
    expect(said).to_have_text("RKneePitch fails: limp")
    assert shown.violations(".what-if") == []

    section.get_by_role("combobox", name="Part that is to fail").fill("camera")
    section.get_by_role("combobox", name="How Camera fails").select_option("blurred")
    amount = section.get_by_role("spinbutton", name="How much: 0.5 to 20 pixels")
    expect(amount).to_have_value("4")
    amount.fill("7.5")
    amount.press("Enter")
    expect(section.get_by_role("button", name="Heal Camera: blurred 7.5 pixels")).to_be_visible()
    assert failures(robot)[("Camera", "blurred")] == 7.5

    heal.focus()
    shown.press("Enter")
    expect(heal).to_have_count(0)
    expect(said).to_have_text("RKneePitch works again, no longer limp")
    comes_true(shown, f"() => ({PAINT})('RKneePitch') === ''")
    shown.press("Tab", "Tab", "Enter")  # from the list: Camera, all
    expect(section.get_by_role("button", name="Heal all")).to_have_count(0)
    assert failures(robot) == {}
    expect(status(shown)).to_have_text("Running")
    expect_current(shown, "wait")


def test_a_run_that_is_looked_back_at_shows_what_failed_and_why_not_names_it(
    shown: EditorPage, robot: ServedRobot
) -> None:
    moment = shown.page.get_by_role("slider", name="Moment of the run")
    lanes = shown.page.locator(".timeline.compact .lane-names")
    bubble = shown.page.locator(".why-not")
    run(shown)
    shown.button("Record").click()
    expect(lanes.get_by_text("wait")).to_be_visible()
    expect(lanes.get_by_text("Fails")).to_have_count(0)
    faults_of(robot).inject("LKneePitch", "stuck")
    expect(lanes.get_by_text("Fails")).to_be_visible()
    expect(moment).to_have_attribute("aria-valuetext", re.compile("Made to fail: LKneePitch stuck"))
    shown.state("wait").hover()
    expect(bubble).to_contain_text("Made to fail: LKneePitch stuck")
    shown.page.mouse.move(0, 0)
    faults_of(robot).inject("Camera", "late", 0.5)
    expect(moment).to_have_attribute("aria-valuetext", re.compile("LKneePitch stuck, Camera late 0.5"))
    faults_of(robot).heal()
    expect(moment).not_to_have_attribute("aria-valuetext", re.compile("fail"))
    shown.button("End the recording").click()
    shown.button("Play it").click()
    expect(status(shown)).to_have_text("Recording")
    expect(lanes.get_by_text("Fails")).to_be_visible()

    moment.focus()
    shown.press("End")
    expect(moment).not_to_have_attribute("aria-valuetext", re.compile("fail"))
    shown.state("wait").hover()
    expect(bubble).to_contain_text("its guard count > 1000000 was false when it was evaluated last")
    expect(bubble).not_to_contain_text("Made to fail")
    shown.page.mouse.move(0, 0)
    for _ in range(100):
        shown.press("ArrowLeft")
        if "Camera" in (moment.get_attribute("aria-valuetext") or ""):
            break
    expect(moment).to_have_attribute("aria-valuetext", re.compile("LKneePitch stuck, Camera late 0.5"))
    shown.show_robot()
    comes_true(shown, IS_DRAWN)
    comes_true(shown, f"() => ({PAINT})('LKneePitch') === 'red' && ({PAINT})('RKneePitch') === ''")
    shown.state("wait").hover()
    expect(bubble).to_contain_text("Made to fail: LKneePitch stuck, Camera late 0.5")
    assert shown.violations(".timeline") == []


def test_a_refusal_is_shown_in_the_words_of_the_robot(shown: EditorPage, robot: ServedRobot) -> None:
    section = ask(shown)
    section.get_by_role("combobox", name="How HeadYaw fails").select_option("offset")
    amount = section.get_by_role("spinbutton", name="How much: -0.5 to 0.5 rad")
    amount.fill("9")
    amount.press("Enter")
    hint = shown.page.locator(".robot-hint")
    expect(hint).to_have_text("HeadYaw offset: the amount is 9, and must be from -0.5 to 0.5 rad")
    assert failures(robot) == {}
    robot.assembly.gate.stop("a hand in the way")
    amount.fill("0.2")
    amount.press("Enter")
    expect(hint).to_contain_text("a hand in the way")
    robot.assembly.gate.reset(resume=True)
    amount.press("Enter")
    expect(section.get_by_role("button", name="Heal HeadYaw: offset 0.2 rad")).to_be_visible()
    expect(hint).to_contain_text("Click a part of the robot")


def test_a_click_in_3d_chooses_the_part_and_again_what_else_is_there(shown: EditorPage) -> None:
    section = ask(shown)
    shown.type("sonar")
    expect(chosen(section)).to_have_text("Sonar")
    page = shown.page
    page.mouse.click(*page.evaluate(PLACE, "RKneePitch"))
    expect(chosen(section)).to_have_text("RKneePitch")
    expect(section.get_by_role("combobox", name="Part that is to fail")).to_have_value("")
    head = page.evaluate(PLACE, "HeadPitch")
    for part in ("HeadYaw", "HeadPitch", "HeadFront"):
        page.mouse.click(*head)
        expect(chosen(section)).to_have_text(part)
    expect(chosen(section)).to_be_in_viewport()
    page.locator(".view-tools").get_by_role("button", name="What if…").click()
    expect(section).to_have_count(0)
    comes_true(shown, f"() => ({PAINT})('HeadFront') === ''")


def test_what_others_let_fail_is_seen_by_all_in_their_language_and_on_a_phone(
    browser: Browser, shown: EditorPage, robot: ServedRobot
) -> None:
    ask(shown)
    with robot.client() as client, contextlib.closing(new_context(browser, "es")) as context:
        faults = client.proxy(FaultsPrx, "Faults")
        viewer = context.new_page()
        viewer.goto(shared_address(shown))
        faults.inject("LElbowRoll", "stuck")
        heal = shown.button("Heal LElbowRoll: stuck")
        expect(heal).to_be_visible()
        viewer.locator(".dock .stage canvas").wait_for()
        eventually(lambda: viewer.evaluate(f"() => {IS_DRAWN[6:]} && ({PAINT})('LElbowRoll')") == "red")
        expect(viewer.locator("hfsm-robot-view p.for-readers")).to_have_text("LElbowRoll falla: stuck")
        assert viewer.locator(".what-if-button").count() == 0

        shown.page.set_viewport_size({"width": 390, "height": 844})
        submit = shown.button("Let it fail")
        submit.scroll_into_view_if_needed()
        for each in (submit, shown.page.locator(".what-if select"), shown.page.locator(".what-if .files")):
            assert Box.of(each).is_within(Box.of(shown.page.locator(".side")))
        heal.click()
        expect(heal).to_have_count(0)
        assert failures(robot) == {}


def test_in_spanish_it_says_how_a_part_can_fail(browser: Browser, followed: Editor) -> None:
    with editor_page(browser, followed, language="es") as shown:
        shown.page.locator("hfsm-canvas .state").first.wait_for()
        shown.press("Control+k")
        shown.type("Y si")
        shown.press("Enter")
        section = shown.page.get_by_role("region", name="Y si…")
        how = section.get_by_role("combobox", name="Cómo falla HeadYaw")
        expect(how).to_contain_text("stuck: ya no gira, haga lo que haga su motor")


def test_nothing_is_offered_where_no_faults_are_served(browser: Browser, tmp_path: Path) -> None:
    nao = cast("Robot", Unfailing(FakeRobot()))
    with (
        robot_and_editor(tmp_path / "walk.xml", nao=nao) as (_, running),
        monitor_page(browser, running) as shown,
    ):
        shown.show_robot()
        comes_true(shown, IS_DRAWN)
        shown.press("Alt+l")
        shown.page.get_by_role("tab", name="3D").click()
        expect(shown.page.locator(".side .view-tools").get_by_role("button", name="Home")).to_be_visible()
        expect(shown.button("What if…")).to_have_count(0)
        shown.press("Control+k")
        shown.type("what if")
        expect(shown.page.get_by_text("No action with these words is possible now.")).to_be_visible()
        shown.press("Escape")
        shown.page.get_by_role("menubar").get_by_role("menuitem", name="View").click()
        expect(shown.page.get_by_role("menuitem", name="Robot in 3D")).to_be_visible()
        expect(shown.page.get_by_role("menuitem", name="What if…")).to_have_count(0)
        shown.press("Escape")
