"""How a browser comes in: by the page of the launch, and what it shows when somebody else used its address."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, new_context
from tests.support.editor import Editor
from tests.support.monitor import monitor_page, robot_and_editor, run
from visualhfsm._editor.launch import LaunchPage


def test_the_page_of_the_launch_leads_into_the_editor_and_is_removed(
    browser: Browser, opened: Editor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", "")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with (
        contextlib.closing(LaunchPage(opened.server.new_address(lambda: launch.close()))) as launch,
        contextlib.closing(new_context(browser)) as context,
    ):
        page = context.new_page()
        page.goto(launch.path.as_uri())
        expect(page.locator("hfsm-canvas .state")).to_have_count(2)
        assert page.url == f"http://{opened.host}/"
        assert not launch.is_open
        assert not launch.path.parent.exists()


def test_a_second_browser_is_refused_at_an_address_and_the_first_one_goes_on(
    browser: Browser, shown: EditorPage
) -> None:
    address = shown.editor.server.new_address()
    shown.spent = True
    shown.page.goto(address)
    shown.expect_states("wait", "go")
    with contextlib.closing(new_context(browser)) as context:
        second = context.new_page()
        second.goto(address)
        expect(second.get_by_role("heading")).to_contain_text("does not know this page")
    shown.state("go").locator(".body").click()
    shown.press("Delete")
    shown.expect_states("wait")


def test_a_page_that_is_locked_out_says_so_can_stop_and_comes_back_by_the_new_address(
    browser: Browser, tmp_path: Path
) -> None:
    with (
        robot_and_editor(tmp_path / "walk.xml") as (_, running),
        monitor_page(browser, running) as shown,
        contextlib.closing(new_context(browser)) as context,
    ):
        shown.spent = True
        run(shown)
        other = context.new_page()
        other.goto(running.server.new_address(running.server.lock_out))
        banner = shown.page.get_by_role("alert").filter(has_text="No connection since")
        expect(banner).to_contain_text("All pages were locked out")
        expect(other.locator(".live-status")).to_have_text("Running")
        shown.press("Control+Shift+Space")
        expect(shown.page.locator(".notice").filter(has_text="The robot stands still.")).to_contain_text(
            "walk"
        )
        expect(other.locator(".live-status")).to_have_text("Ended: stopped in another window")
        shown.page.context.clear_cookies()  # as of a browser that was never let in
        shown.button("STOP the robot and all that runs").click()
        expect(shown.page.get_by_role("alert").filter(has_text="STOP did not reach")).to_contain_text(
            "nao stop"
        )
        with contextlib.closing(shown.page.context.new_page()) as owner:
            owner.goto(running.server.new_address())
            expect(banner).to_have_count(0)
            shown.expect_states("wait", "go")
        shown.mishaps.clear()  # Chromium logs each request that is refused
