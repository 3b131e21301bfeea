"""docs/tutorial/from-the-paper.md: its pictures, and those of a run in docs/how-to/editor.md.

That all this works is tested with smaller behaviors in test_editor_robot.py and test_editor_monitor.py, and with
these experiments in test_experiments.py.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage
from tests.support.limits import MOVE_LIMIT
from tests.support.robot_server import eventually
from tests.support.screenshots import moving_picture, picture
from tests.support.tutorial import page_of_a_reader, start_simulation

pytestmark = [
    pytest.mark.slow,
    pytest.mark.gl,
    pytest.mark.skipif(not os.environ.get("SCREENSHOTS"), reason="only takes pictures: set SCREENSHOTS"),
]


@pytest.fixture
def shown(browser: Browser, tmp_path: Path) -> Iterator[EditorPage]:
    with page_of_a_reader(browser, tmp_path) as shown:
        start_simulation(shown)
        yield shown


def test_two_experiments_run_from_the_start_page(shown: EditorPage) -> None:
    active = shown.page.locator(".active")
    ended = shown.page.locator(".live-status").filter(has_text="Ended")
    shown.page.get_by_role("button", name=re.compile("^Dance Both arms")).click()
    expect(shown.state("up")).to_be_visible()
    shown.press("F5")
    expect(active.first).to_be_visible()
    shown.show_robot()
    expect(shown.state("front").and_(active)).to_be_visible()
    picture(shown.page, "dance", "tutorial")
    shown.press("Shift+F5")
    expect(ended).to_be_visible()

    shown.press("Alt+w")
    shown.page.get_by_role("button", name="Follow the ball").click()
    expect(shown.state("search")).to_be_visible()
    shown.press("F5")
    expect(active.first).to_be_visible()
    shown.press("Alt+l")
    shown.page.get_by_role("tab", name="Cameras").click()
    expect(shown.page.locator(".marks").filter(has_text="green ball").first).to_be_visible()
    expect(shown.page.locator(".rate").first).to_contain_text(re.compile("images?/s"))
    picture(shown.page, "follow", "tutorial")
    shown.press("Shift+F5")
    expect(ended).to_be_visible()


def test_the_third_experiment_is_watched_and_changed(shown: EditorPage) -> None:
    shown.page.get_by_role("button", name="Dance and follow").click()
    expect(shown.state("followBall")).to_be_visible()
    shown.press("F5")
    watch(shown)
    change(shown)
    shown.press("Shift+F5")
    expect(shown.page.locator(".live-status").filter(has_text="Ended")).to_be_visible()


def watch(shown: EditorPage) -> None:
    """Show what the third experiment left as a ghost, and the robot."""
    page = shown.page
    expect(shown.state("dance").and_(page.locator(".active"))).to_be_visible()
    shown.state("followBall").dblclick()
    expect(page.locator(".state.ghost")).to_have_count(1)
    expect(page.locator(".state.active")).to_have_count(0)
    picture(page, "ghost")
    shown.press("Backspace")
    expect(page.locator(".state.active")).to_have_count(1)
    shown.show_robot()
    expect(page.locator("hfsm-robot-view canvas")).to_be_visible()
    eventually(lambda: page.evaluate("document.querySelector('hfsm-robot-view').grabbing.enabled"))
    page.evaluate("document.querySelector('hfsm-robot-view').drawing.drawn()")
    moving_picture(page, "running", seconds=12)


def change(shown: EditorPage) -> None:
    """Change the code of a state while it runs, and show that the new code runs."""
    page = shown.page
    shown.state("dance").click()
    shown.press("Shift+Enter")
    page.get_by_role("textbox", name="Code of the state dance").click()
    shown.type("print('dancing at', round(self.clock.now()))")
    shown.press("Escape")
    expect(page.locator("hfsm-status")).to_contain_text("Edit the code of “dance”")
    shown.press("F9")
    expect(page.get_by_role("status").filter(has_text="Reloaded")).to_be_visible()
    shown.press("Alt+o")
    # It may be following a ball for ten seconds before it dances again.
    output = page.locator("hfsm-output").filter(has_text="dancing at")
    output.wait_for(timeout=(10 + MOVE_LIMIT) * 1000)
    picture(page, "changed")
