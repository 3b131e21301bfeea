"""Unsaved changes of an editor that ended are offered when the file is opened again."""

from __future__ import annotations

import contextlib
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


def test_a_page_says_what_to_do_when_the_editor_was_restarted(browser: Browser, tmp_path: Path) -> None:
    root = tmp_path / "root"
    root.mkdir()
    file = root / "walk.xml"
    file.write_text(DOCUMENT, "utf-8")
    with contextlib.ExitStack() as first:
        former = first.enter_context(editor(root, file))
        shown = first.enter_context(editor_page(browser, former))
        shown.expect_states("wait", "go")
        former.server.stop()
        banner = shown.page.get_by_role("alert").filter(has_text="No connection since")
        expect(banner).to_contain_text("The server is offline")
        with editor(root, file, port=former.port) as again:
            expect(banner).to_contain_text("open the address that it printed in its terminal")
            with contextlib.closing(shown.page.context.new_page()) as other:
                other.goto(f"http://{again.host}/?token={again.server.credentials.token}")
                expect(banner).to_have_count(0)
                shown.expect_states("wait", "go")
        shown.mishaps.clear()  # Chromium logs each request that is refused
