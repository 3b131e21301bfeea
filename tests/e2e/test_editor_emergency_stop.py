"""The robot's emergency stop on the page: it is shown while it is latched, and can be reset."""

from __future__ import annotations

import re
from pathlib import Path

from playwright.sync_api import Browser, expect

from interfaces.nao import PoseHeadPrx, SafetyPrx
from tests.support.monitor import (
    DOCUMENT,
    expect_current,
    follow,
    monitor_page,
    robot_and_editor,
    run,
    started_elsewhere,
    status,
)


def test_the_robot_that_was_stopped_is_reset_in_every_window(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "walk.xml"
    with robot_and_editor(path) as (robot, editor), robot.client() as client:
        safety = client.proxy(SafetyPrx, "Safety")
        with monitor_page(browser, editor) as shown, monitor_page(browser, editor) as other:
            banners = [
                each.page.get_by_role("alert").filter(has_text="The robot is stopped")
                for each in (shown, other)
            ]
            with started_elsewhere(robot, path) as process:
                follow(shown, "walk")
                shown.press("Control+Shift+Space")
                assert process.wait() == 0
            expect(status(shown)).to_contain_text("Ended")
            for banner in banners:
                expect(banner).to_contain_text("STOP was pressed in the editor")
            assert safety.getSafetyState().stopped
            banners[1].get_by_role("button", name="Reset the emergency stop").click()
            for banner in banners:
                expect(banner).to_have_count(0)
            client.proxy(PoseHeadPrx, "Head").setPose(0.5, 0.0, 0.5)


def test_the_robot_is_stopped_also_when_nothing_is_followed(browser: Browser, tmp_path: Path) -> None:
    with (
        robot_and_editor(tmp_path / "walk.xml") as (robot, editor),
        robot.client() as client,
        monitor_page(browser, editor) as shown,
    ):
        shown.press("Control+Shift+Space")
        expect(shown.page.get_by_role("alert").filter(has_text="The robot is stopped")).to_be_visible()
        assert client.proxy(SafetyPrx, "Safety").getSafetyState().stopped


def test_a_component_that_the_stop_pauses_says_so_and_goes_on(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "walk.xml"
    head = "<nameinterface>head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface>"
    commanding = DOCUMENT.replace("count += 1", "self.head.setPose(0.1, 0.0, 0.5)").replace(
        "</VisualHFSM>", f"<config><iceinterface>{head}</iceinterface></config></VisualHFSM>"
    )
    with (
        robot_and_editor(path, commanding) as (robot, editor),
        robot.client() as client,
        monitor_page(browser, editor) as shown,
        started_elsewhere(robot, path),
    ):
        safety = client.proxy(SafetyPrx, "Safety")
        follow(shown, "walk")
        safety.emergencyStop("a hand in the way")
        expect(status(shown)).to_have_text("Paused: command refused")
        expect(status(shown)).to_have_attribute(
            "title", re.compile("the robot is stopped: a hand in the way")
        )
        safety.resetEmergencyStop()
        expect(status(shown)).to_have_text("Running")


def test_all_that_runs_is_stopped_under_any_name_with_a_menu_open(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "follow me.xml"
    with robot_and_editor(path) as (_, editor), monitor_page(browser, editor) as shown:
        run(shown)
        expect_current(shown, "wait")
        shown.press("Alt+Shift+a")
        expect(status(shown)).to_have_count(0)
        shown.button("1 running").click()
        expect(shown.page.get_by_role("menuitem", name="follow_me")).to_be_focused()
        assert shown.page.evaluate(STOP_AREA)[0] >= shown.page.evaluate(
            "() => document.querySelector('.menu').getBoundingClientRect().right"
        ), "a part of the menu lies under STOP"
        shown.press("Control+Shift+Space")
        expect(shown.page.locator(".notice").filter(has_text="Stopped: ")).to_contain_text("follow_me")
        expect(shown.button("Nothing runs")).to_be_visible()
        expect(shown.button("STOP the robot and all that runs")).to_be_visible()


STOP_AREA = """() => {
  const button = document.querySelector(".stop-button");
  const {left, right, top, bottom} = button.getBoundingClientRect();
  return [left, right, top, document.elementFromPoint(left + 3, (top + bottom) / 2) === button];
}"""
WIDTHS = (320, 390, 480, 560, 640, 683, 768, 800, 860, 900, 960, 1018, 1100, 1280, 1440, 1920)


def test_stop_is_inside_the_window_in_every_width_and_state(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "a behavior with a long name.xml"
    (tmp_path / "other.xml").write_text(DOCUMENT)
    outside: list[str] = []
    with robot_and_editor(path) as (_, editor), monitor_page(browser, editor) as shown:

        def measure(state: str) -> None:
            for width in WIDTHS:
                shown.page.set_viewport_size({"width": width, "height": 800})
                left, right, top, is_above = shown.page.evaluate(STOP_AREA)
                if not (0 <= left < right <= width and top < 50 and is_above):
                    where = f"{left:g} to {right:g}, {top:g} px below the top"
                    outside.append(f"{state}, {width} px: {where}{'' if is_above else ', covered'}")
            shown.page.set_viewport_size({"width": 1280, "height": 800})

        measure("nothing runs")
        run(shown)
        measure("running")
        shown.button("1 running").click()
        expect(shown.page.get_by_role("menuitem", name="followed")).to_be_focused()
        measure("a menu is open")
        shown.press("Escape")
        shown.state("go").locator(".body").click()
        shown.press("b")
        shown.transition("late").locator(".handle").click()
        shown.press("Alt+Enter")
        expect(status(shown)).to_have_text("At a breakpoint")
        measure("at a breakpoint")
        shown.press("F10")
        expect(status(shown)).to_have_text("Paused")
        measure("paused")
        shown.press("F8")
        expect(status(shown)).to_have_text("Running")
        shown.page.get_by_role("slider", name="Moment of the run").focus()
        shown.press("Home")
        expect(status(shown)).to_have_text("Looking back")
        measure("looking back")
        shown.press("Control+o")
        shown.page.get_by_role("option", name="other.xml").dblclick()
        expect(shown.button("Show a behavior with a long name.xml")).to_be_visible()
        measure("another document is shown")
        shown.button("Show a behavior with a long name.xml").click()
        shown.button("Back to now").click()
        shown.press("Control+Shift+Space")
        expect(status(shown)).to_have_text("Ended: stopped by STOP")
        measure("ended")
        shown.button("Start page").click()
        expect(shown.page.locator("hfsm-start")).to_be_visible()
        measure("start page")
    assert not outside, "\n".join(outside)
