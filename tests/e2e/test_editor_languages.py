"""The page in other languages: chosen by the browser or in *View*, and without a word of English left."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from tests.support.browser import EditorPage
from tests.support.editor import Editor
from tests.support.monitor import robot_and_editor

OPENED: Final = 60_000  # ms
WORDS: Final = """() => {
    // The names of the document, code, keys, and what a user reads of other programs.
    const others = ".cm-content, .cm-gutters, code, kbd, pre, .mono, [data-name], .state .name, .transition .label, " +
      ".lines, .component, .brand, .stop-button, hfsm-tree .text, hfsm-tabs .text, select.pick, .files .folder, option";
    const attributes = ["aria-label", "title", "placeholder", "aria-valuetext", "aria-description"];
    const found = [];
    const note = (element, text) => {
      let rest = text.replace(/\\s+/g, " ").trim();
      for (let former = ""; former !== rest; ) [former, rest] = [rest, rest.replace(/⟦[^⟦⟧]*⟧/g, "·")];
      if (/\\p{L}{2}/u.test(rest)) found.push(`${element.localName}.${element.getAttribute("class")}: ${rest}`);
    };
    for (const element of document.body.querySelectorAll("*")) {
      if (element.closest("script, style") || !element.checkVisibility()) continue;
      for (const name of attributes) if (element.hasAttribute(name)) note(element, element.getAttribute(name));
      if (element.closest(others)) continue;
      for (const node of element.childNodes) if (node.nodeType === 3) note(element, node.data);
    }
    return [...new Set(found)];
}"""
"""Returns visible texts, and those of attributes, that are not of the made-up language."""


def views(shown: EditorPage) -> Iterator[str]:
    """Show one view of the page after the other, by keys and marks that are the same in every language."""
    page = shown.page
    yield "canvas"
    menus = page.locator("[role=menubar] > button")
    for index in range(menus.count() if menus.first.is_visible() else 0):
        menus.nth(index).click()
        page.get_by_role("menu").wait_for()
        yield f"menu {index}"
        shown.press("Escape")
    page.locator("hfsm-canvas .state").first.click()
    yield "selected"
    shown.press("Shift+F10")
    page.get_by_role("menu").wait_for()
    yield "actions on a state"
    shown.press("Escape", "Shift+Enter")
    page.locator(".side:focus-within").wait_for()
    yield "code of a state"
    shown.press("Escape")
    for index, name in enumerate(("time", "condition", "event")):
        page.locator(".transition .handle").nth(index).click()
        yield f"code of a transition: {name}"
    for key, name in (("Alt+i", "interfaces"), ("Alt+v", "variables")):
        shown.press(key)
        page.locator("hfsm-data-panel").wait_for()
        yield name
    for key, panel in BELOW.items():
        shown.press(key)
        page.locator(panel).wait_for()
        yield panel
    for key in DIALOGS:
        shown.press(key)
        page.locator("dialog[open]").wait_for()
        yield f"dialog {key}"
        shown.press("Escape")
        page.locator("dialog[open]").wait_for(state="detached")
    shown.press("Alt+b")
    page.locator(".robot-menu").wait_for()
    yield "robot"
    shown.press("Escape")


BELOW: Final = {
    "Control+m": "hfsm-problems",
    "Control+f": "hfsm-search",
    "Alt+o": "hfsm-output",
    "Alt+x": "hfsm-tests-panel",
    "Alt+y": "hfsm-trials-panel",
    "Alt+h": "hfsm-undo-steps",
}
DIALOGS: Final = ("F1", "Control+k", "Control+e", "Control+o", "Control+Shift+s", "Alt+c")


def running_views(shown: EditorPage) -> Iterator[str]:
    """The same while the component runs."""
    page = shown.page
    shown.press("F5")
    page.locator(".live-status.running").wait_for()
    yield "running"
    shown.press("Alt+l")
    tabs = page.locator("hfsm-monitor-panel [role=tab]")
    tabs.first.wait_for()
    for index in range(tabs.count()):
        tabs.nth(index).click()
        page.locator("hfsm-monitor-panel .tab-panel > *").first.wait_for()
        yield f"live {index}"
    page.locator("hfsm-canvas .state").first.click()
    shown.press("Escape", "F8")
    page.locator(".live-status.paused").wait_for()
    yield "paused"
    shown.press("F8")
    shown.press("Shift+F5")
    page.locator(".live-status.ended").wait_for()
    yield "ended"
    page.locator("[data-action=run]").first.focus()
    shown.press("Alt+t")


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Editor]:
    with robot_and_editor(tmp_path / "walk.xml") as (_, running):
        yield running
