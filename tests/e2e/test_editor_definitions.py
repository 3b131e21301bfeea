"""From a name in code to where it is defined, and back."""

from __future__ import annotations

import pytest
from playwright.sync_api import Locator, expect

from tests.support.browser import EditorPage
from tests.support.panels import DOCUMENT, edit

FUNCTION = "<functions>def leave(self):\n    return 1</functions>"


@pytest.fixture
def document() -> str:
    return DOCUMENT.replace("<variables>count", f"{FUNCTION}<variables>first = 1\ncount")


def field(shown: EditorPage, name: str) -> Locator:
    return shown.page.get_by_role("textbox", name=name)


def expect_selected(shown: EditorPage, text: str) -> None:
    """Wait until a text is selected in the code that has the focus."""
    shown.page.wait_for_function("text => getSelection().toString() === text", arg=text)


def test_a_click_with_ctrl_and_f12_follow_a_name_and_alt_left_comes_back(shown: EditorPage) -> None:
    code = edit(shown, "wait")
    code.locator("text=count").click(modifiers=["ControlOrMeta"], position={"x": 15, "y": 8})
    expect(field(shown, "Variables")).to_be_focused()
    expect_selected(shown, "count")
    shown.press("Alt+ArrowLeft")
    expect(code).to_be_focused()
    shown.press("End", "Enter")
    shown.insert("self.leave()")
    shown.press("ArrowLeft", "ArrowLeft", "F12")
    expect(field(shown, "Functions")).to_be_focused()
    expect_selected(shown, "leave")
    shown.press("Alt+ArrowLeft")
    expect(code).to_be_focused()
    shown.type("x")
    expect(code).to_contain_text("self.leavex()")


def test_the_menu_follows_the_name_at_the_cursor_into_another_automaton(shown: EditorPage) -> None:
    page = shown.page
    edit(shown, "go")
    shown.insert("print(nobody)\nself.leave")
    shown.choose_in("Edit", "Go to definition")
    expect(field(shown, "Functions")).to_be_focused()
    shown.choose_in("Edit", "Back from definition")
    expect(field(shown, "Code of the state go")).to_be_focused()
    shown.press("Control+Home", "Control+ArrowRight", "ArrowRight", "ArrowRight", "F12")
    expect(page.locator(".notice", has_text="Nothing in this document defines that.")).to_be_visible()


def test_alt_left_is_the_drawings_key_on_it(shown: EditorPage) -> None:
    edit(shown, "wait")
    shown.press("Control+Home", "F12")
    expect(field(shown, "Variables")).to_be_focused()
    shown.state("go").locator(".body").click()
    shown.press("Alt+ArrowLeft")
    expect(shown.page.locator("hfsm-canvas .transition:focus")).to_have_count(1)
    expect(field(shown, "Variables")).to_be_visible()
