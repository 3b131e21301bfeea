"""Outputs in the page: declared, taken into a variable, and seen live above and below while it runs."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, expect

from tests.support.browser import EditorPage, editor_page, saved
from tests.support.editor import Editor
from tests.support.limits import RUN_LIMIT
from tests.support.monitor import expect_current, status
from tests.support.panels import add, edit

STARTED = RUN_LIMIT * 1000
DOCUMENT = """<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <SubAutomata id="1" idFather="0">
    <state initial="true" id="1">
      <posx>100</posx><posy>150</posy><name>search</name><idSubautomataSon>2</idSubautomataSon>
    </state>
    <state id="2"><posx>400</posx><posy>150</posy><name>cheer</name></state>
    <transition id="1">
      <posx>250</posx><posy>90</posy><name>found it</name><origin>1</origin><destiny>2</destiny>
      <trans type="condition">steps == 5</trans>
    </transition>
    <iteration_time>50</iteration_time>
    <variables>turns = 0</variables>
  </SubAutomata>
  <SubAutomata id="2" idFather="1">
    <state initial="true" id="1">
      <posx>100</posx><posy>150</posy><name>look</name><code>steps += 1</code>
    </state>
    <state id="2"><posx>400</posx><posy>150</posy><name>stop</name></state>
    <transition id="1">
      <posx>250</posx><posy>90</posy><name>enough</name><origin>1</origin><destiny>2</destiny>
      <trans type="condition">steps == 5</trans>
    </transition>
    <iteration_time>50</iteration_time>
  </SubAutomata>
</VisualHFSM>
"""

MARK_AGAIN = """async (code) => {
  const {EditorView, forEachDiagnostic, setDiagnostics} = await import("codemirror");
  const view = EditorView.findFromDOM(code);
  const marks = [];
  forEachDiagnostic(view.state, (each) => marks.push(each));
  view.dispatch(setDiagnostics(view.state, marks));
}"""


@pytest.fixture
def path(root: Path) -> Path:
    path = root / "ball.xml"
    path.write_text(DOCUMENT)
    return path


@pytest.fixture
def shown(browser: Browser, robotless_editor: Editor, path: Path) -> Iterator[EditorPage]:
    with robotless_editor.opened(path), editor_page(browser, robotless_editor) as shown:
        yield shown


def picture(shown: EditorPage, name: str) -> None:
    if folder := os.environ.get("LOOK_AT"):
        shown.page.screenshot(path=Path(folder, f"{name}.png"))


def output(shown: EditorPage, name: str) -> Locator:
    return shown.page.get_by_role("combobox", name=f"Variable for the output {name}")


def above(shown: EditorPage) -> None:
    """Go back to the automaton at the top."""
    shown.page.locator("hfsm-breadcrumbs").get_by_role("button", name="ball").click()
    shown.state("search").wait_for()


def declare(shown: EditorPage) -> None:
    """Go into the automaton of `search`, and declare an output there."""
    shown.state("search").locator(".body").dblclick()
    shown.state("look").wait_for()
    shown.press("Alt+t")  # the data of the automaton, which take the focus a moment later
    expect(shown.page.locator(".side :focus")).to_have_count(1)
    entry = add(shown, "output", "steps")
    entry.get_by_label("Type").select_option("int")
    entry.get_by_label("Default").fill("0")
    entry.get_by_label("Description").fill("How far the robot has looked.")
    picture(shown, "data")


def test_an_output_is_declared_taken_and_seen_live(shown: EditorPage, path: Path) -> None:
    page = shown.page
    declare(shown)
    above(shown)
    edit(shown, "search")
    page.get_by_role("tab", name="Results").click()
    expect(output(shown, "steps")).to_have_value("")
    output(shown, "steps").select_option(label="a new variable")
    expect(output(shown, "steps")).to_have_value("steps")
    picture(shown, "results")
    assert shown.violations(".side") == []
    root, below = saved(shown, path).automata
    assert root.variables.text == "turns = 0\nsteps = 0"
    assert [(each.name, each.variable.text) for each in root.states[0].results] == [("steps", "steps")]
    assert [(each.name, each.type.text, each.default.text) for each in below.outputs] == [
        ("steps", "int", "0")
    ]
    shown.press("Escape")
    shown.button("Other ways to run").click()
    page.get_by_role("menuitem", name="Try it without a robot").click()
    expect(status(shown)).to_have_text("Trying, 1 x", timeout=STARTED)
    expect_current(shown, "cheer")
    page.get_by_role("tab", name="Variables").click()
    values = page.locator("hfsm-live-variables")
    expect(
        values.get_by_role("table", name="search").get_by_role("row", name=re.compile("steps output"))
    ).to_be_visible()
    expect(values.get_by_role("table", name="ball").get_by_role("textbox", name="steps")).to_have_value("5")
    picture(shown, "live")
    shown.press("Control+Shift+Space")
    expect(status(shown)).to_have_text(re.compile(r"^\s*Ended"))


def test_an_output_of_nobody_is_a_problem_at_its_result(shown: EditorPage, path: Path) -> None:
    declare(shown)
    above(shown)
    edit(shown, "search")
    shown.page.get_by_role("tab", name="Results").click()
    output(shown, "steps").select_option(label="a new variable")
    expect(output(shown, "steps")).to_have_value("steps")
    shown.press("Escape")
    shown.press("Control+z")
    shown.press("Control+y")
    # Only then the automaton that was changed stays shown, whatever is clicked.
    shown.page.get_by_role("status").filter(has_text="Redone").wait_for()
    shown.state("search").locator(".body").dblclick()
    shown.state("look").wait_for()
    shown.press("Alt+t")
    shown.button("Remove output steps").click()
    above(shown)
    edit(shown, "search")
    shown.page.get_by_role("tab", name=re.compile("Results")).click()
    expect(shown.page.locator(".entry")).to_contain_text("no automaton of state search has an output steps")
    output(shown, "steps").select_option(label="nothing: it is not taken")
    expect(shown.page.locator(".entry")).to_have_count(0)
    assert saved(shown, path).automata[0].states[0].results == ()


def test_a_variable_of_the_automaton_above_is_shared_by_a_click(shown: EditorPage, path: Path) -> None:
    shown.state("search").locator(".body").dblclick()
    shown.state("look").wait_for()
    code = edit(shown, "look")
    shown.press("Control+a")
    shown.insert("turns = 1\npass")
    share = shown.page.get_by_role("button", name="Write self.turns in both")
    shown.hover(code.locator(".cm-lintRange", has_text="turns"), shows=share)

    # The bubble below a mouse that rests stays while another mark comes, and while the same marks are found again.
    open_now = share.element_handle()
    with shown.editor.window() as other:
        (tab,) = other.documents
        command = {"command": "setText", "place": {"kind": "state", "automaton": 2, "id": 1, "part": "code"}}
        other.ask("do", tab=tab, command={**command, "text": "turns = 1\nself.nothing()"})
        code.locator(".cm-lintRange", has_text="nothing").wait_for()
        assert open_now.is_visible()
        other.ask("do", tab=tab, command={**command, "text": "turns = 1\npass"})
        expect(code.locator(".cm-lintRange")).to_have_text(["turns"])
    expect(shown.page.locator(".cm-lint-marker")).to_have_count(1)
    marked = code.locator(".cm-lintRange").element_handle()
    in_gutter = shown.page.locator(".cm-lint-marker").element_handle()
    code.evaluate(MARK_AGAIN)
    assert [each.is_visible() for each in (open_now, marked, in_gutter)] == [True] * 3
    share.click()
    expect(code.locator(".cm-lintRange")).to_have_count(0)
    root, below = saved(shown, path).automata
    assert (root.variables.text, below.states[0].code.text) == ("self.turns = 0", "self.turns = 1\npass")
