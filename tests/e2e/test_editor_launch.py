"""How a browser comes in: by the page of the launch, and what it shows when another one used its address."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, new_context
from tests.support.editor import Editor
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
        expect(second.locator("body")).to_contain_text("each lets in one browser")
    shown.state("go").locator(".body").click()
    shown.press("Delete")
    shown.expect_states("wait")
