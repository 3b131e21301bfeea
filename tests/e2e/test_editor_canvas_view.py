"""What of a document is seen: the middle of the view, the path to the shown automaton, and the tree."""

from __future__ import annotations

from itertools import pairwise

import pytest
from playwright.sync_api import expect

from tests.support.browser import Box, EditorPage
from tests.support.documents import document as document_of
from tests.support.documents import state, sub, transition

LEVELS = 14
FAR_NAMES = """() => [...document.querySelector("hfsm-canvas").surface.querySelectorAll(".label .title")]
  .map((name) => [name, ...document.querySelectorAll(".transition .handle .knob")]
    .map((each) => each.getBoundingClientRect()))
  .map(([name, knob]) => Math.max(knob.left - name.right, name.left - knob.right,
    knob.top - name.bottom, name.top - knob.bottom)).filter((gap) => gap > 12)"""
"""The pixels between the name of the only transition and its handle, if they are too many."""
ZOOM = """scale => {
  const {viewport} = document.querySelector("hfsm-canvas");
  viewport.zoom(scale / viewport.scale);
}"""
NAMES = """() => [...document.querySelectorAll("hfsm-canvas .state .name")]
  .filter((each) => each.checkVisibility())
  .map((each) => [each.textContent, each.getBoundingClientRect().toJSON(), parseFloat(each.getAttribute("font-size"))])"""
"""What is seen of the names of states, where, and the size of their letters in the drawing."""


DEEP = document_of(
    *(
        sub(each, each - 1, state(1, f"level{each}", initial=True, child=each + 1))
        for each in range(1, LEVELS + 1)
    )
)


def placed(element: str, x: int, y: int) -> str:
    """Give a state, or the handle of a transition, a place."""
    return element.replace("<name>", f"<posx>{x}</posx><posy>{y}</posy><name>")


@pytest.fixture
def document() -> str:
    return DEEP


LONG = document_of(
    sub(
        1,
        0,
        placed(state(1, "down", initial=True), 100, 100),
        placed(state(2, "up"), 100, 400),
        placed(
            transition(1, 1, 2, "self.the_arms_have_come_to_rest() and self.enough", name="there"), 130, 250
        ),
    )
)


@pytest.mark.parametrize("document", [LONG], ids=["a long condition"])
def test_the_name_of_a_transition_stays_beside_its_handle_where_its_second_line_is_hidden(
    shown: EditorPage,
) -> None:
    shown.expect_states("down", "up")
    name = shown.page.locator("hfsm-canvas .label .title")
    for scale in (0.94, 0.89, 0.84, 0.7):
        shown.page.evaluate(ZOOM, scale)
        expect(shown.page.locator(".zoom")).to_have_text(f"{scale:.0%}".replace("%", " %"))
        expect(name).to_have_text("there")
        assert shown.page.evaluate(FAR_NAMES) == [], scale


NAMED = ("approach", "look around", "wait")
WIDE = document_of(
    sub(
        1,
        0,
        *(
            placed(state(each, name, initial=each == 1), 230 * each, 100)
            for each, name in enumerate(NAMED, 1)
        ),
    )
)


@pytest.mark.parametrize("document", [WIDE], ids=["a wide drawing"])
def test_names_of_states_are_read_from_far_away_and_none_covers_another(shown: EditorPage) -> None:
    shown.expect_states(*NAMED)
    for scale in (1.0, 0.7, 0.5, 0.39, 0.3, 0.24):
        shown.page.evaluate(ZOOM, scale)
        seen = shown.page.evaluate(NAMES)
        assert tuple(name for name, _, _ in seen) == NAMED, scale
        assert all(size * scale >= 9.9 for _, _, size in seen), scale
        boxes = sorted((box["left"], box["right"]) for _, box, _ in seen)
        assert all(right < left for (_, right), (left, _) in pairwise(boxes)), scale
    shown.page.evaluate(ZOOM, 0.2)
    assert shown.page.evaluate(NAMES) == []


def test_an_action_is_found_the_middle_of_the_view_kept_and_a_drawing_outside_shown(
    shown: EditorPage,
) -> None:
    # Keys that come before the list is there go into its field.
    shown.press("Control+k")
    shown.type("zoom")
    dialog = shown.page.get_by_role("dialog", name="All actions")
    options = dialog.get_by_role("option")
    # Those that are called so come first, then *Fit* and *Fit the selection*, which others call so.
    expect(options).to_have_count(5)
    expect(options.nth(2)).to_contain_text("Always zoom with the wheel")
    expect(options.first).to_have_attribute("aria-selected", "true")
    assert shown.violations("dialog") == []
    radius = shown.radius_of("level1")
    shown.press("ArrowDown", "Enter")
    expect(dialog).to_have_count(0)
    expect(shown.page.locator(".zoom")).to_have_text("100 %")  # a little later than the dialog is closed
    assert shown.radius_of("level1") < radius
    shown.expect_states("level1")

    page = shown.page
    outside = page.get_by_role("button", name="Everything is outside")
    page.mouse.move(*shown.middle_of("level1"))
    page.mouse.wheel(0, -300)
    shown.press("Alt+n")
    expect(page.locator("hfsm-canvas .empty")).to_be_visible()
    shown.resize(900, 600)
    page.get_by_role("tab", name="walk").click()
    expect(shown.state("level1")).to_be_visible()
    box = page.locator("hfsm-canvas").bounding_box()
    assert box is not None
    shown.expect_at("level1", (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2), within=8)
    expect(outside).to_be_hidden()
    for _ in range(6):
        page.keyboard.down("Shift")
        page.mouse.move(box["x"] + 100, box["y"] + 100)
        page.mouse.wheel(0, 300)
        page.keyboard.up("Shift")
    outside.click()
    expect(outside).to_be_hidden()
    shown.expect_at("level1", (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2), within=8)

    # A long path shows where it ends, and the tree scrolls sideways.
    shown.resize(700, 600)
    for number in range(1, LEVELS):
        shown.state(f"level{number}").focus()
        shown.press("Control+Enter")
        shown.state(f"level{number + 1}").wait_for()
    crumbs = page.locator("hfsm-breadcrumbs")
    expect(crumbs.get_by_role("listitem")).to_have_count(4)
    current = crumbs.locator("[aria-current]")
    expect(current).to_have_text(f"level{LEVELS - 1}")
    width, needed = current.evaluate("each => [each.clientWidth, each.scrollWidth]")
    assert width >= needed
    tree = page.locator("hfsm-tree")
    name = tree.locator(".text", has_text=f"level{LEVELS}").last
    width, needed = name.evaluate("each => [each.clientWidth, each.scrollWidth]")
    assert 0 < needed <= width
    assert tree.evaluate("each => each.scrollWidth > each.clientWidth")
    expect(name).to_be_in_viewport()
    crumbs.get_by_role("combobox").select_option(label="level3")
    expect(current).to_have_text("level3")


def test_a_bar_above_the_canvas_moves_nothing_in_the_window(shown: EditorPage) -> None:
    page = shown.page
    place, radius = shown.middle_of("level1"), shown.radius_of("level1")
    shown.connections.cut()
    page.get_by_text("No connection since").wait_for()
    shown.expect_at("level1", place)
    assert shown.radius_of("level1") == radius
    shown.connections.restore()
    # It may try by itself just now, and take the button away.
    shown.button("Try now").evaluate_all("all => all.forEach((each) => each.click())")
    expect(page.get_by_text("No connection since")).to_have_count(0)
    shown.expect_at("level1", place)
    assert shown.radius_of("level1") == radius


MANY = 301
CROWDED = document_of(
    sub(
        1,
        0,
        *(
            placed(state(each, f"state {each}", initial=each == 1), each % 20 * 240, each // 20 * 200)
            for each in range(1, MANY + 1)
        ),
        placed(transition(1, 1, 2, "self.ready", name="go"), 360, -60),
    )
)


@pytest.mark.parametrize("document", [CROWDED], ids=["many states"])
def test_many_states_are_all_drawn_moved_at_once_and_the_page_suggests_fewer(own: EditorPage) -> None:
    expect(own.page.locator(".notice")).to_contain_text("More than 300 states in one automaton")
    expect(own.page.locator("hfsm-canvas .state")).to_have_count(MANY)
    status = own.page.locator("hfsm-status .about")
    before = x, y = own.middle_of("state 150")
    far = own.middle_of(f"state {MANY}")
    own.page.locator("hfsm-canvas .surface").focus()
    own.press("Control+a")
    expect(status).to_have_text(f"{MANY} states, 1 transition")
    mouse = own.page.mouse
    mouse.move(x, y)
    mouse.down()
    mouse.move(x + 40, y + 60, steps=2)
    own.expect_at(f"state {MANY}", (far[0] + 40, far[1] + 60))
    own.press("Escape")
    mouse.up()
    own.expect_at(f"state {MANY}", far)
    own.drag(before, (x + 40, y + 60))
    expect(own.page.locator(".last-step")).to_have_text(f"Move {MANY} states and 1 transition")
    own.expect_at(f"state {MANY}", (far[0] + 40, far[1] + 60))


@pytest.mark.parametrize("document", [LONG], ids=["two states"])
def test_a_box_may_be_drawn_while_another_window_adds_a_state(own: EditorPage) -> None:
    canvas = Box.of(own.page.locator("hfsm-canvas"))
    mouse = own.page.mouse
    mouse.move(canvas.x + 4, canvas.y + 4)
    mouse.down()
    mouse.move(canvas.x + 40, canvas.y + 40)
    with own.editor.window() as other:
        other.ask("do", tab=1, command={"command": "addState", "automaton": 1, "x": 400, "y": 100})
    expect(own.page.locator(".last-step")).to_have_text("Add a state")
    mouse.move(canvas.x + canvas.width - 4, canvas.y + canvas.height - 4)
    mouse.up()
    expect(own.page.locator("hfsm-status .about")).to_have_text("2 states, 1 transition")
