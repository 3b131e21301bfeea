"""Undo shows the place where the document changes."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from tests.support.browser import EditorPage
from tests.support.limits import FOREVER
from tests.support.panels import edit, undo_names


@pytest.mark.parametrize("merge_within", [FOREVER])
def test_undo_and_redo_show_what_they_change(own: EditorPage) -> None:
    # In a code field they say so, if it is elsewhere.
    there = edit(own, "wait")
    own.type("1")
    here = edit(own, "go")
    own.type("2")
    expect(here).to_have_text("pass2")
    notice = own.page.get_by_role("status").filter(has_text="one:")
    own.press("Control+z")
    expect(here).to_have_text("pass")
    expect(notice).to_have_count(0)
    own.press("Control+z")
    expect(notice).to_contain_text("Undone: Edit the code of “wait”.")
    expect(there).to_be_focused()
    expect(there).to_have_text("pass")

    for _ in range(5):  # quickly: the page does not know yet of the step before
        own.press("Control+y", "Control+z")
    own.press("Control+y", "Control+y")
    notice.filter(has_text="Redone: Edit the code of “go”.").wait_for()
    expect(here).to_be_focused()
    expect(here).to_have_text("pass2")
    assert undo_names(own) == ["Edit the code of “go”", "Edit the code of “wait”"]

    # They show the automaton.
    own.state("go").click()
    own.press("Control+Enter")
    here = own.page.locator("hfsm-breadcrumbs [aria-current]")
    expect(here).to_have_text("go")
    own.press("s")
    expect(own.page.locator("hfsm-canvas .hint")).to_contain_text("New state")
    own.press("Enter")
    own.name("left")
    own.expect_states("left")
    own.press("Backspace")
    expect(here).to_have_text("walk")

    own.press("Control+z")
    expect(here).to_have_text("go")
    own.expect_states("state 1")
    own.press("Backspace", "Control+y")
    expect(here).to_have_text("go")
    own.expect_states("left")
