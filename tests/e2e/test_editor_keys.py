"""Keys act where the focus is: letters and Delete on the drawing only (success criterion 2.1.4 of WCAG)."""

from __future__ import annotations

import pytest
from playwright.sync_api import Locator, expect

from tests.support.browser import EditorPage
from tests.support.panels import DOCUMENT, edit
from tests.support.soak import repeated

# From now on actions do nothing but to note that they were performed. Returns the keys of each scope.
NOTE = """async () => {
  const folder = document.querySelector('script[src$="/app.js"]').src.replace("shell/app.js", "");
  const {actions} = await import(`${folder}kit/registry.js`);
  const {scopeOf} = await import(`${folder}kit/keys.js`);
  const elsewhere = new Set(["paste", "stopRobot"]); // have listeners of their own
  window.performed = [];
  const scopes = {canvas: {}, drawing: {}, page: {}, typing: {}};
  for (const action of actions.values()) {
    action.enabled = () => true;
    action.run = () => performed.push(action.id);
    if (elsewhere.has(action.id) || action.scope === "code") continue;
    for (const key of action.keys ?? []) scopes[scopeOf(action, key)][key] = action.id;
  }
  return scopes;
}"""
ENTER = ("Enter", "Shift+Enter", "Ctrl+Enter")
"""Keys that press a button."""


@pytest.fixture
def document() -> str:
    return DOCUMENT


def performed(shown: EditorPage, control: Locator, key: str) -> list[str]:
    """Press a key on a control, and return the actions that it performed."""
    control.focus()
    shown.press(key.replace("Ctrl", "Control"))
    found: list[str] = shown.page.evaluate("performed.splice(0)")
    return found


def test_each_key_acts_where_the_table_of_actions_says(shown: EditorPage) -> None:
    edit(shown, "wait")
    page = shown.page
    scopes: dict[str, dict[str, str]] = page.evaluate(NOTE)
    shown.spent = True  # no action does anything any more
    surface = page.locator("hfsm-canvas .surface")
    places: dict[str, tuple[Locator, set[str]]] = {
        "the canvas": (surface, {"canvas", "drawing", "page", "typing"}),
        "a tool": (page.locator("hfsm-tools button").first, {"drawing", "page", "typing"}),
        "the tree": (page.locator("hfsm-tree [tabindex='0']").first, {"drawing", "page", "typing"}),
        "a tab": (page.get_by_role("tab", name="Entry"), {"page", "typing"}),
        "a check box": (page.get_by_role("checkbox", name="Final"), {"page", "typing"}),
        "a button": (page.locator(".toolbar").get_by_role("button", name="Zoom in"), {"page", "typing"}),
        "a menu of the header": (page.locator("hfsm-menubar [tabindex='0']"), {"page", "typing"}),
        "a field": (page.get_by_role("textbox", name="Name of the state"), {"typing"}),
    }
    for place in repeated(("the canvas", "the tree", "a button", "a field"), tuple(places)):
        control, holds = places[place]
        for scope, keys in scopes.items():
            for key, action in keys.items():
                if key in ENTER and place not in ("the canvas", "a field"):
                    continue
                if key.startswith(("Arrow", "Shift+Arrow")) and place in ("a menu of the header", "the tree"):
                    continue
                expected = [action] if scope in holds else []
                assert performed(shown, control, key) == expected, f"{key} on {place}"


def test_a_click_on_a_kind_of_code_puts_the_cursor_there(shown: EditorPage) -> None:
    edit(shown, "wait")
    for name, label in (("Entry", "Entry code of the state wait"), ("Exit", "Exit code of the state wait")):
        shown.page.get_by_role("tab", name=name).click()
        expect(shown.page.get_by_role("textbox", name=label)).to_be_focused()
        shown.press("e", "l", "Delete")
    assert shown.names() == ["wait", "go"]


def test_a_click_on_the_chosen_kind_of_a_transition_puts_the_cursor_there(shown: EditorPage) -> None:
    shown.transition("enough").click()
    shown.press("Shift+Enter")
    condition = shown.page.get_by_role("textbox", name="Condition of enough")
    expect(condition).to_be_focused()
    shown.page.get_by_role("radio", name="Time").focus()
    shown.page.get_by_role("radio", name="Condition").click(force=True)
    expect(condition).to_be_focused()
    shown.page.get_by_role("radio", name="Finished").click(force=True)
    expect(shown.page.get_by_role("textbox", name="Guard of enough")).to_be_focused()
