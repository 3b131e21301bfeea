"""Keys that come before the field for them is there: they are pressed in it, or go nowhere, and never into the drawing."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, Locator, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import Editor
from tests.support.panels import DOCUMENT
from tests.support.soak import cases

EDITOR = "**/code/editor.js"
"""What code fields load, the largest module of the page."""
UNHURRIED = """() => {
  const genuine = window.setTimeout;
  window.setTimeout = (handler, delay, ...rest) => genuine(handler, delay >= 1000 ? 20 * delay : delay, ...rest);
}"""
"""A busy machine may need longer for keys than the page takes for a pause, or calls late."""


@pytest.fixture
def document() -> str:
    return DOCUMENT


@pytest.fixture
def shown(browser: Browser, opened: Editor) -> Iterator[EditorPage]:
    """A window without a cache, so that a test can hold back what it loads."""
    with editor_page(browser, opened, cached=False) as shown:
        shown.state("wait").wait_for()
        yield shown


def field(shown: EditorPage, name: str) -> Locator:
    return shown.page.get_by_role("textbox", name=name)


def said(shown: EditorPage, text: str) -> Locator:
    return shown.page.locator(".notice").filter(has_text=text)


@pytest.mark.parametrize(
    "ask",
    cases(
        [
            pytest.param(lambda shown: shown.press("Shift+Enter"), id="Shift+Enter"),
            pytest.param(
                lambda shown: (shown.press("Shift+Enter"), shown.page.locator("hfsm-code-field pre").click()),
                id="click on code that loads",
            ),
        ],
        [
            pytest.param(lambda shown: shown.press("Enter"), id="Enter"),
            pytest.param(lambda shown: shown.state("go").locator(".body").dblclick(), id="double click"),
            pytest.param(
                lambda shown: shown.page.get_by_role("treeitem", name="go").press("Enter"), id="tree"
            ),
        ],
    ),
)
def test_select_all_and_delete_act_in_the_code_that_a_key_or_a_click_opens(
    shown: EditorPage, ask: Callable[[EditorPage], None]
) -> None:
    shown.state("go").locator(".body").click()
    asked = shown.held(EDITOR, lambda: ask(shown))
    shown.type("sat = 1")
    shown.press("Control+a", "Delete")
    shown.type("x = 2")
    asked.continue_()
    code = field(shown, "Code of the state go")
    expect(code).to_be_focused()
    expect(code).to_have_text("x = 2")
    shown.expect_states("wait", "go")


def test_keys_that_edit_act_in_the_code_in_their_order_and_escape_leads_out_of_it(shown: EditorPage) -> None:
    shown.page.evaluate(UNHURRIED)  # Escape does not wait for what is late
    shown.state("wait").locator(".body").click()
    asked = shown.held(EDITOR, lambda: shown.press("Shift+Enter"))
    shown.type("ab")
    shown.press("ArrowLeft")
    shown.type("c")
    shown.press("Delete", "End", "Backspace", "Enter")
    shown.type("d = 2")
    shown.press("Control+x", "Control+d", "F2", "Escape")
    asked.continue_()
    expect(field(shown, "Code of the state wait").locator(".cm-line")).to_have_text(["account += ", "d = 2"])
    expect(shown.state("wait")).to_be_focused()
    shown.expect_states("wait", "go")
    shown.press("Control+z")  # which was typed as one step
    expect(field(shown, "Code of the state wait")).to_have_text("count += 1")


def test_what_is_pasted_goes_into_the_code(shown: EditorPage) -> None:
    shown.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    shown.page.evaluate("navigator.clipboard.writeText('p = 1; ')")
    shown.state("wait").locator(".body").click()
    asked = shown.held(EDITOR, lambda: shown.press("Shift+Enter"))
    shown.press("Control+v")
    shown.type("q = 2; ")
    asked.continue_()
    expect(field(shown, "Code of the state wait")).to_have_text("p = 1; q = 2; count += 1")
    expect(shown.page.locator("hfsm-canvas .annotation")).to_have_count(0)


def test_keys_go_nowhere_when_the_code_does_not_load_and_the_user_is_told(shown: EditorPage) -> None:
    shown.page.evaluate(UNHURRIED)
    shown.state("wait").locator(".body").click()
    asked = shown.held(EDITOR, lambda: shown.press("Shift+Enter"))
    shown.type("s")
    shown.press("Control+a", "Delete")
    asked.abort()
    expect(said(shown, "What you typed went nowhere")).to_be_visible()
    shown.press("Control+a", "Delete", "a", "s")  # of somebody who looks at the keys
    expect(
        shown.page.get_by_role("alert").filter(has_text="The code editor could not be loaded")
    ).to_be_visible()
    shown.expect_states("wait", "go")
    expect(shown.page.locator("hfsm-canvas.placing")).to_have_count(0)
    shown.state("go").locator(".body").click()  # from here on the user has seen it
    shown.press("Delete")
    shown.expect_states("wait")
    shown.mishaps.clear()  # Chromium logs what was not loaded


def test_who_waits_long_is_told_and_goes_on_with_escape(shown: EditorPage) -> None:
    shown.spent = True
    shown.page.clock.install()
    shown.state("wait").locator(".body").click()
    asked = shown.held(EDITOR, lambda: shown.press("Shift+Enter"))
    shown.press("Control+a", "Delete")
    shown.page.clock.fast_forward(3_000)
    expect(said(shown, "This takes long to load.")).to_be_visible()
    shown.press("Control+a", "Delete")
    shown.expect_states("wait", "go")
    shown.press("Escape")
    expect(said(shown, "This takes long to load.")).to_have_count(0)
    shown.press("Control+a", "Delete")
    shown.expect_states()
    asked.continue_()


def test_that_it_takes_long_is_said_until_it_is_loaded(shown: EditorPage) -> None:
    shown.spent = True
    shown.page.clock.install()
    shown.state("wait").locator(".body").click()
    asked = shown.held(EDITOR, lambda: shown.press("Shift+Enter"))
    shown.page.clock.fast_forward(3_000)
    expect(said(shown, "This takes long to load.")).to_be_visible()
    asked.continue_()
    expect(field(shown, "Code of the state wait")).to_be_focused()
    expect(said(shown, "This takes long to load.")).to_have_count(0)


def test_on_tabs_and_radios_keys_wait_for_the_code_that_they_open(browser: Browser, opened: Editor) -> None:
    with editor_page(browser, opened, cached=False, holds=EDITOR) as shown:
        shown.state("wait").wait_for()
        page = shown.page
        code = page.get_by_role("tablist", name="Panels").get_by_role("tab", name="Code")
        shown.state("wait").locator(".body").click()
        shown.press("Alt+v")
        asked = shown.held(EDITOR, code.click)
        page.get_by_role("tab", name="Exit, not empty").press("Enter")
        shown.press("Control+a", "Delete")
        shown.type("sea = 1")
        shown.expect_states("wait", "go")
        asked.continue_()
        leaving = field(shown, "Exit code of the state wait")
        expect(leaving).to_be_focused()
        expect(leaving).to_have_text("sea = 1")

        shown.transition("late").locator(".handle").click()
        page.get_by_role("radio", name="Condition").click(force=True)
        shown.press("Control+a", "Delete")
        shown.type("sea > 1")
        condition = field(shown, "Condition of late")
        expect(condition).to_be_focused()
        expect(condition).to_have_text("sea > 1")
        shown.expect_states("wait", "go")


def test_keys_wait_for_the_field_of_a_dialog(shown: EditorPage) -> None:
    asked = shown.held("**/data/files.js", lambda: shown.press("Control+Shift+s"))
    shown.press("Control+a", "Delete")
    shown.type("sated")
    asked.continue_()
    dialog = shown.page.get_by_role("dialog", name="Save the document as")
    expect(dialog.get_by_role("textbox")).to_have_value("sated")
    shown.press("Escape")
    shown.expect_states("wait", "go")


def test_keys_wait_for_the_text_of_a_note(shown: EditorPage) -> None:
    asked = shown.held("**/canvas/annotations.js", lambda: shown.press("n"))
    shown.press("Enter")
    shown.type("sad")
    shown.press("Backspace", "Control+Enter")
    asked.continue_()
    expect(shown.page.locator("hfsm-canvas .annotation").first).to_contain_text("sa")
    expect(shown.page.locator("hfsm-canvas .annotation").first).not_to_contain_text("sad")
    shown.expect_states("wait", "go")
