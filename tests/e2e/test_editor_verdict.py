"""*Is it ready?* in the page: it leads to what to fix first, until the saved document is ready."""

from __future__ import annotations

import re
from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.support.browser import editor_page
from tests.support.documents import document, state, sub
from tests.support.editor import editor
from tests.support.limits import RUN_LIMIT

RAISES = "raise ValueError('the ball was neither here nor there, which is why this has the last word')"
JUDGED = RUN_LIMIT * 1000
TEST = "def test_it(behavior):\n    behavior('moves.xml').run_until('go', limit=1.0)\n"
COLOR = """name => {
  const made = document.createElement("i");
  made.style.color = `var(${name})`;
  document.body.append(made);
  const {color} = getComputedStyle(made);
  made.remove();
  return color;
}"""
"""The color of a variable of the styles, as computed."""
IS_ABOVE = """menu => {
  const notices = document.querySelector(".notices");
  const {left, right, top, bottom} = menu.getBoundingClientRect();
  Object.assign(notices.style, {position: "fixed", inset: `${top}px auto auto ${left}px`});
  return menu.contains(document.elementFromPoint((left + right) / 2, notices.getBoundingClientRect().top + 20));
}"""
BUSY = """() => {
  const panel = document.querySelector("hfsm-problems");
  const words = [];
  const look = () => words.push(...[...panel.querySelectorAll("button:disabled")].map((each) => each.innerText.trim()));
  new MutationObserver(look).observe(panel, {attributes: true, childList: true, subtree: true, characterData: true});
  return words;
}"""
"""What its buttons say from now on while they are disabled, however shortly."""


def test_it_leads_to_what_to_fix_first_until_it_is_ready(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "moves.xml"
    path.write_text(document(sub(1, 0, state(1, "go", RAISES, initial=True))))
    with editor(tmp_path, path) as running, editor_page(browser, running) as shown:
        page = shown.page
        page.evaluate("localStorage.setItem('visualhfsm.body', 'T1')")
        shown.state("go").wait_for()
        shown.press("Control+m")
        ask = shown.button("Is it ready?")
        ask.click()
        refusal = page.get_by_role("alert").filter(has_text="It is not ready")
        expect(refusal).to_contain_text(re.compile("raised ValueError: .+ has the last word"), timeout=JUDGED)
        expect(refusal).to_contain_text("It is not ready for Booster T1: ")
        said = page.locator("hfsm-problems .verdict")
        expect(said).to_contain_text("It is not ready for Booster T1: ")
        expect(said).to_have_css("color", shown.page.evaluate(COLOR, "--error"))
        expect(page.locator("hfsm-problems")).not_to_contain_text("found nothing wrong")
        assert refusal.locator(".words").evaluate("words => words.scrollHeight <= words.clientHeight")
        refusal.get_by_role("button", name="Show").click()
        field = page.get_by_role("textbox", name=re.compile("[Cc]ode of the state go|Code in each cycle"))
        expect(field).to_be_focused()
        page.get_by_role("menuitem", name="View", exact=True).click()
        assert page.get_by_role("menu", name="View").evaluate(IS_ABOVE), "a menu lies above what is said"
        shown.press("Escape")
        field.focus()
        shown.press("Control+a", "Delete")
        expect(refusal).to_have_count(0)
        panel = page.locator("hfsm-problems")
        expect(panel).not_to_contain_text("It is not ready")  # that was said of what was there before
        busy = page.evaluate_handle(BUSY)
        ask.click()
        page.get_by_role("dialog", name="Save moves first?").get_by_role("button", name="Save").click()
        untested = "It runs, and is not tested yet: it ran 10 s on Booster T1 without an error"
        expect(page.get_by_role("status").filter(has_text=untested)).to_be_visible(timeout=JUDGED)
        assert "Being tried…" in busy.json_value()
        expect(said).to_contain_text(untested)
        said.get_by_role("button", name="Tests").click()
        page.locator("hfsm-tests-panel").wait_for()
        shown.press("Control+m")
        expect(said).to_have_css("color", shown.page.evaluate(COLOR, "--warning"))
        path.with_name("test_moves.py").write_text(TEST)
        ask.click()
        done = "It is ready: it ran 10 s on Booster T1 without an error. A test passed."
        expect(said).to_have_text(done, timeout=JUDGED)
        expect(said).to_have_css("color", shown.page.evaluate(COLOR, "--added"))
        expect(panel).to_contain_text("found nothing wrong")
