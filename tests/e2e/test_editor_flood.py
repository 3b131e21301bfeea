"""Components that print without end, hang or are late: what the page shows, and that they are stopped."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from interfaces.nao import SafetyPrx
from tests.support.browser import EditorPage
from tests.support.monitor import (
    DOCUMENT,
    PATIENT,
    expect_current,
    monitor_page,
    robot_and_editor,
    status,
)
from tests.support.robot_server import ServedRobot
from tests.support.soak import cases

FLOOD = DOCUMENT.replace(
    "count += 1\n", "while True:\n    count += 1\n    print('flood', count, 'x' * 200)\n"
)
LATE = DOCUMENT.replace("count += 1\n", "__import__('time').sleep(0.25)\n")
# It rests as it hangs: work without end would slow down what is waited for.
HANGING = DOCUMENT.replace(
    "count += 1\n", "count += 1\nwhile count &gt; 3:\n    __import__('time').sleep(0.01)\n"
)
SAYS_SO = HANGING.replace("while", "print('round', count)\nwhile")
# Its only cycle never ends, which a busy page may hear before it shows that the component runs.
RUNNING = re.compile(r"^\s*(Running|Hanging for \d+ s)\s*$")
LOOP = re.compile(r"^(while count > 3:| *__import__\('time'\)\.sleep\(0\.01\))$")

KEEP_ALERTS = """() => {
  window.alerts = [];
  const note = (changes) => {
    for (const {addedNodes} of changes)
      for (const each of addedNodes) if (each.role === "alert") window.alerts.push(each.innerText);
  };
  new MutationObserver(note).observe(document.body, {subtree: true, childList: true});
}"""

WATCH = """() => {
  window.words = [];
  const note = () => {
    const word = document.querySelector(".live-status")?.innerText ?? "";
    if (word !== window.words.at(-1)) window.words.push(word);
  };
  new MutationObserver(note).observe(document.body, {subtree: true, childList: true, characterData: true});
}"""


@pytest.mark.parametrize("key", cases(["Control+Shift+Space"], ["Shift+F5"]))
@pytest.mark.parametrize("document", [FLOOD], ids=["floods"])
def test_a_component_that_prints_without_end_is_stopped_and_the_page_says_so(
    live_page: EditorPage, robot: ServedRobot, key: str
) -> None:
    shown = live_page
    with robot.client() as client:
        shown.press("Alt+o")
        shown.press("F5")
        expect(status(shown)).to_have_text(RUNNING)
        lines = shown.page.locator("hfsm-output .line")
        expect(lines.filter(has_text=re.compile(r"^… [\d,]+ lines left out …$")).first).to_be_attached()
        shown.page.evaluate(WATCH)
        shown.press(key)
        expect(status(shown)).to_contain_text("Ended: stopped")
        words = shown.page.evaluate("window.words")
        # A window that takes its messages late does not see each status.
        stops = next(place for place, word in enumerate(words) if word.startswith(("Stopping", "Ended")))
        assert "Running" not in words[stops:]
        assert lines.count() <= 2000
        expect(shown.page.get_by_role("checkbox", name="Follow")).to_be_checked()
        if key == "Control+Shift+Space":
            assert client.proxy(SafetyPrx, "Safety").getSafetyState().stopped


@pytest.mark.parametrize("key", cases(["Shift+F5"], ["Control+Shift+Space"]))
@pytest.mark.parametrize("document", [HANGING], ids=["hangs"])
def test_a_component_that_hangs_is_shown_with_the_line_and_can_be_stopped(
    live_page: EditorPage, key: str
) -> None:
    shown = live_page
    shown.press("F5")
    expect(status(shown)).to_contain_text(re.compile(r"Hanging for \d+ s"))
    expect_current(shown, "wait", "its code does not end")
    shown.page.get_by_role("button", name=re.compile(r"in wait, line [23]")).click()
    expect(shown.page.locator(".cm-activeLine")).to_have_text(LOOP)
    shown.press(key)
    expect(status(shown)).to_have_text("Ended: stopped while hanging in wait")
    expect(shown.page.locator(".cm-failed")).to_be_visible()
    expect(shown.state("wait")).to_have_class(re.compile(r"\bfailed\b"))
    shown.state("go").locator(".body").click()
    expect(shown.page.locator(".cm-failed")).to_have_count(0)
    shown.page.get_by_role("button", name=re.compile("^line [23]$")).click()
    expect(shown.page.locator(".cm-activeLine")).to_have_text(LOOP)
    shown.page.reload()
    expect(status(shown)).to_have_text("Ended: stopped while hanging in wait")


def test_what_ended_late_is_no_longer_called_not_stopped(browser: Browser, tmp_path: Path) -> None:
    limits = dataclasses.replace(PATIENT, component_end=0.01)
    with (
        robot_and_editor(tmp_path / "hanging.xml", SAYS_SO, limits=limits) as (_, editor),
        monitor_page(browser, editor) as shown,
    ):
        shown.press("Alt+o", "F5")
        expect(shown.page.locator("hfsm-output .line").filter(has_text="round 4")).to_be_attached()
        shown.page.evaluate(KEEP_ALERTS)
        shown.press("Control+Shift+Space")
        expect(shown.page.locator(".notice.info").filter(has_text="hanging has ended, too.")).to_be_visible()
        assert any("hanging: it has not ended" in each for each in shown.page.evaluate("window.alerts"))
        expect(shown.page.locator(".notice.error")).to_have_count(0)
        expect(status(shown)).to_contain_text("Ended")


@pytest.mark.parametrize("document", [LATE], ids=["is late"])
def test_an_automaton_whose_cycles_take_longer_than_its_period_is_shown(live_page: EditorPage) -> None:
    shown = live_page
    shown.press("F5")
    expect(status(shown)).to_have_text("Running late")
    expect(status(shown)).to_have_attribute("title", re.compile(r"takes \d+ ms, and its period is 100 ms"))
    expect_current(shown, "wait", "its cycles take too long")
    shown.state("wait").dblclick()
    shown.page.get_by_role("button", name="in wait", exact=True).click()
    expect(shown.page.get_by_label("Name of the state")).to_have_value("wait")
