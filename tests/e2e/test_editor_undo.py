"""Undo shows the place where the document changes."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.support.browser import editor_page
from tests.support.editor import DOCUMENT, editor


def test_undo_and_redo_show_the_automaton_that_they_change(browser: Browser, tmp_path: Path) -> None:
    root = tmp_path / "root"
    root.mkdir()
    file = root / "walk.xml"
    file.write_text(DOCUMENT, "utf-8")
    with editor(root, file) as running, editor_page(browser, running) as shown:
        shown.state("go").click()
        shown.press("Control+Enter")
        here = shown.page.locator("hfsm-breadcrumbs [aria-current]")
        expect(here).to_have_text("go")
        shown.press("s")
        expect(shown.page.locator("hfsm-canvas .hint")).to_contain_text("New state")
        shown.press("Enter")
        shown.name("left")
        shown.expect_states("left")
        shown.press("Backspace")
        expect(here).to_have_text("walk")

        shown.press("Control+z")
        expect(here).to_have_text("go")
        shown.expect_states("state 1")
        shown.press("Backspace", "Control+y")
        expect(here).to_have_text("go")
        shown.expect_states("left")
