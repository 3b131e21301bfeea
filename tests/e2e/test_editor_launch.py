"""How a browser comes in: by the page of the launch, and what it shows when somebody else used its address."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, new_context
from tests.support.editor import Editor
from visualhfsm._editor.launch import LaunchPage


def test_the_page_of_the_launch_leads_into_the_editor_and_is_removed(
    browser: Browser, running: Editor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", "")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with (
        contextlib.closing(LaunchPage(running.server.new_address(lambda: launch.close()))) as launch,
        contextlib.closing(new_context(browser)) as context,
    ):
        page = context.new_page()
        page.goto(launch.path.as_uri())
        expect(page.locator("hfsm-canvas .state")).to_have_count(2)
        assert page.url == f"http://{running.host}/"
        assert not launch.is_open
        assert not launch.path.parent.exists()


def test_a_page_whose_address_was_used_twice_says_so_and_comes_back_by_the_new_one(
    browser: Browser, shown: EditorPage, running: Editor
) -> None:
    address = running.server.new_address()
    shown.spent = True
    shown.page.goto(address)
    shown.expect_states("wait", "go")
    with contextlib.closing(new_context(browser)) as context:
        thief = context.new_page()
        thief.goto(address)
        expect(thief.get_by_role("heading")).to_contain_text("does not know this page")
        expect(thief.locator("body")).to_contain_text("was used twice")
    banner = shown.page.get_by_role("alert").filter(has_text="No connection since")
    expect(banner).to_contain_text("used twice, by you or by somebody who had seen it")
    with contextlib.closing(shown.page.context.new_page()) as other:
        other.goto(running.server.new_address())
        expect(banner).to_have_count(0)
        shown.expect_states("wait", "go")
    shown.mishaps.clear()  # Chromium logs each request that is refused
