"""An unexpected error is shown in the page, with advice."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Locator, Route, expect

from tests.support.browser import EditorPage

SCRIPT = {"content-type": "text/javascript", "cache-control": "no-store"}


@pytest.fixture
def shown(shown: EditorPage) -> Iterator[EditorPage]:
    shown.spent = True  # its page is broken
    yield shown
    shown.mishaps.clear()  # they are planted


def alert(shown: EditorPage) -> Locator:
    return shown.page.get_by_role("alert").filter(has_text="Internal error of the editor")


def plant(shown: EditorPage, handler: str) -> None:
    """Break the action for light and dark, and choose it."""
    shown.page.evaluate(f"() => {{ document.querySelector('hfsm-app').toggleTheme = {handler} }}")
    shown.choose_in("View", "Light or dark")


def test_an_unexpected_error_is_shown_once_and_the_page_can_be_loaded_again(shown: EditorPage) -> None:
    # A refusal that nothing catches is shown as it is.
    plant(shown, "async () => { throw Object.assign(new Error('the server is away'), {kind: 'offline'}); }")
    expect(shown.page.get_by_role("alert").filter(has_text="the server is away")).to_have_count(1)
    expect(alert(shown)).to_have_count(0)

    for handler in ("() => missing()", "async () => missing()"):
        plant(shown, handler)
        expect(alert(shown)).to_contain_text("ReferenceError: missing is not defined (shell/actions.js:")
        expect(alert(shown)).to_contain_text("Your changes are kept by the server. Reload the page")
        expect(alert(shown)).to_have_count(1)
        alert(shown).evaluate("alert => alert.dataset.first = ''")
        shown.choose_in("View", "Light or dark")
        expect(alert(shown)).to_have_count(1)
        expect(alert(shown)).to_have_attribute("data-first", "")
        with shown.page.expect_navigation():
            alert(shown).get_by_role("button", name="Reload the page").click()
        expect(alert(shown)).to_have_count(0)
        shown.expect_states("wait", "go")

    # So is a script that cannot be loaded.
    shown.page.route("**/app.js", lambda route: route.abort())
    shown.page.reload()
    expect(alert(shown)).to_contain_text("app.js could not be loaded")


def test_a_browser_that_is_too_old_gets_a_sentence(shown: EditorPage) -> None:
    sentence = shown.page.get_by_text("VisualHFSM needs a newer browser: Firefox 125")
    expect(sentence).to_be_hidden()

    def without_popovers(route: Route) -> None:
        answer = route.fetch()
        kept = {**answer.headers, "cache-control": "no-store"}  # other pages are to have the true one
        body = answer.text().replace(":popover-open", ":unheard-of")
        route.fulfill(response=answer, headers=kept, body=body)

    shown.page.route("**/theme.css", without_popovers)
    shown.page.route("**/app.js", lambda route: route.fulfill(headers=SCRIPT, body=""))
    shown.page.reload()
    expect(sentence).to_be_visible()
    assert shown.violations() == []
    expect(shown.page.get_by_text("VisualHFSM necesita un navegador")).to_be_visible()
