"""Draw automata on the editor's canvas with mouse and keys, through the real server."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from tests.support.browser import EditorPage, editor_page, saved
from tests.support.editor import editor
from tests.support.limits import FOREVER
from tests.support.monitor import comes_true
from tests.support.soak import cases

LEAST_MOVE = 3.0  # pixels
COUNT_CHANGES = """() => {
    window.changes = [];
    new MutationObserver((all) => {
        for (const {target, addedNodes, removedNodes} of all)
            changes.push([...addedNodes, ...removedNodes][0]?.nodeName ?? target.getAttribute("class"));
    }).observe(document.querySelector("hfsm-canvas .surface > svg"), {
        subtree: true, childList: true, attributes: true, attributeFilter: ["transform", "d", "x", "y", "cx", "cy"],
    });
}"""


@pytest.fixture
def path(behaviors: Path) -> Path:
    return behaviors / "dance_and_follow.xml"


def test_states_and_transitions_are_drawn_moved_and_bent(shown: EditorPage, root: Path) -> None:
    # Dragging from the rim connects, and from the middle moves.
    before = shown.middle_of("dance")
    shown.connect("dance", "followBall")
    shown.name("back")
    expect(shown.transition("back")).to_have_count(1)
    assert "back from dance to followBall" in shown.arcs()
    assert shown.middle_of("dance") == before

    shown.drag(before, (before[0] + 40, before[1] + 90))
    expect(shown.page.locator(".last-step")).to_have_text("Move “dance”")
    shown.expect_at("dance", (before[0] + 40, before[1] + 90))
    shown.press("Control+z")
    expect(shown.page.locator(".last-step")).to_have_text("Rename “transition 3”")
    shown.expect_at("dance", before, within=0.1)

    # A state is drawn where it is clicked, and named at once.
    x, y = shown.middle_of("followBall")
    shown.button("State").click()
    shown.page.mouse.click(x, y + 180)
    shown.name("rest")
    shown.expect_states("followBall", "dance", "rest")
    shown.expect_at("rest", (x, y + 180))
    document = saved(shown, root / "dance_and_follow.xml")
    assert document.root is not None
    assert [state.name for state in document.root.states] == ["followBall", "dance", "rest"]
    x, y = shown.middle_of("dance")
    shown.page.mouse.dblclick(x, y + 200)
    shown.name("here")
    shown.expect_states("followBall", "dance", "rest", "here")

    # A transition to itself and others between the same states have separate arcs.
    shown.connect("followBall", "dance")
    shown.name("third")
    shown.state("dance").click(button="right")
    shown.page.get_by_role("menuitem", name="Transition to itself").click()
    shown.name("again")
    expect(shown.transition("again")).to_have_count(1)
    expect(shown.page.locator(".transition[data-key]")).to_have_count(5)
    handles = [shown.middle(each) for each in shown.page.locator(".transition .knob").all()]
    for index, one in enumerate(handles):
        for other in handles[index + 1 :]:
            assert abs(one[0] - other[0]) + abs(one[1] - other[1]) > 25

    # A handle bends its arc, and a key resets it.
    knob = shown.transition("enough").locator(".knob")
    x, y = shown.middle(knob)
    shown.drag((x, y), (x + 20, y - 80))
    expect(shown.page.locator(".last-step")).to_have_text("Move “enough”")
    shown.expect_at(knob, (x + 20, y - 80))
    x, y = shown.middle(knob)
    shown.press("r")
    expect(shown.page.locator(".last-step")).to_have_text("Reset the handle of “enough”")
    assert abs(shown.middle(knob)[1] - y) > LEAST_MOVE


@pytest.mark.parametrize("selected", cases(["followBall"], ["", "dance"]))
def test_a_transition_is_drawn_with_its_tool_from_where_the_pointer_is_pressed(
    shown: EditorPage, selected: str
) -> None:
    shown.press("Escape")
    if selected:
        shown.page.mouse.click(*shown.middle_of(selected))
    shown.button("Transition").click()
    shown.drag(shown.middle_of("dance"), shown.middle_of("followBall"))
    shown.name("drawn")
    expect(shown.transition("drawn")).to_have_count(1)
    assert "drawn from dance to followBall" in shown.arcs()

    # Clicks choose its ends one after the other, also twice the same.
    shown.page.mouse.click(*shown.middle_of(selected or "dance"))
    shown.button("Transition").click()
    shown.page.mouse.click(*shown.middle_of("dance"))
    shown.name("clicked")
    expect(shown.transition("clicked")).to_have_count(1)
    assert f"clicked from {selected or 'dance'} to dance" in shown.arcs()


def test_an_empty_canvas_offers_what_to_do_first(shown: EditorPage) -> None:
    shown.page.locator("hfsm-canvas .surface").focus()
    shown.press("Control+a", "Delete")
    empty = shown.page.locator("hfsm-canvas .empty")
    assert shown.violations("hfsm-canvas .empty") == []
    empty.get_by_role("button", name="Take one from the shelf").click()
    expect(shown.page.get_by_role("combobox", name="Search the shelf")).to_be_focused()
    place = shown.middle(empty)
    empty.get_by_role("button", name="Draw a state").click()
    expect(empty).to_be_hidden()
    shown.page.mouse.click(*place)
    shown.name("first")
    shown.expect_states("first")
    shown.press("Delete")
    empty.get_by_role("button", name="Open an example").click()
    shown.state("front").wait_for()


def test_what_is_selected_is_deleted_grouped_aligned_and_renamed(shown: EditorPage) -> None:
    shown.state("dance").click()
    shown.press("Delete")
    shown.expect_states("followBall")
    assert shown.arcs() == []
    shown.press("Control+z")
    shown.expect_states("followBall", "dance")
    assert len(shown.arcs()) == 2
    shown.press("Control+y")
    shown.expect_states("followBall")
    shown.press("Control+z")
    shown.expect_states("followBall", "dance")

    # What is typed at once after grouping is the name.
    shown.state("dance").locator(".body").click()
    shown.press("Control+g")
    shown.type("move")
    shown.press("Enter")
    expect(shown.state("move")).to_be_focused()
    shown.expect_states("followBall", "move")
    assert sorted(shown.arcs()) == ["enough from followBall to move", "tired from move to followBall"]
    shown.press("Control+Enter")
    expect(shown.state("dance")).to_be_visible()
    shown.press("Backspace", "Control+z", "Control+z")
    expect(shown.state("dance")).to_be_visible()
    shown.expect_states("followBall", "dance")

    # The box and Shift select several.
    (x, y), (far_x, far_y) = shown.middle_of("followBall"), shown.middle_of("dance")
    shown.drag((x - 80, y - 130), (far_x + 80, far_y + 130))
    expect(shown.page.locator(".state.selected")).to_have_count(2)
    shown.page.mouse.click(x - 80, y + 250)
    expect(shown.page.locator(".selected")).to_have_count(0)
    shown.drag((x, y), (x, y + 60))
    shown.state("dance").click(modifiers=["Shift"])
    expect(shown.page.locator(".state.selected")).to_have_count(2)
    shown.choose_in("Actions", "Align top")
    expect(shown.page.locator(".last-step")).to_have_text("Align 2 states: top")
    assert shown.middle_of("followBall")[1] == pytest.approx(shown.middle_of("dance")[1], abs=0.1)

    # A double click on a name renames, and Escape leaves it.
    label = shown.page.locator(".label .title", has_text="enough")
    label.dblclick()
    shown.page.locator(".rename").fill("other")
    shown.press("Escape")
    expect(shown.transition("enough")).to_have_count(1)
    label.dblclick()
    shown.name("had enough")
    expect(shown.transition("had enough")).to_have_count(1)

    # An automaton that is undone is left.
    shown.button("State").click()
    expect(shown.page.locator("hfsm-canvas .hint")).to_contain_text("New state")
    shown.press("Enter")
    shown.name("deep")
    shown.press("Control+Enter")
    expect(shown.page.locator("hfsm-breadcrumbs [aria-current]")).to_have_text("deep")
    shown.press("Control+z")
    shown.expect_states("followBall", "dance", "deep")


def test_the_view_zooms_pans_and_goes_down_and_up(shown: EditorPage) -> None:
    zoom = shown.page.locator(".zoom")
    expect(zoom).to_have_text("125 %")
    x, y = shown.middle_of("dance")
    radius = shown.radius_of("dance")
    # What is drawn stays as it is: a new layout of every text would make large automata slow.
    shown.page.evaluate(COUNT_CHANGES)
    shown.page.mouse.move(x, y)
    shown.page.mouse.wheel(0, -300)
    expect(zoom).not_to_have_text("125 %")
    assert shown.page.evaluate("window.changes.filter((each) => each !== 'title')") == []
    assert shown.radius_of("dance") > radius * 1.2
    shown.expect_at("dance", (x, y), within=1.0)
    shown.page.locator("hfsm-canvas > .surface").click(position={"x": 20, "y": 100})
    shown.page.keyboard.down("Space")
    shown.drag((x, y), (x + 150, y - 30))
    shown.page.keyboard.up("Space")
    shown.expect_at("dance", (x + 150, y - 30), within=1.0)

    # Going up and down loses nothing.
    shown.state("followBall").dblclick()
    shown.expect_states("red", "green")
    shown.state("red").click()
    shown.press("F2")
    shown.page.locator(".rename").fill("scarlet")
    shown.button("Up").click()  # while the name is still being typed
    shown.expect_states("followBall", "dance")
    expect(shown.page.locator("hfsm-canvas :focus")).to_have_count(
        1
    )  # its button cannot be pressed at the top
    shown.state("followBall").dblclick()
    shown.expect_states("scarlet", "green")
    shown.press("Control+z")
    shown.expect_states("red", "green")
    shown.page.locator("hfsm-breadcrumbs").get_by_role("button", name="dance_and_follow").click()
    shown.expect_states("followBall", "dance")

    # A drawing that is seen whole is so beside a panel too, at the same scale where there is room for it.
    shown.resize(1000, 800)
    shown.button("Fit").click()
    expect(zoom).to_have_text("125 %")
    shown.state("dance").click()
    shown.press("Shift+Enter")
    expect(shown.page.get_by_role("textbox", name="Code of the state dance")).to_be_focused()
    edge = shown.page.locator("hfsm-canvas").bounding_box()
    assert edge is not None
    expect(zoom).to_have_text("125 %")
    for name in ("followBall", "dance"):
        assert edge["x"] < shown.middle_of(name)[0] - shown.radius_of(name)
        assert shown.middle_of(name)[0] + shown.radius_of(name) < edge["x"] + edge["width"]
    shown.button("Close the panel").click()
    expect(zoom).to_have_text("125 %")

    # A double click on a state without sub-automaton opens its code.
    for name in ("followBall", "red", "follow"):
        shown.state(name).dblclick()
    expect(shown.page.get_by_role("textbox", name="Code of the state follow")).to_be_focused()
    shown.expect_states("follow", "search")


def test_copies_carry_their_sub_tree_into_another_automaton_and_editor_and_broken_ones_are_refused(
    browser: Browser, shown: EditorPage, root: Path, tmp_path: Path
) -> None:
    shown.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    shown.state("followBall").click()
    shown.press("Control+c")
    comes_true(shown, "async () => (await navigator.clipboard.readText()) === 'followBall'")
    shown.press("F2")  # in a field it is the name
    name = shown.page.locator("hfsm-canvas input")
    name.fill("")
    shown.press("Control+v")
    expect(name).to_have_value("followBall")
    shown.press("Escape")
    shown.page.get_by_role("treeitem", name="dance", exact=True).dblclick()
    shown.expect_states("right", "left")
    shown.page.locator("hfsm-canvas > .surface").click(position={"x": 15, "y": 100})
    shown.press("Control+v")
    shown.expect_states("right", "left", "followBall")
    expect(shown.state("followBall")).to_be_focused()  # selected, which it is a little later than drawn
    shown.state("right").click()
    shown.press("Control+d")
    expect(shown.page.locator(".last-step")).to_have_text("Duplicate")
    assert "followBall" in shown.page.evaluate(
        "navigator.clipboard.readText()"
    )  # it is still what was copied
    shown.press("Control+z")
    shown.expect_states("right", "left", "followBall")
    shown.state("followBall").click()
    shown.press("Control+Enter")
    shown.expect_states("red", "green")
    shown.state("green").click()
    shown.press("Control+Enter")
    shown.expect_states("follow", "search")
    assert shown.page.locator("hfsm-breadcrumbs li").all_inner_texts() == [
        "dance_and_follow",
        "dance",
        "followBall",
        "green",
    ]

    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "follow_ball.xml").write_bytes((root / "follow_ball.xml").read_bytes())
    with editor(elsewhere, elsewhere / "follow_ball.xml") as second, editor_page(browser, second) as other:
        other.state("search").wait_for()
        other.press("Control+v")
        other.expect_states("follow", "search", "followBall")
        other.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
        other.page.evaluate("navigator.clipboard.writeText('<VisualHFSM><SubAutomata')")
        other.press("Control+v")
        expect(other.page.get_by_role("alert").filter(has_text="Cannot paste")).to_contain_text("line 1")
        other.expect_states("follow", "search", "followBall")

        # What is no state becomes a note.
        other.page.evaluate("navigator.clipboard.writeText('buy milk\\r\\nand <VisualHFSM>')")
        other.press("Control+v")
        note = "Note: buy milk\nand <VisualHFSM>"
        expect(other.page.locator(".annotation")).to_have_attribute("aria-label", note)
        expect(other.page.locator(".last-step")).to_have_text("Add a note")


@pytest.mark.parametrize("merge_within", [FOREVER])
def test_all_is_done_with_the_keyboard_alone(own: EditorPage, root: Path) -> None:
    # Arrows move what is selected as one step.
    own.state("dance").focus()
    before = own.middle_of("dance")
    for _ in range(3):
        own.press("ArrowDown")
    expect(own.page.locator(".last-step")).to_have_text("Move “dance”")
    expect(own.state("dance")).to_have_attribute("transform", "translate(420,190)")
    own.press("Control+z")
    expect(own.state("dance")).to_have_attribute("transform", "translate(420,160)")
    expect(own.button("Undo")).to_be_disabled()
    own.expect_at("dance", before, within=0.1)

    # The tree is walked with arrows, also before it is drawn again, and opens with Enter.
    root_item, red_item = (
        own.page.get_by_role("treeitem", name=name) for name in ("dance_and_follow", "red")
    )
    root_item.focus()
    own.press("ArrowDown", "ArrowDown")
    expect(red_item).to_be_focused()
    root_item.focus()
    own.page.evaluate(
        """() => { for (const key of ["ArrowDown", "ArrowDown"]) document.activeElement.dispatchEvent(
            new KeyboardEvent("keydown", {key, bubbles: true, cancelable: true})); }"""
    )
    expect(red_item).to_be_focused()
    own.expect_states("red", "green")
    own.press("Enter")
    own.expect_states("follow", "search")
    own.press("ArrowLeft", "ArrowLeft")
    expect(own.page.get_by_role("treeitem", name="follow", exact=False).first).to_be_visible()

    # A new document is drawn.
    own.press("Alt+n")
    expect(own.page.locator("hfsm-canvas .empty")).to_be_visible()
    for name in ("wait", "go"):
        own.press("s")
        expect(own.page.locator("hfsm-canvas .hint")).to_contain_text("New state")
        own.press("ArrowRight", "ArrowRight", "Enter")
        own.name(name)
        expect(own.state(name)).to_be_focused()
    own.press("t")
    expect(own.page.locator("hfsm-canvas .hint")).to_contain_text("New transition")
    go, wait = own.middle_of("go"), own.middle_of("wait")
    to_wait = (wait[0] - go[0], wait[1] - go[1])
    horizontal = abs(to_wait[0]) > abs(to_wait[1])
    own.press(
        ("ArrowRight" if to_wait[0] > 0 else "ArrowLeft")
        if horizontal
        else ("ArrowDown" if to_wait[1] > 0 else "ArrowUp")
    )
    expect(own.page.locator(".state.target")).to_have_attribute("aria-label", "State wait, initial")
    own.press("Enter")
    own.name("again")
    expect(own.transition("again")).to_be_focused()
    assert own.arcs() == ["again from go to wait"]

    own.press(",")  # the state that it leaves
    expect(own.state("go")).to_be_focused()
    own.press("i")
    expect(own.state("go, initial")).to_have_count(1)
    own.press("Control+Enter")  # into its new sub-automaton
    expect(own.page.locator("hfsm-breadcrumbs [aria-current]")).to_have_text("go")
    own.press("Backspace")
    expect(own.state("go")).to_be_focused()
    own.press("Control+Shift+S")
    own.page.get_by_role("textbox", name="Name").fill("drawn")
    own.press("Enter")
    own.page.get_by_role("status").filter(has_text="Saved drawn.xml").wait_for()
    document = read_document(root / "drawn.xml", Diagnostics())
    assert document is not None
    assert document.root is not None
    assert [(state.name, state.initial, bool(state.children)) for state in document.root.states] == [
        ("wait", False, False),
        ("go", True, True),
    ]


def test_a_state_that_is_drawn_on_another_one_is_put_beside_it(shown: EditorPage) -> None:
    shown.press("s")
    shown.page.mouse.click(*shown.middle_of("dance"))
    shown.name("another")
    shown.expect_states("followBall", "dance", "another")
    apart = [abs(a - b) for a, b in zip(shown.middle_of("another"), shown.middle_of("dance"), strict=True)]
    assert sum(each**2 for each in apart) ** 0.5 > 2 * shown.radius_of("dance")
