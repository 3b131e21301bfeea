"""A large automaton on the canvas: only what is seen is on the page, and all else works as in a small one."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import Box, EditorPage, editor_page, saved
from tests.support.editor import editor
from tests.support.panels import undo_names

COLUMNS = 40
STATES = 1200
MIDDLE = STATES // 2 + COLUMNS // 2
TWO_FRAMES = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    states = "".join(
        f'<state id="{number}" initial="{str(number == 1).lower()}"><posx>{number % COLUMNS * 240}</posx>'
        f"<posy>{number // COLUMNS * 200}</posy><name>state {number}</name></state>"
        for number in range(1, STATES + 1)
    )
    arc = (
        '<transition id="1"><posx>120</posx><posy>0</posy><origin>1</origin><destiny>2</destiny>'
        '<name>go</name><trans type="time">1</trans></transition>'
    )
    path = tmp_path_factory.mktemp("large") / "root" / "large.xml"
    path.parent.mkdir()
    path.write_text(f'<VisualHFSM><SubAutomata id="1" idFather="0">{states}{arc}</SubAutomata></VisualHFSM>')
    return path


@pytest.fixture(scope="module")
def opened(browser: Browser, path: Path) -> Iterator[EditorPage]:
    """The page with the automaton, which takes long to open."""
    with editor(path.parent, path) as running, editor_page(browser, running) as opened:
        opened.page.locator("hfsm-canvas .state").first.wait_for()
        yield opened


@pytest.fixture
def shown(opened: EditorPage) -> Iterator[EditorPage]:
    """The page as it was opened."""
    yield opened
    opened.page.locator("hfsm-canvas .surface").focus()
    opened.press("Escape", "Escape")
    undo = opened.button("Undo")
    for _ in undo_names(opened):
        undo.click()
    expect(undo).to_be_disabled()
    opened.page.locator("hfsm-canvas .surface").focus()
    opened.press("Control+a", "Escape")  # the keys begin at the first state again, not at what was undone
    opened.page.evaluate("document.querySelector('hfsm-app').showSide('')")
    opened.page.evaluate("document.querySelector('hfsm-app').showBottom('')")
    opened.button("Fit").click()


def place_of(shown: EditorPage, number: int) -> tuple[float, float]:
    """Return where a state is in the window, whether it is on the page or not."""
    shown.page.wait_for_function("document.querySelector('hfsm-canvas').drawing.places.size")
    x, y = shown.page.evaluate(
        """([x, y]) => {
          const canvas = document.querySelector("hfsm-canvas");
          const [place, {left, top}] = [canvas.viewport.toWindow({x, y}), canvas.getBoundingClientRect()];
          return [left + place.x, top + place.y];
        }""",
        [number % COLUMNS * 240, number // COLUMNS * 200],
    )
    return x, y


def expect_selected(shown: EditorPage, what: str) -> None:
    """Wait until the line of status says what is selected."""
    expect(shown.page.locator("hfsm-status .about")).to_have_text(what)


def test_only_what_is_seen_is_on_the_page(shown: EditorPage) -> None:
    elements = shown.page.locator("hfsm-canvas [data-key]")
    place_of(shown, 1)
    assert elements.count() < STATES / 10
    shown.press("+", "+", "+")  # hundreds are in sight, too small to have names
    shown.page.evaluate(TWO_FRAMES)
    assert elements.count() < STATES / 10
    shown.press("+", "+", "+", "+", "+", "+")
    shown.state(f"state {MIDDLE}").wait_for()
    expect(shown.state("state 2")).to_have_count(0)
    shown.page.wait_for_function(
        "most => document.querySelectorAll('hfsm-canvas [data-key]').length < most", arg=STATES // 4
    )
    shown.press("f")
    expect(shown.state(f"state {MIDDLE}")).to_have_count(0)
    assert elements.count() < STATES / 10


def test_a_state_among_all_others_is_selected_by_a_click_and_opened_by_two(shown: EditorPage) -> None:
    x, y = place_of(shown, 500)
    shown.page.mouse.click(x, y)
    expect_selected(shown, "State state 500")
    expect(shown.state("state 500")).to_be_focused()
    x, y = place_of(shown, 640)
    shown.page.mouse.dblclick(x, y)
    expect(shown.page.locator("hfsm-code-panel")).to_contain_text("state 640")


def test_a_state_among_all_others_is_dragged(shown: EditorPage, path: Path) -> None:
    x, y = place_of(shown, 500)
    shown.drag((x, y), (x + 60, y + 30))
    expect(shown.page.locator(".last-step")).to_have_text("Move “state 500”")
    moved = {state.id: (state.x, state.y) for state in saved(shown, path).automata[0].states}
    assert moved[500][0] > 500 % COLUMNS * 240 + 300
    assert moved[501] == (501 % COLUMNS * 240, 501 // COLUMNS * 200)


def test_a_drag_of_all_is_seen_and_can_be_cancelled(shown: EditorPage, path: Path) -> None:
    x, y = place_of(shown, 500)
    shown.press("Control+a")
    expect_selected(shown, f"{STATES} states, 1 transition")
    crowd = shown.page.locator(".circles > .crowd")
    before = Box.of(crowd)
    shown.page.mouse.move(x, y)
    shown.page.mouse.down()
    shown.page.mouse.move(x + 20, y + 30)
    shown.page.mouse.move(x + 40, y + 60)
    assert Box.of(crowd).x == pytest.approx(before.x + 40, abs=2)
    shown.press("Escape")
    shown.page.mouse.up()
    assert Box.of(crowd).x == pytest.approx(before.x, abs=2)
    shown.drag((x, y), (x + 40, y + 60))
    expect(shown.page.locator(".last-step")).to_have_text(f"Move {STATES} states and 1 transition")
    assert Box.of(crowd).x == pytest.approx(before.x + 40, abs=2)


def test_keys_lead_to_states_that_are_not_on_the_page(shown: EditorPage) -> None:
    place_of(shown, 1)
    shown.press("Tab")
    shown.page.locator("hfsm-canvas .surface").focus()
    shown.press("v", "+", "+", "+", "+", "+", "+", "+", "+", "+")
    expect(shown.state("state 1")).to_be_focused()
    shown.press(",")
    expect(shown.state(f"state {STATES}")).to_be_focused()
    expect(shown.state(f"state {STATES}")).to_be_in_viewport()
    shown.press("Alt+ArrowUp")
    expect(shown.state(f"state {STATES - COLUMNS}")).to_be_focused()
    shown.press(".", ".")
    expect(shown.state(f"state {STATES - COLUMNS + 2}")).to_be_focused()


def test_a_state_that_is_found_is_shown(shown: EditorPage) -> None:
    place_of(shown, 1)
    shown.press("+", "+", "+", "+", "+", "+", "+", "+", "+", "Control+f")
    shown.page.get_by_role("searchbox", name="Search").fill("state 1111")
    shown.page.locator("hfsm-search").get_by_text("state 1111").first.click()
    expect(shown.state("state 1111")).to_be_in_viewport()
    expect(shown.state("state 1111").locator(".name")).to_have_text("state 1111")


def test_a_picture_has_all_of_it(shown: EditorPage) -> None:
    place_of(shown, 1)
    text: str = shown.page.evaluate(
        """async () => {
          const all = [...document.querySelectorAll("link[rel=modulepreload]")].map(({href}) => href);
          const canvas = all.find((each) => each.endsWith("/canvas/canvas.js"));
          const {svgText} = await import(canvas.replace("canvas.js", "export.js"));
          return svgText(document.querySelector("hfsm-canvas").drawing.automaton);
        }"""
    )
    assert text.count("<circle") >= STATES
    named = {
        int(number) for pair in re.findall(r">(\d+)</tspan>|state (\d+)<", text) for number in pair if number
    }
    assert named >= set(range(1, STATES + 1))


def test_a_box_may_be_drawn_while_another_window_adds_a_state_names_are_near_and_the_map_leads_far(
    shown: EditorPage,
) -> None:
    place_of(shown, 1)
    canvas = shown.page.locator("hfsm-canvas").bounding_box()
    assert canvas is not None
    mouse = shown.page.mouse
    mouse.move(canvas["x"] + 4, canvas["y"] + 4)
    mouse.down()
    mouse.move(canvas["x"] + 40, canvas["y"] + 40)
    with shown.editor.window() as other:
        other.ask("do", tab=1, command={"command": "addState", "automaton": 1, "x": -99, "y": -99})
    expect(shown.page.locator(".last-step")).to_have_text("Add a state")
    mouse.move(canvas["x"] + canvas["width"] - 4, canvas["y"] + canvas["height"] - 4)
    mouse.up()
    expect_selected(shown, f"{STATES} states, 1 transition")
    shown.press("Escape")
    shown.state("state 1").focus()
    expect_selected(shown, "State state 1")
    shown.press("Shift+f")
    expect(shown.state("state 1").locator(".name")).to_have_text("state 1")
    expect(shown.transition("go").locator(".handle")).to_be_visible()
    expect(shown.page.locator(".label .title")).to_have_text("go")
    assert 0 < shown.page.locator("hfsm-canvas .name").count() < STATES / 2

    corner = shown.state(f"state {STATES - 1}")
    expect(corner).not_to_be_in_viewport()
    minimap = shown.page.get_by_role("img", name="Map of the automaton")
    expect(minimap).to_be_visible()
    area = minimap.bounding_box()
    assert area is not None
    mouse.click(area["x"] + area["width"] - 12, area["y"] + area["height"] - 12)
    expect(corner).to_be_in_viewport()
    expect(shown.state("state 1")).not_to_be_in_viewport()
