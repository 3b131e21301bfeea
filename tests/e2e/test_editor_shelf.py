"""The shelf in the editor: ready states are found, drawn, set, connected, and shown with what is wrong with them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from playwright.sync_api import Locator, expect

from codegen.hfsm.document import Document
from tests.support.browser import EditorPage, saved
from tests.support.processes import REPOSITORY
from tests.support.soak import cases

OWN = """<VisualHFSM>
  <description>Count to a number. It counts aloud, in the log.</description>
  <SubAutomata id="1" idFather="0">
    <state id="1" initial="true"><name>count</name><code>n += 1</code></state>
    <state id="2"><name>counted</name><final>true</final></state>
    <transition id="1"><origin>1</origin><destiny>2</destiny><name>far enough</name>
      <trans type="condition">n &gt;= last</trans></transition>
    <input><name>last</name><type>int</type><default>3</default></input>
    <variables>n = 0</variables>
  </SubAutomata>
</VisualHFSM>
"""
TOUCH = """([from, to]) => {
    const option = document.elementFromPoint(...from).closest("[role=option]");
    const send = (kind, [clientX, clientY]) => option.dispatchEvent(new PointerEvent(kind,
        {pointerId: 1, pointerType: "touch", isPrimary: true, button: 0, bubbles: true, clientX, clientY}));
    option.setPointerCapture = () => {};
    send("pointerdown", from);
    send("pointermove", [from[0] + 40, from[1]]);
    send("pointermove", to);
    send("pointerup", to);
}"""


SERVED = """async ([names, postures]) => {
    const base = document.querySelector('script[src$="/app.js"]').src.replace("shell/app.js", "");
    const {store} = await import(`${base}data/store.js`);
    const status = names.length ? "present" : "none";
    store.robot = {...store.robot, status, title: "Cart", postures, serves: names};
    store.dispatchEvent(new CustomEvent("robot", {detail: {}}));
}"""
"""Let the page see a robot that serves some things."""


def search(shown: EditorPage) -> Locator:
    """The field that searches the shelf."""
    return shown.page.get_by_role("combobox", name="Search the shelf")


def ready(shown: EditorPage, name: str) -> Locator:
    """A ready state on the shelf."""
    return shown.page.get_by_role("option", name=name, exact=True)


def argument(shown: EditorPage, name: str) -> Locator:
    """The field of an argument of the selected state."""
    return shown.page.get_by_role("textbox", name=f"Argument {name}")


def arguments(document: Document, state: str) -> dict[str, str]:
    """Return the arguments of a state of the root."""
    assert document.root is not None
    (found,) = (each for each in document.root.states if each.name == state)
    return {each.name: each.value.text for each in found.arguments}


def test_a_ready_state_is_found_drawn_set_and_followed_by_keys(shown: EditorPage, path: Path) -> None:
    shown.press("a")
    expect(search(shown)).to_be_focused()
    shown.type("talk")
    expect(ready(shown, "Say")).to_have_attribute("aria-selected", "true")
    expect(shown.page.locator(".shelf-about")).to_contain_text("It ends when the text has been said")
    shown.press("Enter")
    expect(argument(shown, "text")).to_be_focused()
    shown.insert("Good morning")  # replaces what is between the quotes
    shown.expect_states("wait", "go", "say")

    # What comes after it waits for its end.
    shown.state("say").click()
    shown.press("a")
    shown.type("wave")
    shown.press("Shift+Enter")
    expect(shown.transition("transition 1")).to_contain_class("by-finished")
    document = saved(shown, path)
    assert arguments(document, "say") == {"text": '"Good morning"'}
    assert {each.name for each in document.interfaces} >= {"Speech", "Motions"}

    # Each was one step.
    for _ in range(2):
        shown.press("Escape", "Control+z")
    expect(shown.state("wave")).to_have_count(0)


def test_a_ready_state_is_carried_to_its_place_and_onto_a_state(shown: EditorPage, path: Path) -> None:
    x, y = shown.middle_of("go")
    shown.drag(shown.middle(ready(shown, "Look at")), (x, y + 190))
    shown.expect_states("wait", "go", "look at")
    expect(argument(shown, "left")).to_be_focused()

    shown.drag(shown.middle(ready(shown, "Stand")), shown.middle_of("look at"))
    shown.expect_states("wait", "go", "look at", "stand")
    assert "transition 1 from look at to stand" in shown.arcs()

    # Escape, and a place that is no canvas, draw nothing.
    mouse = shown.page.mouse
    mouse.move(*shown.middle(ready(shown, "Sit")))
    mouse.down()
    mouse.move(x, y, steps=3)
    shown.press("Escape")
    mouse.up()
    shown.drag(shown.middle(ready(shown, "Kick")), shown.middle(shown.page.locator("hfsm-status")))
    ready(shown, "Say").click()
    shown.expect_states("wait", "go", "look at", "stand", "say")
    root = saved(shown, path).root
    assert root is not None
    _, go, drawn, after, _ = root.states
    assert abs(drawn.x - go.x) < 2.0
    assert drawn.y - go.y > 100.0
    assert after.x > drawn.x + 100.0


def test_a_finger_carries_a_ready_state(shown: EditorPage) -> None:
    x, y = shown.middle_of("go")
    start = shown.middle(ready(shown, "Look at"))
    shown.page.evaluate(TOUCH, [start, (x, y + 150)])
    shown.expect_states("wait", "go", "look at")


def test_a_transition_from_a_state_that_ends_waits_for_that_once(shown: EditorPage) -> None:
    shown.drag(shown.middle(ready(shown, "Turn")), (shown.middle_of("go")[0], shown.middle_of("go")[1] + 190))
    shown.connect("turn", "go")
    shown.name("there")
    expect(shown.transition("there")).to_contain_class("by-finished")
    shown.connect("turn", "wait")
    shown.name("meanwhile")
    expect(shown.transition("meanwhile")).to_contain_class("by-condition")


def test_the_shelf_of_the_project_follows_its_folder(own: EditorPage, root: Path, tmp_path: Path) -> None:
    shelf = root / "shelf"
    (shelf / "Numbers").mkdir(parents=True)
    (shelf / "Numbers" / "count_up.xml").write_text(OWN, "utf-8")
    (shelf / "broken.xml").write_text("<VisualHFSM><state", "utf-8")
    (shelf / "large.xml").write_bytes(b" " * (1 << 20) + OWN.encode())
    (tmp_path / "secret.xml").write_text(OWN, "utf-8")
    (shelf / "link.xml").symlink_to(tmp_path / "secret.xml")
    os.mkfifo(shelf / "pipe.xml")

    expect(own.page.get_by_role("group", name="Numbers")).to_contain_text("count up")
    for name, reason in (
        ("broken", "line 1"),
        ("large", "1 MiB"),
        ("link", "leads out"),
        ("pipe", "cannot be read"),
    ):
        found = own.page.get_by_role("option", name=f"{name}, cannot be used")
        expect(found).to_have_attribute("aria-disabled", "true")
        found.scroll_into_view_if_needed()
        own.hover(found, shows=own.page.locator(".shelf-about .trouble", has_text=reason))
        found.click(force=True)  # it is disabled, and draws nothing
    ready(own, "count up").click()
    own.expect_states("wait", "go", "count up")
    expect(argument(own, "last")).to_be_focused()
    assert not own.mishaps

    (shelf / "Numbers" / "count_up.xml").unlink()
    expect(ready(own, "count up")).to_have_count(0)


def test_what_the_robot_lacks_is_said(own: EditorPage) -> None:
    own.page.evaluate(SERVED, [["Safety", "Head", "Walk", "Leds", "Postures"], ["Rest", "Stand"]])
    lacks = own.page.get_by_role("option", name="Look for a ball, this robot has no eyes")
    expect(lacks).to_contain_class("lacking")
    trouble = own.page.locator(".shelf-about .trouble")
    own.hover(lacks, shows=trouble)
    expect(trouble).to_have_text("This robot has no eyes.")
    expect(ready(own, "Walk to")).not_to_contain_class("lacking")
    expect(ready(own, "Stand")).not_to_contain_class("lacking")
    sit = own.page.get_by_role("option", name="Sit, this robot has no posture Sit")
    expect(sit).to_contain_class("lacking")
    lacks.click()  # it may be meant for another robot
    expect(own.state("look for a ball")).to_have_count(1)
    own.page.evaluate(SERVED, [[], []])
    expect(ready(own, "Look for a ball")).to_have_count(1)


def test_the_palette_draws_ready_states(shown: EditorPage) -> None:
    shown.press("Control+k")
    field = shown.page.get_by_role("combobox", name="What to do")
    field.fill("kick")
    expect(shown.page.get_by_role("option", name="Draw Kick")).to_have_attribute("aria-selected", "true")
    field.press("Enter")
    shown.expect_states("wait", "go", "kick")


def test_the_shelf_is_closed_and_stays_so(own: EditorPage) -> None:
    head = own.page.get_by_role("button", name="Shelf")
    expect(head).to_have_attribute("aria-expanded", "true")
    head.click()
    expect(search(own)).to_have_count(0)
    own.page.reload()
    expect(head).to_have_attribute("aria-expanded", "false")
    own.press("a")  # opens it again
    expect(search(own)).to_be_focused()


@pytest.mark.parametrize("width", cases([683], [1440]))
def test_the_shelf_is_accessible(own: EditorPage, width: int) -> None:
    own.resize(width, 760)
    own.press("a")
    own.type("look")
    expect(own.page.locator(".shelf-about")).to_be_visible()
    assert own.violations() == []
    sizes = own.page.locator(".shelf :is(.ready, button, input)").evaluate_all(
        "all => all.map((each) => each.getBoundingClientRect().height)"
    )
    assert min(sizes) >= 24.0


def test_every_picture_of_our_shelf_is_one_of_the_page(shown: EditorPage) -> None:
    names = [path.stem for path in (REPOSITORY / "shelf").glob("*.xml")]
    expect(shown.page.locator(".ready")).to_have_count(len(names))
    empty = shown.page.locator(".ready path").evaluate_all(
        "all => all.filter((each) => each.getTotalLength() < 20).length"
    )
    assert empty == 0


def test_a_selection_is_put_on_the_shelf_from_the_menu(own: EditorPage, root: Path) -> None:
    page = own.page
    own.state("go").click(button="right")
    page.get_by_role("menu").get_by_text("Put on the shelf", exact=True).click()
    dialog = page.get_by_role("dialog", name="Put on the shelf")
    expect(dialog.get_by_label("Title")).to_have_value("Go")
    expect(dialog.get_by_label("Title")).to_be_focused()
    own.type("Go away")
    expect(dialog.get_by_label("Title")).to_have_value("Go away")
    dialog.get_by_label("What it does").fill("It goes away.")
    assert own.violations("dialog") == []
    own.press("Enter")
    expect(page.get_by_role("status").filter(has_text="Go away is on the shelf")).to_be_visible()
    expect(ready(own, "Go away")).to_be_visible()
    assert (root / "shelf" / "go_away.xml").is_file()

    own.state("wait").click()
    own.press("Control+k")
    page.keyboard.type("Put on the shelf")
    own.press("Enter")
    dialog.get_by_label("Title").fill("go AWAY")
    own.press("Enter")
    expect(dialog.get_by_role("alert")).to_contain_text("shelf/go_away.xml already exists")
    own.press("Escape")
    expect(dialog).to_have_count(0)
    expect(own.state("wait")).to_be_focused()
