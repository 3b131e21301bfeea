"""Actions of the tests of the editor's panels, and their document."""

from __future__ import annotations

import re

from playwright.sync_api import Locator, expect

from tests.support.browser import EditorPage

DOCUMENT = """<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <SubAutomata id="1" idFather="0">
    <state initial="true" id="1">
      <posx>100</posx><posy>150</posy><name>wait</name><idSubautomataSon>2</idSubautomataSon>
      <code>count += 1</code>
      <exit>self.log.info("leaving")</exit>
    </state>
    <state id="2"><posx>400</posx><posy>150</posy><name>go</name></state>
    <transition id="1">
      <posx>250</posx><posy>90</posy><name>enough</name><origin>1</origin><destiny>2</destiny>
      <trans type="condition">count &gt; 5</trans>
    </transition>
    <transition id="2">
      <posx>250</posx><posy>220</posy><name>late</name><origin>1</origin><destiny>2</destiny>
      <trans type="time">5000</trans>
    </transition>
    <variables>count = 0</variables>
  </SubAutomata>
  <SubAutomata id="2" idFather="1">
    <state initial="true" id="1"><posx>100</posx><posy>150</posy><name>look</name></state>
    <input><name>color</name><type>str</type><default>"red"</default></input>
  </SubAutomata>
</VisualHFSM>
"""


def edit(shown: EditorPage, state: str, label: str = "Code") -> Locator:
    """Select a state and put the cursor at the end of its code; `label` is the start of the editor's name."""
    shown.state(state).locator(".body").click()
    shown.press("Shift+Enter")
    code = shown.page.get_by_role("textbox", name=f"{label} of the state {state}")
    code.wait_for()  # while an element is missing, `expect` describes the whole page at each check
    expect(code).to_be_focused()
    shown.press("Control+End")
    return code


def choose(shown: EditorPage, name: str) -> None:
    """Select a transition, and show its code."""
    shown.button("Fit").click()
    shown.transition(name).locator(".handle").click()
    shown.edit_code()
    field = shown.page.get_by_label("Name of the transition")
    field.wait_for()
    expect(field).to_have_value(name)


def adding(shown: EditorPage, noun: str) -> Locator:
    """Return the button that adds an entry to a list."""
    return shown.button(f"Add {'an' if noun[0] in 'aeiou' else 'a'} {noun}")


def show_list(shown: EditorPage, key: str, noun: str) -> None:
    """Press the key that shows an empty list, and wait until its button has the focus, a moment later."""
    shown.press(key)
    expect(adding(shown, noun)).to_be_focused()


def add(shown: EditorPage, noun: str, name: str) -> Locator:
    """Add an entry of a list, name it, and return its group."""
    adding(shown, noun).click()
    entry = shown.page.get_by_role("group", name=re.compile(f"^{noun} ")).last
    entry.locator("input").first.wait_for()
    expect(entry.locator("input").first).to_be_focused()
    shown.insert(name)
    named = shown.page.get_by_role("group", name=f"{noun} {name}", exact=True)
    named.wait_for()
    return named


def undo_names(shown: EditorPage) -> list[str]:
    """Return the steps that can be undone, the most recent first."""
    names: list[str] = shown.page.evaluate(
        "async () => (await import(document.querySelector('script[src$=\"/app.js\"]').src.replace('shell/app.js', 'data/page.js'))).page.document.undo.map(each => each.name)"
    )
    return names


def panel_violations(shown: EditorPage) -> list[str]:
    """Return the violations that axe finds in the panels."""
    return shown.violations(".side, .bottom")
