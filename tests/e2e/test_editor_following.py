"""The page shows the component of the shown document running, whoever started it, and ends none by surprise."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, expect

from tests.support.browser import EditorPage
from tests.support.editor import Editor
from tests.support.monitor import (
    DOCUMENT,
    comes_true,
    expect_current,
    monitor_page,
    run,
    started_elsewhere,
    status,
)
from tests.support.panels import edit
from tests.support.robot_server import ServedRobot


@pytest.fixture
def document() -> str:
    return DOCUMENT


@pytest.fixture
def shown(live_page: EditorPage) -> EditorPage:
    return live_page


def expect_running(shown: EditorPage, component: str = "walk") -> None:
    """Wait until a component is shown running."""
    expect(shown.page.locator("hfsm-monitor-bar .component")).to_have_text(component)
    expect(status(shown)).to_have_text("Running")


def steering(shown: EditorPage) -> Locator:
    """The switch that says whether the window may steer what it follows."""
    return shown.page.locator("hfsm-monitor-bar [role=switch]")


def show(shown: EditorPage, document: str) -> None:
    """Show an open document."""
    shown.page.locator("hfsm-tabs").get_by_role("tab", name=document).click()


def test_a_page_that_is_loaded_again_shows_what_it_has_started_and_steers_it(shown: EditorPage) -> None:
    page = shown.page
    moment = page.get_by_role("slider", name="Moment of the run")
    run(shown)
    shown.transition("late").locator(".handle").click()
    shown.press("Alt+Enter")
    expect_current(shown, "go")
    edit(shown, "go")
    shown.press("Control+m", "Escape")
    problems = page.get_by_role("tab", name="Problems", selected=True)
    expect(problems).to_be_visible()
    begun = float(moment.get_attribute("aria-valuemin") or "nan")
    comes_true(
        shown,
        "begun => +document.querySelector('[role=slider]').getAttribute('aria-valuemax') > begun + 4",
        begun,
    )
    page.reload()
    expect_running(shown)
    expect_current(shown, "go")
    expect(steering(shown)).to_be_checked()
    expect(page.get_by_role("textbox", name="Code of the state go")).to_be_visible()
    expect(problems).to_be_visible()
    page.get_by_role("tab", name="Timeline").click()
    again = float(moment.get_attribute("aria-valuemin") or "nan")
    # A window's first value is that of a cycle, the kept ones may be of the next one, which may be late.
    assert again < begun + 2
    expect(page.get_by_role("list", name="Changes, the latest first")).to_contain_text("late")
    shown.press("F8")
    expect(status(shown)).to_have_text("Paused")


def test_another_window_shows_what_runs_and_only_watches(
    shown: EditorPage, browser: Browser, followed: Editor
) -> None:
    with monitor_page(browser, followed) as early:
        run(shown)
        expect_running(early)
        with shown.page.expect_popup() as opened:
            shown.choose_in("View", "Another window")
        expect(opened.value.locator(".live-status")).to_have_text("Running")
        opened.value.close()
        with monitor_page(browser, followed) as late:
            expect_running(late)
            expect_current(late, "wait")
            expect(steering(late)).not_to_be_checked()
        early.press("Alt+Shift+a")  # unfollow
        expect(status(early)).to_have_count(0)
        shown.press("Shift+F5")
        expect(status(shown)).to_have_text("Ended: stopped")
        expect(status(early)).to_have_count(0)
        run(shown)
        expect_running(early)


def test_what_a_terminal_starts_is_shown_beside_its_document(
    shown: EditorPage, robot: ServedRobot, path: Path
) -> None:
    with started_elsewhere(robot, path):
        expect_running(shown)
        expect_current(shown, "wait")
        shown.press("F5")
        refusal = shown.page.get_by_role("alert").filter(
            has_text="walk runs already, and was not started here"
        )
        expect(refusal).to_be_visible()
        expect_running(shown)


def test_each_document_that_is_shown_shows_its_own_run(shown: EditorPage, root: Path) -> None:
    run(shown)
    (root / "patrol.xml").write_text(DOCUMENT)
    with shown.editor.window() as other:
        other.ask("open", path="patrol.xml")
    show(shown, "patrol")
    expect_running(shown)  # the other one, since this does not run
    shown.press("Control+m")
    expect(shown.page.get_by_role("tab", name="Problems", selected=True)).to_be_visible()
    shown.press("F5")
    expect_running(shown, "patrol")
    expect(shown.page.get_by_role("tab", name="Problems", selected=True)).to_be_visible()
    show(shown, "walk")
    expect_running(shown, "walk")
    expect_current(shown, "wait")
    show(shown, "patrol")
    expect_running(shown, "patrol")


def test_enter_that_comes_before_the_question_answers_it(shown: EditorPage) -> None:
    run(shown)
    shown.page.reload()
    expect_running(shown)  # which is known before the drawing is there
    shown.state("go").wait_for()
    asked = shown.held("**/shell/before-run.js", lambda: shown.press("F5"))
    shown.press("Enter")
    asked.continue_()
    expect(shown.page.locator(".notice", has_text="Reloaded.")).to_be_visible()


def test_run_asks_before_it_ends_what_runs(shown: EditorPage) -> None:
    page = shown.page
    run(shown)
    shown.press("F8")
    expect(status(shown)).to_have_text("Paused")
    shown.press("F5")
    dialog = page.get_by_role("dialog", name="walk runs")
    expect(dialog.get_by_role("button", name="Reload")).to_be_focused()
    assert shown.violations("dialog") == []
    shown.press("Escape")
    expect(dialog).to_have_count(0)
    expect(status(shown)).to_have_text("Paused")
    shown.press("F5", "Enter")
    expect(page.locator(".notice", has_text="Reloaded.")).to_be_visible()
    expect(status(shown)).to_have_text("Paused")
    shown.press("Alt+Shift+t")
    expect(dialog.get_by_role("button", name="Run again")).to_be_focused()
    expect(dialog.get_by_role("button", name="Reload")).to_have_count(0)
    shown.press("Escape", "F5")
    dialog.get_by_role("button", name="Run again").click()
    expect_running(shown)
