"""What was not saved when the editor ended is offered when its file is opened again."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.support.browser import editor_page
from tests.support.editor import DOCUMENT, editor


def test_unsaved_changes_are_recovered_in_the_place_of_their_file(browser: Browser, tmp_path: Path) -> None:
    root = tmp_path / "root"
    root.mkdir()
    file = root / "walk.xml"
    file.write_text(DOCUMENT, "utf-8")
    with editor(root, file) as running, editor_page(browser, running) as shown:
        shown.state("go").click()
        shown.press("Delete")
        shown.expect_states("wait")

    with editor(root, file) as running, editor_page(browser, running) as shown:
        shown.expect_states("wait", "go")
        offer = shown.page.get_by_role("alert").filter(has_text="were not saved")
        offer.get_by_role("button", name="Recover them").click()
        shown.expect_states("wait")
        expect(offer).to_have_count(0)
        expect(shown.page.get_by_role("tablist", name="Open documents").get_by_role("tab")).to_have_count(1)
        shown.press("Control+z")
        shown.expect_states("wait", "go")
