"""The page of a pupil in a JupyterHub, from the login to the end of the server."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.support.browser import new_window
from tests.support.jupyter_hub import SERVER_LIMIT, Hub, jupyter_hub
from tests.support.limits import RUN_LIMIT, START_LIMIT
from tests.support.processes import assert_gone

NAME = "eva@school.es"


@pytest.fixture
def hub(tmp_path: Path) -> Iterator[Hub]:
    with jupyter_hub(tmp_path) as hub:
        yield hub


@pytest.fixture
def page(hub: Hub, browser: Browser) -> Iterator[Page]:
    """The window of a pupil who has logged in, as soon as it shows the editor."""
    page = new_window(browser)
    page.goto(hub.address)
    page.get_by_label("Username").fill(NAME)
    page.get_by_label("Password").fill("any")
    page.get_by_role("button", name="Sign in").click()
    page.wait_for_url(f"**/user/{NAME}/visualhfsm/", timeout=SERVER_LIMIT * 1000)
    yield page
    page.context.close()


@pytest.mark.sim
@pytest.mark.timeout(600)
def test_a_pupil_runs_a_behavior_and_keeps_what_was_not_saved(hub: Hub, page: Page) -> None:
    page.get_by_role("button", name="Watch a robot dance").click()
    expect(page.locator(".live-status")).to_have_text("Running", timeout=RUN_LIMIT * 1000)
    expect(page.get_by_role("button", name="Simulated Nao H25")).to_be_visible()
    page.locator("hfsm-canvas .state").last.click()
    page.keyboard.press("Delete")
    expect(page.locator("hfsm-canvas .state")).to_have_count(3)

    killed = hub.editor(NAME)
    below = killed.children(recursive=True)
    killed.kill()
    assert_gone([killed, *below])
    recover = page.get_by_role("button", name="Recover dance")
    recover.click(timeout=START_LIMIT * 1000)  # the page has come back by itself
    expect(page.locator("hfsm-canvas .state")).to_have_count(3)

    processes = hub.processes(NAME)
    hub.stop(NAME)
    assert_gone(processes)
    offline = page.get_by_role("alert").filter(has_text="No connection since")
    expect(offline).to_contain_text("load it again: you may have to log in, or to start your server")
    page.reload()
    expect(page.get_by_role("button", name="Launch Server")).to_be_visible()
