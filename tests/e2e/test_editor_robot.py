"""From the page to a moving robot: real simulations, components and balls, in Chromium."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from naoserver.safety.latch import Latch, latch_of
from tests.support.browser import EditorPage, editor_page
from tests.support.editor import DOCUMENT, editor
from tests.support.limits import CALL_LIMIT, RUN_LIMIT
from tests.support.monitor import patient_parts
from tests.support.processes import children, free_endpoint
from tests.support.robot_server import eventually
from zenoh_ice import Settings

STARTED = RUN_LIMIT * 1000
HEAD = "<nameinterface>head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface>"
LOOKING = DOCUMENT.replace(
    "</VisualHFSM>", f"<config><iceinterface>{HEAD}</iceinterface></config></VisualHFSM>"
)


def settings_at(endpoint: str) -> Settings:
    """Return the settings of an editor whose robot is to be at an endpoint."""
    return Settings(realm="test-robot", connect=(endpoint,), clock="wall", timeout=CALL_LIMIT)


@pytest.fixture
def shown(browser: Browser, tmp_path: Path) -> Iterator[EditorPage]:
    with (
        editor(tmp_path, make_parts=patient_parts(settings_at(free_endpoint()))) as running,
        editor_page(browser, running) as shown,
    ):
        yield shown
    assert not children("naoserver_sim")
    assert not children("ballmover")


def test_one_click_leads_to_a_robot_that_dances_in_3d_and_is_missed_when_it_is_lost(
    shown: EditorPage,
) -> None:
    shown.page.evaluate("localStorage.clear()")
    shown.button("Watch a robot dance").click()
    status = shown.page.locator(".live-status")
    expect(status).to_have_text("Running", timeout=STARTED)
    robot = shown.page.get_by_role("region", name="The robot").locator(".stage canvas")
    expect(robot).to_be_visible()
    expect(shown.page.get_by_role("button", name=re.compile("^Simulated Nao"))).to_be_visible()
    expect(shown.state("out")).to_have_attribute("aria-label", re.compile("active"), timeout=STARTED)
    (simulation,) = children("naoserver_sim")
    simulation.kill()
    expect(status).to_have_text(re.compile(r"^\s*Robot lost since"))
    expect(status).to_have_class(re.compile(r"\blost\b"))
    expect(shown.page.locator(".robot-now")).to_have_accessible_name(re.compile("^Robot lost since"))
    expect(robot).to_be_visible()


@pytest.mark.gl
def test_run_asks_once_for_a_robot_and_for_the_reset_of_its_emergency_stop(shown: EditorPage) -> None:
    shown.button("Follow the ball The head follows a ball, and searches for it when it is lost.").click()
    shown.page.locator(".state").first.wait_for()
    shown.press("F5")
    shown.button("Start and run").click()
    status = shown.page.locator(".live-status")
    expect(status).to_have_text("Running", timeout=STARTED)
    eventually(lambda: len(children("ballmover")) == 2)
    shown.press("Control+Shift+Space")
    expect(shown.page.get_by_role("button", name="Simulated Nao H25, stopped")).to_be_visible()
    expect(status).to_have_text(re.compile(r"^\s*Ended"))
    shown.press("F5")
    shown.button("Reset the emergency stop and run").click()
    expect(status).to_have_text("Running", timeout=STARTED)
    shown.press("Alt+b")
    menu = shown.page.get_by_role("dialog", name="Robot")
    menu.wait_for()
    expect(menu.get_by_role("button", name="Restart the simulation", exact=True)).to_be_visible()
    menu.get_by_label("Speed").select_option("2")
    expect(menu.get_by_role("button", name="Restart the simulation with these")).to_be_visible()
    expect(menu).to_contain_text("Robot, world and speed change with a restart")
    assert shown.violations("header", ".menu") == []
    menu.get_by_role("button", name="Restart the simulation with these").click()
    eventually(lambda: children("naoserver_sim", "--speed=2"))
    shown.page.get_by_role("button", name="Simulated Nao H25").wait_for()
    shown.press("Alt+b")
    shown.button("Stop the simulation").click()
    shown.button("No robot: start a simulation").wait_for()
    expect(status).to_have_text("Running, no robot")
    shown.press("F5")
    shown.page.get_by_role("dialog", name="follow_ball runs").get_by_role("button", name="Run again").click()
    comes = re.compile("^(Starting the simulation|Simulated Nao)")  # without a question about it
    expect(shown.page.get_by_role("button", name=comes)).to_be_visible()


@contextmanager
def looking(browser: Browser, folder: Path, endpoint: str) -> Iterator[EditorPage]:
    """Show an editor with a document that looks; its robot is to be at an endpoint."""
    path = folder / "look.xml"
    path.write_text(LOOKING)
    with (
        editor(folder, path, make_parts=patient_parts(settings_at(endpoint))) as running,
        editor_page(browser, running) as shown,
    ):
        shown.page.locator(".state").first.wait_for()
        yield shown


def test_a_run_without_its_robot_says_that_none_is_here(browser: Browser, tmp_path: Path) -> None:
    with looking(browser, tmp_path, free_endpoint()) as shown:
        shown.press("F5")
        shown.button("Run anyway").click()
        expect(shown.page.locator(".live-status")).to_have_text("Ended: no robot is here")
        expect(shown.page.locator(".notice")).to_contain_text("look ended: no robot is here.")


def test_stop_says_what_it_ended_of_a_run_that_only_starts(browser: Browser, tmp_path: Path) -> None:
    with looking(browser, tmp_path, free_endpoint()) as shown:
        shown.press("F5")
        shown.button("Run anyway").click()
        expect(shown.page.locator(".live-status")).to_have_text("Starting")
        shown.press("Control+Shift+Space")
        notice = shown.page.locator(".notice")
        expect(notice.filter(has_text="Ended: look.")).to_be_visible()
        expect(shown.page.locator(".live-status")).to_have_text("Ended: stopped by STOP")
        expect(notice.filter(has_text="nothing to stop")).to_have_count(0)


def test_start_and_run_offers_to_reset_a_stop_that_was_kept_and_another_robot_is_free(
    browser: Browser, tmp_path: Path
) -> None:
    endpoint = free_endpoint()
    latch = latch_of(settings_at(endpoint).override(listen=(endpoint,)), body="H25")
    assert isinstance(latch, Latch)
    with latch:
        latch.keep("smoke", None)
    with looking(browser, tmp_path, endpoint) as shown:
        shown.press("F5")
        shown.button("Start and run").click()
        asked = shown.page.get_by_role("dialog", name="The robot is stopped")
        expect(asked).to_contain_text("It refuses commands: smoke.", timeout=STARTED)
        shown.press("Escape")
        expect(asked).to_have_count(0)
        expect(shown.page.locator(".live-status")).to_have_count(0)

        shown.press("Alt+b")
        menu = shown.page.get_by_role("dialog", name="Robot")
        menu.get_by_role("combobox", name="Robot").select_option("H21")
        menu.get_by_role("button", name="Restart the simulation with these").click()
        expect(shown.page.get_by_role("button", name="Starting the simulation")).to_be_visible()
        shown.press("Escape", "F5")
        expect(shown.page.locator(".live-status")).to_have_text("Running", timeout=STARTED)
    assert not children("naoserver_sim")


@pytest.mark.gl
def test_the_tour_ends_what_runs_before_it_runs_its_own_behavior(shown: EditorPage) -> None:
    shown.button("Watch a robot dance").click()
    expect(shown.page.locator(".live-status")).to_have_text("Running", timeout=STARTED)
    shown.page.get_by_role("button", name="Start page").click()
    shown.button("Take the tour").click()
    tour = shown.page.locator(".tour")
    for step in range(1, 8):
        expect(tour).to_contain_text(f"{step} of 10")
        shown.press("ArrowRight")
    expect(shown.page.locator(".component")).to_have_text("dance_and_follow", timeout=STARTED)
    expect(shown.page.locator(".live-status")).to_have_text("Running", timeout=STARTED)
    expect(shown.button("1 running")).to_be_visible()
    expect(shown.page.locator(".notice.error")).to_have_count(0)  # nothing has gone wrong


@pytest.mark.gl
def test_the_tour_runs_a_behavior_and_ends_with_a_change_of_it(shown: EditorPage) -> None:
    shown.button("Take the tour").click()
    tour = shown.page.locator(".tour")
    for step in range(1, 8):
        expect(tour).to_contain_text(f"{step} of 10")
        shown.press("ArrowRight")
    expect(tour).to_contain_text("It runs")
    expect(shown.page.locator(".live-status")).to_have_text("Running", timeout=STARTED)
    shown.button("Next").click()
    shown.button("Next").click()
    expect(tour).to_contain_text("10 of 10")
    time = shown.page.get_by_label("After", exact=True)
    expect(time).to_be_focused()
    time.fill("500")
    shown.press("F9")
    expect(shown.state("dance")).to_have_attribute("aria-label", re.compile("active"))
    shown.button("Done").click()
    expect(tour).to_have_count(0)
