"""The page releases its resources during a long session."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import editor
from tests.support.panels import DOCUMENT
from tests.support.robot_server import eventually

ROUNDS = 3


def listeners(shown: EditorPage) -> int:
    """Return the number of listeners after a garbage collection."""
    session = shown.page.context.new_cdp_session(shown.page)
    session.send("Performance.enable")
    for _ in range(2):  # what the first finds may hold more
        session.send("HeapProfiler.collectGarbage")
    found = {each["name"]: each["value"] for each in session.send("Performance.getMetrics")["metrics"]}
    session.detach()
    return int(found["JSEventListeners"])


def test_code_that_is_not_shown_any_more_is_let_go_of(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "walk.xml"
    path.write_text(DOCUMENT)
    with editor(tmp_path, path) as running, editor_page(browser, running) as shown:

        def show(kind: str, name: str) -> None:
            shown.page.locator(f".{kind} .{'body' if kind == 'state' else 'handle'}").first.click()
            expect(shown.page.get_by_role("textbox", name=name).first).to_be_visible()

        shown.state("wait").wait_for()
        shown.state("wait").locator(".body").click()
        shown.press("Shift+Enter")

        def show_some() -> None:
            for _ in range(ROUNDS):
                show("transition", "Code of the transition")
                show("state", "Code of the state")

        show_some()
        before = listeners(shown)
        show_some()
        eventually(lambda: listeners(shown) - before < ROUNDS)  # the last may be let go of a little later
