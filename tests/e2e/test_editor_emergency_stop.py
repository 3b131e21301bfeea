"""The robot's emergency stop on the page: it is shown while it is latched, and can be reset."""

from __future__ import annotations

import re
from pathlib import Path

from playwright.sync_api import Browser, expect

from interfaces.nao import PoseHeadPrx, SafetyPrx
from tests.support.monitor import DOCUMENT, follow, monitor_page, robot_and_editor, started_elsewhere, status


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
