"""The robot's emergency stop on the page: it is shown while it is latched, and can be reset."""

from __future__ import annotations

import re
from pathlib import Path

from playwright.sync_api import Browser, expect

from interfaces.nao import PoseHeadPrx, SafetyPrx
from tests.support.browser import Box
from tests.support.monitor import (
    DOCUMENT,
    expect_breakpoint,
    follow,
    monitor_page,
    robot_and_editor,
    run,
    started_elsewhere,
    status,
)


def test_the_robot_is_stopped_and_reset_in_every_window_and_its_component_pauses(
    browser: Browser, tmp_path: Path
) -> None:
    path = tmp_path / "follow me.xml"
    head = "<nameinterface>head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface>"
    commanding = DOCUMENT.replace("count += 1", "self.head.setPose(0.1, 0.0, 0.5)").replace(
        "</VisualHFSM>", f"<config><iceinterface>{head}</iceinterface></config></VisualHFSM>"
    )
    with (
        robot_and_editor(path, commanding) as (robot, editor),
        robot.client() as client,
        monitor_page(browser, editor) as shown,
        monitor_page(browser, editor) as other,
    ):
        safety = client.proxy(SafetyPrx, "Safety")
        banners = [
            each.page.get_by_role("alert").filter(has_text="The robot is stopped") for each in (shown, other)
        ]
        shown.press("Control+Shift+Space")  # nothing is followed
        for banner in banners:
            expect(banner).to_contain_text("STOP was pressed in the editor")
        assert safety.getSafetyState().stopped
        banners[1].get_by_role("button", name="Reset the emergency stop").click()
        for banner in banners:
            expect(banner).to_have_count(0)
        client.proxy(PoseHeadPrx, "Head").setPose(0.5, 0.0, 0.5)

        with started_elsewhere(robot, path) as process:
            follow(shown, "follow_me")
            safety.emergencyStop("a hand in the way")
            expect(status(shown)).to_have_text("Paused: command refused")
            expect(status(shown)).to_have_attribute(
                "title", re.compile("the robot is stopped: a hand in the way")
            )
            safety.resetEmergencyStop()
            expect(shown.page.get_by_role("alert").filter(has_text="The robot is stopped")).to_have_count(0)
            expect(status(shown)).to_have_text("Paused: command refused")  # the reset alone starts nothing
            safety.resetEmergencyStop(True)
            expect(status(shown)).to_have_text("Running")

            shown.press("Alt+Shift+a")
            expect(status(shown)).to_have_count(0)
            shown.button("1 running").click()
            expect(shown.page.get_by_role("menuitem", name="follow_me")).to_be_focused()
            stop, menu = (Box.of(shown.page.locator(each)) for each in (".stop-button", "[role=menu]"))
            assert not menu.overlaps(stop), "a part of the menu lies under STOP"
            shown.press("Control+Shift+Space")
            expect(shown.page.locator(".notice").filter(has_text="follow_me")).to_contain_text(
                "Ended: follow_me."
            )
            assert process.wait() == 0
        expect(shown.button("Nothing runs")).to_be_visible()
        expect(shown.button("STOP the robot and all that runs")).to_be_visible()


STOP_AREA = """() => {
  const button = document.querySelector(".stop-button");
  const {left, right, top, bottom} = button.getBoundingClientRect();
  return [left, right, top, document.elementFromPoint(left + 3, (top + bottom) / 2) === button];
}"""
WIDTHS = (320, 421, 561, 641, 721, 861, 901, 1701, 1101)
"""The narrowest windows of each layout in styles/*.css; the last one has room for all that the test clicks."""


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

        measure("nothing runs")
        run(shown)
        measure("running")
        shown.button("1 running").click()
        expect(shown.page.get_by_role("menuitem", name="followed")).to_be_focused()
        measure("a menu is open")
        shown.press("Escape")
        shown.state("go").locator(".body").click()
        shown.press("b")
        expect_breakpoint(shown, "go")
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
        expect(shown.button("Show a behavior with a long name")).to_be_visible()
        measure("another document is shown")
        shown.button("Show a behavior with a long name").click()
        shown.button("Back to now").click()
        shown.press("Control+Shift+Space")
        expect(status(shown)).to_have_text("Ended: stopped by STOP")
        measure("ended")
        shown.button("Start page").click()
        expect(shown.page.locator("hfsm-start")).to_be_visible()
        measure("start page")
    assert not outside, "\n".join(outside)
