"""Undo shows the place where the document changes."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import editor_page
from tests.support.editor import Editor
from tests.support.limits import FOREVER
from tests.support.panels import edit, undo_names


@pytest.mark.parametrize("merge_within", [FOREVER])
def test_undo_and_redo_show_what_they_change(browser: Browser, running: Editor) -> None:
    with editor_page(browser, running) as shown:
        # In a code field they say so, if it is elsewhere.
        there = edit(shown, "wait")
        shown.type("1")
        here = edit(shown, "go")
        shown.type("2")
        expect(here).to_have_text("pass2")
        notice = shown.page.get_by_role("status").filter(has_text="one:")
        shown.press("Control+z")
        expect(here).to_have_text("pass")
        expect(notice).to_have_count(0)
        shown.press("Control+z")
        expect(notice).to_contain_text("Undone: Edit the code of “wait”.")
        expect(there).to_be_focused()
        expect(there).to_have_text("pass")

        for _ in range(5):  # quickly: the page does not know yet of the step before
            shown.press("Control+y", "Control+z")
        shown.press("Control+y", "Control+y")
        notice.filter(has_text="Redone: Edit the code of “go”.").wait_for()
        expect(here).to_be_focused()
        expect(here).to_have_text("pass2")
        assert undo_names(shown) == ["Edit the code of “go”", "Edit the code of “wait”"]

        # They show the automaton.
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
