"""A screen reader's way through drawing, running and stopping: docs/how-to/screen-reader.md, by keys alone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import Editor
from tests.support.robot_server import ServedRobot
from tests.support.screen_reader import Reader


@pytest.fixture
def shown(browser: Browser, robot_editor: Editor, robot: ServedRobot, root: Path) -> Iterator[EditorPage]:
    """The start page of an editor, beside a robot."""
    with robot_editor.opened(), editor_page(browser, robot_editor) as shown:
        shown.page.get_by_role("heading", name="Draw what your robot does").wait_for()
        yield shown
    robot.assembly.gate.reset()


def draw(reader: Reader) -> None:
    """Draw the states look and rest, with a transition after 1 s from one to the other."""
    reader.tab_to("button Empty")
    reader.press("Enter")
    reader.expect_focus("application Automaton untitled")
    reader.press("s")
    reader.expect_spoken("New state: click, or move it with the arrows and press Enter")
    reader.press("Enter")
    reader.expect_focus("textbox Name of the state")
    reader.type("look")
    reader.press("Enter")
    reader.expect_focus("button State look, initial pressed true")
    reader.press("s", "ArrowRight", "ArrowRight")
    reader.expect_spoken("to the right of look")
    reader.press("Enter")
    reader.expect_focus("textbox Name of the state")
    reader.type("rest")
    reader.press("Enter")
    reader.expect_focus("button State rest")

    reader.press(",")
    reader.expect_focus("button State look, initial")
    reader.press("t")
    reader.expect_spoken("New transition from look: .* press Enter")
    reader.press("ArrowRight")
    reader.expect_spoken("to rest")
    reader.press("Enter")
    reader.expect_focus("textbox Name of the transition")
    reader.type("enough")
    reader.press("Enter")
    reader.expect_focus("button Transition enough from look to rest, on a condition, warning: .* never fires")

    reader.press("Enter")
    reader.expect_focus("textbox Condition of enough")
    reader.press("Escape")
    reader.expect_focus("button Transition enough")
    reader.tab_to("radio Condition checked true")
    reader.press("ArrowRight")
    reader.expect_focus("radio Time checked true")
    expect(reader.page.get_by_role("textbox", name="After")).to_be_visible()
    reader.tab_to("textbox After")
    reader.type("2")
    reader.press("Escape")
    reader.expect_focus("button Transition enough from look to rest, after a time pressed true$")


def write(reader: Reader, state: str, code: str) -> None:
    """Write the code of the state that has the focus, and come back."""
    reader.expect_focus(f"button State {state}")
    reader.press("Shift+Enter")
    reader.expect_focus(f"textbox Code of the state {state}")
    reader.type(code)
    reader.press("Escape")
    reader.expect_focus(f"button State {state}")


def test_a_behavior_is_drawn_run_and_stopped_by_keys_and_ears(shown: EditorPage) -> None:
    page = shown.page
    with Reader(page) as reader:
        draw(reader)
        reader.press(",")
        write(reader, "look", "print(1)")
        reader.press("F5")
        reader.expect_spoken("^Starting$")
        reader.expect_spoken("^Running$")
        reader.expect_spoken("^in rest$")
        assert not [text for _, text in reader.spoken() if text == "1"], "the output is a flood"
        reader.expect_focus("button State look")  # a run takes the focus away from nobody
        current = page.get_by_role("button", name="State rest, active")
        expect(current).to_have_attribute("aria-current", "true")
        expect(page.get_by_role("treeitem", name="rest")).to_have_attribute("aria-current", "true")
        reader.press("Control+Shift+Space")
        reader.expect_spoken("The robot is stopped and refuses commands", "assertive")
        expect(page.get_by_role("button", name="State rest, active")).to_have_count(0)
        reader.tab_to("button Reset the emergency stop", "Shift+Tab")
        reader.press("Enter")
        expect(page.get_by_role("button", name="Reset the emergency stop")).to_have_count(0)


def test_an_error_is_heard_at_once_and_its_line_is_found(shown: EditorPage) -> None:
    with Reader(shown.page) as reader:
        draw(reader)
        reader.press(".")
        write(reader, "rest", "print(1)\n1 / 0")
        reader.press("F5")
        reader.expect_spoken("untitled ended: division by zero in rest", "assertive")
        reader.press("Control+m")
        reader.expect_focus("button error: ZeroDivisionError: division by zero last run .*rest.*line 2")
        reader.press("Enter")
        reader.expect_focus("textbox Code of the state rest")
        reader.type("# ")  # the cursor is at its line
        reader.press("Escape", "Control+s")
        reader.expect_focus("textbox Name")
        reader.type("tired")
        reader.press("Enter")
        reader.expect_spoken("Saved")
        reader.expect_focus("button State rest")

        # A problem of a state leads to the state.
        reader.press("Control+m")
        reader.expect_focus("button note: no transition leads away from rest")
        reader.press("Enter")
        reader.expect_focus("button State rest")


def test_the_focus_has_a_place_after_each_change(shown: EditorPage) -> None:
    with Reader(shown.page) as reader:
        draw(reader)
        reader.press("Delete")
        reader.expect_spoken("^Deleted$")
        reader.expect_focus("button State look, initial")
        reader.press("Control+z")
        reader.expect_spoken("^Undone: Delete")
        reader.expect_focus("button State look, initial")
        reader.press("Control+g")  # into a sub-automaton
        reader.expect_focus("textbox Name of the state")
        reader.type("all")
        reader.press("Enter")
        reader.expect_focus("button State all, .*has a sub-automaton")
        reader.press("Enter")
        reader.expect_focus("button State look")
        reader.press("Backspace")
        reader.expect_focus("button State all")
        reader.press("Control+k")
        reader.expect_focus("combobox|textbox|searchbox")
        reader.press("Escape")
        reader.expect_focus("button State all")
        reader.press("t", ".")
        reader.expect_spoken("to rest")
        reader.press("Escape")
        reader.expect_focus("button State all|application")
