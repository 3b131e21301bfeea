"""Undo shows the place where the document changes."""

from __future__ import annotations

import contextlib

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, new_context
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


@pytest.mark.parametrize("merge_within", [FOREVER])
def test_what_another_window_typed_into_ones_words_stays_when_these_are_undone(
    browser: Browser, own: EditorPage
) -> None:
    here = edit(own, "wait")
    own.type(" # one three")
    expect(here).to_have_text("pass # one three")
    with contextlib.closing(new_context(browser)) as context:
        other = EditorPage(context.new_page(), own.editor)
        other.expect_states("wait", "go")
        there = edit(other, "wait")
        for _ in "three":
            other.press("ArrowLeft")
        other.type("two ")
        expect(here).to_have_text("pass # one two three")
        own.press("Control+z")
        expect(here).to_have_text("passtwo ")
        expect(there).to_have_text("passtwo ")
        own.press("Control+z")
        refused = own.page.get_by_role("alert").filter(has_text="you have typed nothing here")
        expect(refused).to_be_visible()
        own.press("Control+y")
        expect(there).to_have_text("pass # one two three")

        # On the canvas all share the steps.
        other.press("Escape")
        own.press("Escape", "Delete")
        other.expect_states("go")
        other.press("Control+z")
        other.state("wait").wait_for()
        notice = other.page.get_by_role("status").filter(has_text="another window")
        expect(notice).to_contain_text("Undone what another window did: Delete")
        assert other.mishaps == []
