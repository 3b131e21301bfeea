"""A large automaton on the canvas, also while another window changes it."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.support.browser import EditorPage

COLUMNS = 40
STATES = 1200


@pytest.fixture
def path(root: Path) -> Path:
    states = "".join(
        f'<state id="{number}" initial="{str(number == 1).lower()}"><posx>{number % COLUMNS * 240}</posx>'
        f"<posy>{number // COLUMNS * 200}</posy><name>state {number}</name></state>"
        for number in range(1, STATES + 1)
    )
    arc = (
        '<transition id="1"><posx>120</posx><posy>0</posy><origin>1</origin><destiny>2</destiny>'
        '<name>go</name><trans type="time">1</trans></transition>'
    )
    path = root / "large.xml"
    path.write_text(f'<VisualHFSM><SubAutomata id="1" idFather="0">{states}{arc}</SubAutomata></VisualHFSM>')
    return path


def test_a_box_may_be_drawn_while_another_window_adds_a_state_names_are_near_and_the_map_leads_far(
    shown: EditorPage,
) -> None:
    expect(shown.page.locator("hfsm-canvas .state")).to_have_count(STATES)
    shown.state("state 1").wait_for()
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
    expect(shown.page.locator("hfsm-canvas .state.selected")).to_have_count(STATES)
    expect(shown.page.locator("hfsm-canvas .state")).to_have_count(STATES + 1)
    shown.press("Escape")
    expect(shown.page.locator("hfsm-canvas .name")).to_have_count(0)
    shown.state("state 1").focus()
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
