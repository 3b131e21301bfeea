"""One sentence on the drawing says what a newcomer may do first."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import editor
from tests.support.panels import edit
from tests.support.places import ROOT


def test_it_is_of_the_open_document_and_gone_for_good_after_the_first_edit(start_page: EditorPage) -> None:
    page = start_page.page
    sentence = page.locator(".invitation")
    start_page.button("Dance Both arms move from pose to pose.").click()
    expect(sentence).to_have_text("This is dance. Double-click out to change it.")
    start_page.choose_in("File", "New")
    start_page.expect_states()
    expect(sentence).to_be_hidden()
    page.get_by_role("tab", name="dance").click()
    assert start_page.violations("hfsm-canvas") == []
    edit(start_page, "out")
    expect(sentence).to_be_visible()  # who only looks has not edited
    start_page.type("# mine")
    expect(sentence).to_have_count(0)
    page.reload()
    start_page.state("out").wait_for()
    page.locator("hfsm-shelf .shelf").wait_for()  # what is loaded later is there
    expect(sentence).to_have_count(0)


def test_it_says_what_leads_inside_in_the_language_of_the_page(browser: Browser, root: Path) -> None:
    path = root / "dance_and_follow.xml"
    path.write_text((ROOT / "behaviors/dance_and_follow.xml").read_text())
    with editor(root, path) as running, editor_page(browser, running, language="es") as shown:
        sentence = shown.page.locator(".invitation")
        expect(sentence).to_contain_text("Esto es dance_and_follow. Haz doble clic en")
        expect(sentence).to_contain_text("para ver lo que hay dentro.")
