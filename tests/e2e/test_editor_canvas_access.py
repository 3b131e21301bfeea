"""Accessibility of the editor's screens: the findings of axe, keys and names."""

from __future__ import annotations

from typing import Literal

import pytest
from playwright.sync_api import expect

from tests.support.browser import EditorPage

FOCUSABLE = "a, button, input, select, summary, textarea, [tabindex]"
# What had the focus outside a dialog since this ran last.
FOCUSED_OUTSIDE = """() => {
  const outside = window.outside ?? [];
  if (!window.outside)
    addEventListener("focusin", ({target}) => target.closest("dialog") || window.outside.push(target.outerHTML));
  window.outside = [];
  return outside;
}"""


@pytest.fixture
def shown(start_page: EditorPage) -> EditorPage:
    return start_page


def open_example(shown: EditorPage) -> None:
    shown.page.get_by_role("button", name="Dance and follow").click()
    shown.state("followBall").wait_for()


def test_the_start_page_and_the_canvas_are_accessible(shown: EditorPage) -> None:
    assert shown.violations() == []
    open_example(shown)
    expect(shown.page.get_by_role("application")).to_have_attribute(
        "aria-label", "Automaton dance_and_follow"
    )
    expect(shown.state("followBall")).to_have_attribute(
        "aria-label", "State followBall, initial, has a sub-automaton"
    )
    expect(shown.transition("enough")).to_have_attribute(
        "aria-label", "Transition enough from followBall to dance, after a time"
    )

    # Tab reaches every area in the order in which they stand.
    areas: list[str] = []
    for _ in range(100):
        shown.press("Tab")
        area = shown.page.evaluate(
            "document.activeElement.closest('header, .left, .toolbar, .tools, hfsm-canvas, footer')?.className"
            " || document.activeElement.closest('header, hfsm-canvas, footer')?.localName || ''"
        )
        if area and (not areas or areas[-1] != area):
            areas.append(area)
        if area == "footer" and "left" in areas:
            break
    order = ["tools", "left", "hfsm-canvas", "toolbar", "footer"]
    found = [area for area in areas if area in order]
    start = found.index("tools")
    assert found[start : start + len(order)] == order
    shown.state("followBall").click()
    assert shown.violations() == []


def test_menus_dialogs_and_the_tour_are_accessible_and_hold_the_focus(shown: EditorPage) -> None:
    open_example(shown)
    shown.state("dance").click(button="right")
    shown.page.get_by_role("menu").wait_for()
    assert shown.violations(".menu") == []
    shown.press("ArrowDown", "Escape")
    expect(shown.page.get_by_role("menu")).to_have_count(0)
    expect(shown.state("dance")).to_be_focused()
    dialog = shown.page.get_by_role("dialog")
    for key in (
        "Control+o",
        "Control+Shift+S",
        "Control+e",
        "Control+k",
        "?",
    ):
        shown.press(key)
        dialog.wait_for()
        assert shown.violations("dialog") == [], key
        shown.page.evaluate(FOCUSED_OUTSIDE)
        for _ in range(dialog.locator(FOCUSABLE).count() + 2):
            shown.press("Tab")
        assert shown.page.evaluate(FOCUSED_OUTSIDE) == [], key
        shown.press("Escape")
        expect(dialog).to_have_count(0)
        expect(shown.state("dance")).to_be_focused()

    shown.press("?")
    shown.page.get_by_role("button", name="Take the tour").click()
    tour = shown.page.locator(".tour")
    tour.wait_for()
    assert shown.violations(".tour") == []
    for _ in range(6):
        shown.press("ArrowRight")
    expect(tour).to_contain_text("7 of 10")  # the next step runs the example
    shown.press("Escape")
    expect(tour).to_have_count(0)


@pytest.mark.parametrize("forced", ["none", "active"])
def test_focus_and_selection_look_different(shown: EditorPage, forced: Literal["none", "active"]) -> None:
    open_example(shown)
    shown.page.emulate_media(forced_colors=forced)
    color = "each => getComputedStyle(each).stroke"
    for each in (shown.state("dance"), shown.transition("tired")):
        ring, sign = each.locator(".focus-ring"), each.locator(".glow, .line").last
        shown.press("Escape")
        plain = sign.evaluate(color)
        each.focus()
        expect(each).to_have_attribute("aria-pressed", "true")
        expect(ring).to_be_visible()
        chosen = sign.evaluate(color)
        assert plain != chosen != ring.evaluate(color)
        shown.press("Escape")
        expect(each).not_to_have_attribute("aria-pressed", "true")
        expect(each).to_be_focused()
        expect(ring).to_be_visible()
        assert sign.evaluate(color) == plain
        shown.state("followBall").focus()
        expect(ring).to_be_hidden()
    shown.page.locator("hfsm-canvas .surface").focus()
    for ring in shown.page.locator("hfsm-canvas .focus-ring").all():
        expect(ring).to_be_hidden()
