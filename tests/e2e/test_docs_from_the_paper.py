"""docs/tutorial/from-the-paper.md: the experiments of the start page run as described."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage
from tests.support.screenshots import picture
from tests.support.tutorial import page_with_a_simulated_robot

pytestmark = [pytest.mark.slow, pytest.mark.gl]


@pytest.fixture
def shown(browser: Browser, tmp_path: Path) -> Iterator[EditorPage]:
    with page_with_a_simulated_robot(browser, tmp_path) as shown:
        yield shown


def test_two_experiments_run_from_the_start_page(shown: EditorPage) -> None:
    active = shown.page.locator(".active")
    shown.page.get_by_role("button", name="Dance Both arms").click()
    expect(shown.state("up")).to_be_visible()
    shown.press("F5")
    expect(active.first).to_be_visible()
    shown.press("Alt+l")
    shown.page.get_by_role("tab", name="3D").click()
    expect(shown.state("front").and_(active)).to_be_visible()
    picture(shown.page, "dance", "tutorial")
    shown.press("Shift+F5")
    expect(shown.page.locator(".live-status")).to_contain_text("Ended")

    shown.press("Alt+w")
    shown.page.get_by_role("button", name="Follow the ball").click()
    expect(shown.state("search")).to_be_visible()
    shown.press("F5")
    expect(active.first).to_be_visible()
    shown.page.get_by_role("tab", name="Cameras").click()
    expect(shown.page.locator(".marks").filter(has_text="green ball").first).to_be_visible()
    expect(shown.page.locator(".rate").first).to_contain_text("images/s")
    picture(shown.page, "follow", "tutorial")
    shown.press("Shift+F5")
    expect(shown.page.locator(".live-status")).to_contain_text("Ended")
