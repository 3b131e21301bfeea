"""Notes and frames on the editor's canvas, with mouse and keys, and the page of viewers."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, expect

from tests.support.browser import Box, EditorPage, new_context, saved, shared_address

NOTHING_COVERED = """() => {
    const boxes = (words) => [...document.querySelectorAll(words)].map((each) => each.getBoundingClientRect());
    const taken = boxes("hfsm-canvas .note .paper, hfsm-canvas .frame text");
    return boxes("hfsm-canvas .label text:last-child").every((name) => taken.every((other) =>
      name.right < other.left || other.right < name.left || name.bottom < other.top || other.bottom < name.top));
}"""


@pytest.fixture
def path(behaviors: Path) -> Path:
    return behaviors / "dance_and_follow.xml"


def write(shown: EditorPage, text: str) -> Locator:
    """Draw a note with keys and write its text, as fast as this, before its field is there; return the field."""
    shown.press("n", "Enter")
    shown.type(text)
    field = shown.page.get_by_role("textbox", name="Text of the note")
    expect(field).to_have_value(text)
    return field


def frame(shown: EditorPage, state: str, title: str) -> Locator:
    """Put a frame around a state."""
    shown.page.mouse.click(*shown.middle_of(state))
    shown.press("Control+Shift+g")
    shown.type(title)
    expect(shown.page.get_by_role("textbox", name="Title of the frame")).to_have_value(title)
    shown.press("Enter")
    return shown.page.get_by_role("button", name=f"Frame {title}")


def test_a_note_is_written_with_keys_alone_and_found_again(shown: EditorPage, path: Path) -> None:
    page = shown.page
    write(shown, "Why it waits\nfor a while")
    shown.press("Escape")
    note = page.get_by_role("button", name="Note: Why it waits for a while")
    expect(note).to_have_attribute("aria-pressed", "true")
    expect(note).to_be_focused()
    shown.press("Shift+ArrowRight")
    expect(page.locator(".last-step")).to_contain_text("Resize the note")
    document = saved(shown, path)
    assert document.root is not None
    (written,) = document.root.annotations
    assert (written.text.text, written.width) == ("Why it waits\nfor a while", 220.0)
    shown.press("Delete")
    expect(note).to_have_count(0)
    shown.press("Control+z")
    expect(note).to_have_count(1)


def test_what_is_placed_with_keys_covers_nothing(shown: EditorPage) -> None:
    page = shown.page
    for _ in range(2):
        shown.press("n", "Enter")
        expect(page.get_by_role("textbox", name="Text of the note")).to_be_focused()
        shown.insert("why")
        shown.press("Escape")
    states = page.locator("hfsm-canvas .state")
    count = states.count()
    shown.press("s", "Enter")
    expect(states).to_have_count(count + 1)
    covered = page.evaluate(
        """() => {
            const boxes = (words) => [...document.querySelectorAll(words)].map((each) => each.getBoundingClientRect());
            const notes = boxes("hfsm-canvas .note .paper");
            const others = boxes("hfsm-canvas .state .body, hfsm-canvas .label text:last-child");
            const meet = (one, other) => one.left < other.right && other.left < one.right
                && one.top < other.bottom && other.top < one.bottom;
            return notes.filter((note, index) => [...others, ...notes.slice(0, index)].some((each) => meet(note, each)))
                .length;
        }"""
    )
    assert covered == 0


def test_undo_in_a_note_ends_where_its_text_began(shown: EditorPage) -> None:
    field = write(shown, "why")
    shown.press(*["Control+z"] * 5)
    expect(field).to_have_value("")
    expect(field).to_be_focused()


def test_a_note_grows_while_it_is_written_and_keeps_its_own_height_in_the_document(
    shown: EditorPage, path: Path
) -> None:
    page = shown.page
    shown.press("n", "Enter")
    field = page.get_by_role("textbox", name="Text of the note")
    expect(field).to_be_focused()
    shown.insert("why")
    low = Box.of(field).height
    shown.insert("\none\nmore\nline\nand\nanother\nfor\nthe\nrobot")
    assert Box.of(field).height > low + 40
    assert field.evaluate("field => field.scrollHeight <= field.clientHeight")
    shown.press("Escape")
    note = page.get_by_role("button", name="Note: why")
    expect(note.locator("tspan")).to_have_text(
        ["why", "one", "more", "line", "and", "another", "for", "the", "robot"]
    )
    paper = Box.of(note.locator(".paper"))
    last = Box.of(note.locator("tspan").last)
    assert last.y + last.height < paper.y + paper.height
    shown.press("Shift+ArrowRight")
    expect(page.locator(".last-step")).to_have_text("Resize the note “why one more line and another…”")
    document = saved(shown, path)
    assert document.root is not None
    (written,) = document.root.annotations
    assert (written.width, written.height) == (220.0, 96.0)


def test_a_note_has_text_to_edit_in_the_panel_and_no_code(shown: EditorPage) -> None:
    write(shown, "why")
    shown.press("Escape")
    expect(shown.page.get_by_role("button", name="Note: why")).to_be_focused()
    shown.press("Shift+Enter")
    panel = shown.page.get_by_role("region", name="Panel beside the canvas")
    expect(panel.get_by_role("textbox", name="Text of the note")).to_be_focused()
    shown.button("Close the panel").click()
    shown.choose_in("Edit", "Edit text")
    expect(panel.get_by_role("textbox", name="Text of the note")).to_be_focused()
    shown.page.mouse.click(*shown.middle_of("followBall"))
    shown.choose_in("Edit", "Edit code")
    expect(panel.get_by_role("tablist", name="Code of the state")).to_be_visible()


def test_the_lines_of_a_note_are_read_as_they_are_written(shown: EditorPage) -> None:
    write(shown, "It dances when it has followed the ball")
    shown.press("Escape")
    expect(shown.page.locator(".note tspan")).not_to_have_count(1)
    assert shown.violations("hfsm-canvas") == []


def test_no_name_of_a_transition_is_on_a_note_or_a_title(shown: EditorPage) -> None:
    page = shown.page
    label = page.locator(".label text:last-child").first
    x, y = shown.middle(label)
    shown.press("n")
    expect(page.locator("hfsm-canvas .hint")).to_contain_text("New note")
    page.mouse.click(x, y)
    expect(page.get_by_role("textbox", name="Text of the note")).to_be_focused()
    shown.insert("in the way")
    shown.press("Escape")
    note = page.get_by_role("button", name="Note: in the way")
    expect(note).to_be_focused()
    page.wait_for_function(NOTHING_COVERED)
    shown.press("Delete")
    expect(note).to_have_count(0)
    page.mouse.click(x, y + 200)  # on the ground: nothing is selected then
    shown.press("Control+Shift+g")
    expect(page.locator("hfsm-canvas .hint")).to_contain_text("New frame")
    page.mouse.click(x + 110, y + 110)
    expect(page.get_by_role("textbox", name="Title of the frame")).to_be_focused()
    shown.insert("in the way of every name")
    shown.press("Enter")
    expect(page.get_by_role("button", name="Frame in the way")).to_be_focused()
    page.wait_for_function(NOTHING_COVERED)


def test_a_title_stays_legible_from_far_away_and_covers_no_state(shown: EditorPage) -> None:
    page = shown.page
    shown.press("Control+a", "Control+Shift+g")
    page.keyboard.type("dance and follow")
    shown.press("Enter")
    title = page.get_by_role("button", name="Frame dance and follow").locator("text")
    expect(title).to_have_text("dance and follow")
    height = Box.of(title).height
    for _ in range(4):
        shown.press("-")
    expect(page.locator("hfsm-status .zoom")).not_to_have_text("100 %")
    seen = Box.of(title)
    assert seen.height > 0.6 * height
    for name in ("followBall", "dance"):
        assert not seen.overlaps(Box.of(shown.state(name).locator(".body"))), name


def test_a_frame_moves_its_states_and_nothing_else(shown: EditorPage) -> None:
    page = shown.page
    inside, outside = shown.middle_of("followBall"), shown.middle_of("dance")
    drawn = frame(shown, "followBall", "begin")
    expect(drawn).to_have_attribute("aria-pressed", "true")
    box = drawn.locator(".bar").bounding_box()
    assert box is not None
    start = box["x"] + 30, box["y"] + 12
    shown.drag(start, (start[0] + 40, start[1] + 60))
    expect(page.locator(".last-step")).to_have_text("Move the frame “begin”")
    shown.expect_at("followBall", (inside[0] + 40, inside[1] + 60))
    shown.expect_at("dance", outside)
    shown.press("Delete")
    expect(drawn).to_have_count(0)
    shown.expect_states("followBall", "dance")


def test_a_frame_stays_around_its_states_when_they_are_arranged(shown: EditorPage, path: Path) -> None:
    page = shown.page
    expect(frame(shown, "followBall", "begin")).to_be_focused()
    write(shown, "why")
    shown.press("Escape")
    expect(page.get_by_role("button", name="Note: why")).to_be_focused()
    shown.press("Control+k")
    page.keyboard.type("Arrange")
    shown.press("Enter")
    expect(page.locator(".last-step")).to_have_text("Arrange")
    document = saved(shown, path)
    assert document.root is not None
    framed, note = document.root.annotations
    inside = {
        state.name
        for state in document.root.states
        if 0 < state.x - framed.x < framed.width and 0 < state.y - framed.y < framed.height
    }
    assert inside == {"followBall"}
    for state in document.root.states:
        dx, dy = state.x - note.x, state.y - note.y
        assert not (-50 < dx < note.width + 50 and -50 < dy < note.height + 50), state.name


def test_who_looks_on_sees_changes_and_makes_none(shown: EditorPage, browser: Browser) -> None:
    address = shared_address(shown)
    with new_context(browser) as context:
        viewer = context.new_page()
        viewer.goto(address)
        expect(viewer.get_by_text("You look on")).to_be_visible()
        expect(viewer.locator("hfsm-canvas [data-key=s1]")).to_be_visible()
        expect(viewer.get_by_role("button", name="STOP the robot")).to_be_enabled()
        viewer.locator("hfsm-canvas [data-key=s1]").click()
        viewer.keyboard.press("Delete")
        viewer.keyboard.press("n")
        write(shown, "live")
        shown.press("Escape")
        expect(viewer.get_by_role("button", name="Note: live")).to_be_visible()
        expect(viewer.locator("hfsm-canvas .state")).to_have_count(2)
        expect(viewer.locator("hfsm-canvas .annotation")).to_have_count(1)


def test_the_exported_page_shows_all_automata_without_a_server(shown: EditorPage, browser: Browser, tmp_path: Path) -> None:  # fmt: skip
    shown.press("Control+e")
    with shown.page.expect_download() as download:
        shown.page.get_by_role("button", name="The drawing as a page").click()
    file = tmp_path / "drawing.html"
    download.value.save_as(file)
    with browser.new_context(offline=True) as context:
        page = context.new_page()
        failures: list[str] = []
        page.on("pageerror", lambda error: failures.append(str(error)))
        page.goto(file.as_uri())
        page.locator("hfsm-canvas [data-key=s2]").dblclick()
        page.locator("hfsm-canvas [data-key=s1]").click()
        expect(page.locator("hfsm-selected-code")).to_contain_text("arm_there")
        page.get_by_role("button", name="To the automaton above").click()
        expect(page.locator("hfsm-canvas .state")).to_have_count(2)
        assert failures == []
