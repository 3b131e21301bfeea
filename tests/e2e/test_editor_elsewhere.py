"""What another editor of the same realm, or a terminal, runs on the robot that this one shows."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from playwright.sync_api import Browser, expect

from tests.support.monitor import DOCUMENT, monitor_page, robot_and_editor, started_elsewhere, status

HEAD: Final = (
    "<config><iceinterface><nameinterface>head</nameinterface><nameproxy>Head</nameproxy>"
    "<interface>PoseHead</interface></iceinterface></config></VisualHFSM>"
)
USES_ROBOT: Final = DOCUMENT.replace("</VisualHFSM>", HEAD)


def test_run_asks_before_two_components_move_one_robot_and_stop_stops_both(
    browser: Browser, tmp_path: Path
) -> None:
    other = tmp_path / "theirs" / "patrol.xml"
    other.parent.mkdir()
    other.write_text(USES_ROBOT)
    with (
        robot_and_editor(tmp_path / "walk.xml", USES_ROBOT) as (robot, running),
        monitor_page(browser, running) as shown,
        started_elsewhere(robot, other) as process,
    ):
        shown.button("1 running").click()
        shown.page.get_by_role("menuitem", name="patrol, started elsewhere").wait_for()
        shown.press("Escape", "F5")
        dialog = shown.page.get_by_role("dialog", name="Others use this robot")
        its = rf"patrol \(patrol\.py on \S+, process {process.process.pid}, since \d\d:\d\d\)"
        expect(dialog).to_contain_text(re.compile(f"{its} runs on this robot"))
        assert shown.violations("dialog") == []
        dialog.get_by_role("button", name="Cancel").click()
        expect(shown.button("1 running")).to_be_visible()
        expect(shown.page.get_by_role("region", name="Panel below the canvas")).to_have_count(0)
        shown.press("F5")
        dialog.get_by_role("button", name="Run beside it").click()
        expect(status(shown)).to_have_text("Running")
        shown.press("F5")  # it does not ask for that again
        shown.page.get_by_role("dialog", name="walk runs").get_by_role("button", name="Run again").click()
        expect(dialog).to_have_count(0)
        expect(status(shown)).to_have_text("Running")
        shown.page.get_by_role("button", name="STOP the robot").click()
        process.wait()
        expect(shown.page.locator(".robot-pill.stopped")).to_be_visible()
