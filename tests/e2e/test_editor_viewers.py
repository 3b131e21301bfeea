"""The page of viewers: what it shows, and how it ends."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.support.browser import EditorPage, new_context, shared_address
from tests.support.soak import cases


@pytest.fixture
def viewer(shown: EditorPage, browser: Browser) -> Iterator[Page]:
    """The page of somebody who looks on."""
    with contextlib.closing(new_context(browser)) as context:
        page = context.new_page()
        page.clock.install()
        page.goto(shared_address(shown))
        expect(page.locator("hfsm-canvas .state")).to_have_count(2)
        yield page


def test_a_page_whose_address_is_withdrawn_says_so_and_asks_no_more(
    shown: EditorPage, viewer: Page, caplog: pytest.LogCaptureFixture
) -> None:
    viewer.wait_for_load_state("networkidle")  # it has asked for all that it loads later
    withdraw(shown)
    expect(viewer.locator(".banner")).to_have_text(
        "The owner has withdrawn this address. To look on again, ask the owner for a new one."
    )
    asked: list[str] = []
    viewer.on("request", lambda request: asked.append(request.url))
    viewer.on("websocket", lambda socket: asked.append(socket.url))
    viewer.clock.fast_forward(600_000)
    viewer.evaluate("fetch('.')")  # whatever the page asked for came before
    assert [each for each in asked if not each.endswith("/view/")] == []
    assert len(asked) == 1
    assert len([each for each in caplog.messages if each.startswith("refused")]) <= 1


def test_a_page_that_was_refused_comes_back_by_a_new_address_in_its_browser(
    shown: EditorPage, viewer: Page
) -> None:
    withdraw(shown)
    alert = viewer.locator(".banner.error")
    expect(alert).to_contain_text("ask the owner for a new one")
    with contextlib.closing(viewer.context.new_page()) as other:
        other.goto(shared_address(shown))
        expect(alert).to_have_count(0)
        expect(viewer.locator("hfsm-canvas .state")).to_have_count(2)


def test_a_page_that_looks_on_shows_only_what_its_viewer_can_use(viewer: Page) -> None:
    expect(viewer.get_by_text("Read only")).to_be_visible()
    for name in ("Run", "Undo", "Start page", "Robot", "Other ways to run", "Actions"):
        expect(viewer.get_by_role("button", name=name, exact=True)).to_have_count(0)
    expect(viewer.get_by_role("button", name="STOP the robot")).to_be_enabled()
    expect(viewer.locator(":disabled:not([data-action=up])")).to_have_count(0)
    viewer.get_by_role("menuitem", name="Edit").click()
    expect(viewer.get_by_role("menu").get_by_role("menuitem")).to_have_text(
        [re.compile(each) for each in ("Select all", "Search", "Edit code")]
    )
    viewer.keyboard.press("Escape")
    viewer.get_by_role("button", name="State wait,").dblclick()
    code = viewer.locator("hfsm-code-panel .cm-content")
    expect(code).to_contain_text("pass")
    code.click()
    viewer.keyboard.type("x")
    expect(code).to_have_text("pass")
    viewer.get_by_role("menuitem", name="Edit").click()
    viewer.get_by_role("menuitem", name="Search").click()
    expect(viewer.get_by_placeholder("Search in names and code")).to_be_visible()
    expect(viewer.get_by_placeholder("Replace by")).to_have_count(0)
    tabs = viewer.get_by_role("region", name="Panel below the canvas").get_by_role("tab")
    expect(tabs).to_have_text([re.compile(each) for each in ("Problems", "Search", "Output", "Timeline")])


@pytest.mark.parametrize("width", cases([390], [1440]))
def test_axe_finds_nothing_on_the_page_of_viewers(browser: Browser, shown: EditorPage, width: int) -> None:
    with contextlib.closing(new_context(browser)) as context:
        viewer = EditorPage(context.new_page(), shown.editor, shared_address(shown))
        viewer.resize(width, 844)
        viewer.page.emulate_media(reduced_motion="reduce")
        expect(viewer.page.get_by_text("Read only")).to_be_visible()
        viewer.expect_states("wait", "go")
        assert viewer.violations() == []


def withdraw(shown: EditorPage) -> None:
    """Withdraw the address for viewers."""
    shown.press("Control+k")
    shown.page.keyboard.type("Share to look")
    shown.press("Enter")
    shown.page.get_by_role("button", name="Withdraw it").click()
    shown.page.get_by_text("nobody looks on any more").wait_for()
