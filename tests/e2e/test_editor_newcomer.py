"""What invites a newcomer: behaviors that move on the start page, and one sentence on the drawing."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import editor
from tests.support.monitor import comes_true
from tests.support.panels import edit
from tests.support.places import ROOT

LEFT_ITS_INITIAL_STATE = """() => {
  const current = document.querySelector("hfsm-start .card circle:has(animate)");
  return current && current.cx.animVal.value > 100;
}"""


def test_the_automata_on_the_start_page_run_unless_nothing_is_to_move(start_page: EditorPage) -> None:
    page = start_page.page
    page.emulate_media(reduced_motion="reduce")
    page.reload()
    expect(page.locator(".card svg")).to_have_count(5)
    expect(page.locator(".card animate")).to_have_count(0)
    page.emulate_media(reduced_motion="no-preference")
    page.reload()
    comes_true(start_page, LEFT_ITS_INITIAL_STATE)


def test_the_sentence_is_of_the_open_document_and_gone_for_good_after_the_first_edit(
    start_page: EditorPage,
) -> None:
    page = start_page.page
    sentence = page.locator(".invitation")
    start_page.button("Dance Both arms move from pose to pose.").click()
    expect(sentence).to_have_text("This is dance. Double-click up to change it.")
    start_page.choose_in("File", "New")
    start_page.expect_states()
    expect(sentence).to_be_hidden()
    page.get_by_role("tab", name="dance").click()
    assert start_page.violations("hfsm-canvas") == []
    start_page.press("t")
    expect(page.locator("hfsm-canvas .hint")).to_be_visible()
    expect(sentence).to_be_hidden()  # one sentence at a time
    start_page.press("Escape")
    edit(start_page, "up")
    expect(sentence).to_be_visible()  # who only looks has not edited
    start_page.type("# mine")
    expect(sentence).to_have_count(0)
    expect(page.locator(".last-step")).to_have_count(1)
    start_page.press("Control+z")
    expect(page.locator(".last-step")).to_have_count(0)
    page.reload()
    start_page.state("up").wait_for()
    page.locator("hfsm-shelf .shelf").wait_for()  # what is loaded later is there
    expect(sentence).to_have_count(0)


def test_the_sentence_says_what_leads_inside_in_the_language_of_the_page(
    browser: Browser, root: Path
) -> None:
    path = root / "dance_and_follow.xml"
    path.write_text((ROOT / "behaviors/dance_and_follow.xml").read_text())
    with editor(root, path) as running, editor_page(browser, running, language="es") as shown:
        sentence = shown.page.locator(".invitation")
        expect(sentence).to_contain_text("Esto es dance_and_follow. Haz doble clic en")
        expect(sentence).to_contain_text("para ver lo que hay dentro.")
        shown.page.locator("hfsm-canvas .state .body").first.dblclick()
        expect(sentence).to_contain_text("Esto es followBall.")
