"""The panel *Trials* in the page: real trials in their own processes, in Chromium."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import Editor
from tests.support.limits import RUN_LIMIT
from tests.support.waiting_trials import PLAN, WAITS

ENDED = RUN_LIMIT * 1000
NOTED = """() => {
  window.noted = new Promise((answer) => new MutationObserver(() => {
    const note = document.querySelector(".panel-note.coming");
    if (!note) return;
    requestAnimationFrame(() => {
      const [all, box] = [note.closest(".trials-results"), note].map((each) => each.getBoundingClientRect());
      const links = document.querySelectorAll(".way-row .link:disabled").length;
      answer([links > 0, box.top >= all.top, box.bottom <= all.bottom]);
    });
  }).observe(document.body, {subtree: true, childList: true}));
}"""
"""Resolves when a trial runs again to whether that is said where one looks, and the links stay."""


@pytest.fixture
def document() -> str:
    """The document that is open, which waits a while; other tests say another one."""
    return WAITS


@pytest.fixture
def path(root: Path, document: str) -> Path:
    path = root / "waits.xml"
    path.write_text(document)
    return path


@pytest.fixture
def shown(browser: Browser, robotless_editor: Editor, path: Path) -> Iterator[EditorPage]:
    with robotless_editor.opened(path), editor_page(browser, robotless_editor) as shown:
        shown.page.locator("hfsm-canvas .state").first.wait_for()
        yield shown


def below(shown: EditorPage) -> Locator:
    return shown.page.get_by_role("region", name="Panel below the canvas")


def open_panel(shown: EditorPage) -> Locator:
    """Show the panel of trials."""
    shown.state("done").wait_for()
    shown.press("Alt+y")
    shown.page.get_by_role("spinbutton", name="Trials").wait_for(timeout=ENDED)
    return below(shown)


def test_trials_fill_the_panel_and_a_failed_one_is_looked_back_at(
    shown: EditorPage, browser: Browser, path: Path
) -> None:
    path.with_name("waits.trials.toml").write_text(PLAN)
    with editor_page(browser, shown.editor) as other:
        page = shown.page
        panel = open_panel(shown)
        open_panel(other)
        expect(panel).to_contain_text("By the plan waits.trials.toml")
        expect(panel).to_contain_text("reaches done within 1 s")
        panel.get_by_role("button", name="Run", exact=True).click()
        expect(panel).to_contain_text(re.compile(r"\d+ of 12\s+trials\s+succeed"), timeout=ENDED)
        panel.get_by_role("button", name="Run 12 more").wait_for(timeout=ENDED)
        expect(panel.get_by_role("region", name="How it fails")).to_contain_text("not in done after 1 s")
        expect(panel.get_by_role("region", name="What success depends on")).to_contain_text("patience")
        expect(page.locator("hfsm-canvas .state").first).to_have_attribute(
            "aria-label", re.compile("[0-9]+ failed trials? ended here, nowhere more")
        )
        expect(other.page.get_by_role("button", name="Run 12 more")).to_be_visible()
        assert shown.violations(".bottom") == []

        other.state("done").click()
        other.press("Delete")
        expect(panel).to_contain_text("an older version of the document")
        panel.get_by_role("button", name="Run from the start").wait_for()
        page.evaluate(NOTED)
        panel.get_by_role("button", name="look back").first.click()
        assert page.evaluate("noted") == [True, True, True]
        banner = page.locator(".banner.recorded")
        expect(banner).to_contain_text("recordings/waits-trial-", timeout=ENDED)
        shown.expect_states("waiting", "done")  # as it ran
        panel.get_by_role("button", name="Back to the trials of waits").click()
        expect(banner).to_have_count(0)
        shown.expect_states("waiting")


def test_the_first_trials_are_one_click_and_the_form_says_what_they_ran_with(shown: EditorPage) -> None:
    panel = open_panel(shown)
    reach, robot = panel.get_by_label("Reach"), panel.get_by_label("Robot")
    reach.select_option("done")
    robot.select_option("none")
    panel.get_by_role("button", name="Run 10 trials").click()
    panel.get_by_role("button", name="Run 10 more").wait_for(timeout=ENDED)
    expect(panel).to_contain_text("10 of 10 trials succeed")
    expect(panel).to_contain_text("The 10 trials are equal: they say as much as one.")
    expect(panel.get_by_role("region", name="Each of them").locator("details")).to_have_count(1)
    expect(panel).not_to_contain_text("The worst trials")
    expect(panel.get_by_role("button", name="Run 10 trials")).to_have_count(0)
    expect(reach).to_have_value("done")
    expect(robot).to_have_value("none")


def test_trials_run_on_the_chosen_robot_and_their_recording_names_it(shown: EditorPage) -> None:
    shown.page.evaluate("localStorage.setItem('visualhfsm.body', 'T1')")
    panel = open_panel(shown)
    panel.get_by_role("spinbutton", name="Trials").fill("2")
    panel.get_by_label("Within").fill("0.5")
    panel.get_by_label("Robot").select_option("fake")
    panel.get_by_role("button", name="Run", exact=True).click()
    expect(panel).to_contain_text("2 of 2 trials succeed", timeout=ENDED)
    expect(panel.locator(".trials-setup dl")).to_have_text("body T1")
    panel.get_by_role("button", name="look back").first.click()
    expect(shown.page.locator(".banner.recorded")).to_be_visible(timeout=ENDED)
    shown.show_robot()
    picture = shown.page.get_by_role("combobox", name="Picture of the robot").locator("option:checked")
    expect(picture).to_have_text("Booster T1 in 3D", timeout=ENDED)


def test_without_a_plan_one_chooses_what_counts(shown: EditorPage) -> None:
    panel = open_panel(shown)
    panel.get_by_role("spinbutton", name="Trials").fill("2")
    panel.get_by_label("Reach").select_option("done")
    panel.get_by_label("Within").fill("0.5")
    panel.get_by_label("Robot").select_option("none")
    panel.get_by_role("button", name="Run", exact=True).click()
    expect(panel).to_contain_text("0 of 2 trials succeed", timeout=ENDED)  # it takes 0.7 s
    panel.get_by_label("Within").fill("2")
    panel.get_by_role("button", name="Run from the start").click()
    expect(panel).to_contain_text("2 of 2 trials succeed", timeout=ENDED)
    panel.get_by_label("Reach").select_option("waiting")
    panel.get_by_role("button", name="Run from the start").click()
    expect(panel).to_contain_text(
        "Success is true from the start in 2 of 2: that says nothing.", timeout=ENDED
    )
    assert shown.violations(".bottom") == []


def test_it_stops_and_says_what_is_wrong(shown: EditorPage, path: Path) -> None:
    path.with_name("waits.trials.toml").write_text(PLAN.replace("limit = 1", "limit = 0"))
    shown.press("Alt+y")
    panel = below(shown)
    expect(panel.get_by_role("alert")).to_contain_text("waits.trials.toml:3", timeout=ENDED)
    path.with_name("waits.trials.toml").write_text(PLAN)
    shown.page.evaluate("window.dispatchEvent(new Event('focus'))")
    panel.get_by_role("spinbutton", name="Trials").fill("100000", timeout=ENDED)
    panel.get_by_role("button", name="Run", exact=True).click()
    expect(panel).to_contain_text("are still to come", timeout=ENDED)
    panel.get_by_role("button", name="Stop").click()
    panel.get_by_role("button", name="Go on").wait_for(timeout=ENDED)
