"""The robot's emergency stop on the page: it is shown while it is latched, and can be reset."""

from __future__ import annotations

import asyncio
import contextlib
import re
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

from playwright.sync_api import Browser, Locator, Page, WebSocketRoute, expect

from interfaces.nao import PoseHeadPrx, SafetyPrx
from tests.support.browser import Box, new_context
from tests.support.editor import NoPart, editor, parts
from tests.support.limits import FOREVER
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
from tests.support.processes import ComponentProcess, free_endpoint, module
from visualhfsm._monitor.stopping import StopReport


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


@contextlib.contextmanager
def window_at(browser: Browser, address: str) -> Iterator[Page]:
    """A window of its own, whose clock can be moved on."""
    with contextlib.closing(new_context(browser)) as context:
        page = context.new_page()
        page.clock.install()
        page.goto(address)
        page.locator("hfsm-canvas .state").first.wait_for()
        yield page


def said(page: Page, text: str) -> Locator:
    return page.locator(".notice").filter(has_text=text)


def test_stop_of_an_editor_that_hangs_is_asked_in_a_second_way_and_answered_when_it_goes_on(
    browser: Browser, tmp_path: Path
) -> None:
    path = tmp_path / "walk.xml"
    path.write_text(DOCUMENT)
    command = module("visualhfsm", "edit", "--no-browser", "--root", str(tmp_path), str(path))
    state = {"XDG_STATE_HOME": str(tmp_path / "state"), "VISUALHFSM_REALM": "test-hangs"}
    with (
        ComponentProcess([*command, "--connect", free_endpoint()], state) as process,
        window_at(browser, process.wait_for(r"http://\S+\?token=\S+")[0]) as page,
    ):
        process.freeze()
        try:
            page.locator(".stop-button").click()
            page.clock.fast_forward(3_000)
            expect(said(page, "the editor does not answer, and is asked in a second way")).to_be_visible()
            page.clock.fast_forward(15_000)
            expect(said(page, "STOP did not reach the robot: The editor does not answer.")).to_be_visible()
            expect(said(page, "STOP")).to_have_count(1)
        finally:
            process.process.send_signal(signal.SIGCONT)
        expect(said(page, "There was nothing to stop")).to_be_visible()
        expect(said(page, "STOP did not reach")).to_have_count(0)


def test_stop_takes_its_second_way_when_the_connection_breaks(
    browser: Browser, root: Path, path: Path
) -> None:
    class Stopped(NoPart):
        async def emergency_stop(self) -> StopReport:
            return StopReport(["Head"], {})

    def break_at_stop(route: WebSocketRoute) -> None:
        server = route.connect_to_server()
        route.on_message(
            lambda message: route.close() if "emergencyStop" in str(message) else server.send(message)
        )

    with (
        editor(root, path, make_parts=lambda _: parts(followers=Stopped())) as running,
        contextlib.closing(new_context(browser)) as context,
    ):
        page = context.new_page()
        page.route_web_socket("**/ws", break_at_stop)
        page.goto(running.server.new_address())
        page.locator("hfsm-canvas .state").first.wait_for()
        page.locator(".stop-button").click()
        expect(said(page, "The robot stands still.")).to_be_visible()
        expect(said(page, "STOP")).to_have_count(0)


def test_stop_is_repeated_once_the_editor_says_so(browser: Browser, root: Path, path: Path) -> None:
    still = threading.Event()

    class Repeated(NoPart):
        async def emergency_stop(self) -> StopReport:
            await asyncio.to_thread(still.wait, FOREVER)
            return StopReport(["Head"], {})

    with (
        editor(root, path, make_parts=lambda _: parts(followers=Repeated())) as running,
        window_at(browser, running.server.new_address()) as page,
    ):
        page.locator(".stop-button").click()
        page.clock.fast_forward(3_000)
        late = page.get_by_role("alert").filter(has_text="STOP is not confirmed yet, and repeated.")
        expect(late).to_be_visible()
        still.set()
        expect(page.get_by_role("status").filter(has_text="The robot stands still.")).to_be_visible()
        expect(said(page, "STOP")).to_have_count(0)


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
