"""Open, drop, save, close, compare and export documents in the editor's page."""

from __future__ import annotations

import json
import re
import shutil
import struct
from collections.abc import Callable
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import pytest
from playwright.sync_api import Locator, WebSocketRoute, expect

from tests.support.browser import EditorPage
from tests.support.limits import PAGE_LIMIT
from tests.support.panels import DOCUMENT as PANELS_DOCUMENT
from tests.support.plugins import OLD_DOCUMENTS
from tests.support.waiting import until

SPANISH = """<VisualHFSM><SubAutomata><idSub>1</idSub><Estado estado_inicial="true"><id>1</id><nombre>uno</nombre>
<posx>100</posx><posy>100</posy></Estado></SubAutomata></VisualHFSM>"""
SCXML = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="open">
<state id="open"><transition event="push" target="shut"/></state><final id="shut"/></scxml>"""
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def shown(start_page: EditorPage) -> EditorPage:
    return start_page


def drop(shown: EditorPage, name: str, text: str) -> None:
    """Drop a file on the page."""
    transfer = shown.page.evaluate_handle(
        """([name, text]) => {
            const transfer = new DataTransfer();
            transfer.items.add(new File([text], name, {type: "text/xml"}));
            return transfer;
        }""",
        [name, text],
    )
    shown.page.locator("hfsm-app").dispatch_event("drop", {"dataTransfer": transfer})


def tab(shown: EditorPage, name: str) -> Locator:
    return shown.page.get_by_role("tablist", name="Open documents").get_by_role("tab", name=name)


def add_state(shown: EditorPage, name: str) -> None:
    shown.press("s")
    expect(shown.page.locator("hfsm-canvas .hint")).to_contain_text("New state")
    shown.press("Enter")
    shown.name(name)
    expect(shown.state(name)).to_have_count(1)


def open_file(shown: EditorPage, name: str) -> None:
    shown.press("Control+o")
    shown.page.get_by_role("option", name=re.compile(rf"^{re.escape(name)}")).dblclick()


def held_answers(shown: EditorPage, op: str) -> list[Callable[[], None]]:
    """Load the page again and hold back the answers to a kind of request: each is sent when it is called."""
    asked: set[int] = set()
    late: list[Callable[[], None]] = []

    def hold(route: WebSocketRoute) -> None:
        server = route.connect_to_server()

        def ask(message: str | bytes) -> None:
            request = json.loads(message)
            if request["op"] == op:
                asked.add(request["id"])
            server.send(message)

        def answer(message: str | bytes) -> None:
            if json.loads(message).get("re") in asked:
                late.append(partial(route.send, message))
            else:
                route.send(message)

        route.on_message(ask)
        server.on_message(answer)

    shown.page.route_web_socket("**/ws", hold)
    shown.page.reload()
    shown.spent = True  # its connections pass through the test
    return late


def test_what_is_typed_on_the_start_page_after_alt_n_is_drawn(shown: EditorPage) -> None:
    shown.press("Alt+n", "s", "Enter")
    shown.name("first")
    shown.expect_states("first")
    expect(shown.state("first")).to_be_focused()
    expect(shown.state("first")).to_be_in_viewport(ratio=1)


@OLD_DOCUMENTS
def test_characters_that_turn_a_name_around_are_seen(shown: EditorPage, root: Path) -> None:
    name, mark = "a\u202egnp.xml", "‹U+202E›"
    (root / name).write_text(SPANISH.replace("uno", "\u2067uno"), "utf-8")
    shown.press("Control+o")
    option = shown.page.get_by_role("option", name=f"a{mark}gnp.xml")
    expect(option.locator("span").first).to_have_css("unicode-bidi", "isolate")
    option.dblclick()
    expect(tab(shown, f"a{mark}gnp")).to_have_attribute("aria-selected", "true")
    expect(shown.page.get_by_role("treeitem", name="‹U+2067›uno")).to_be_visible()
    expect(shown.page.locator("hfsm-canvas .state .name")).to_contain_text("‹U+20")  # cut
    assert not re.search("[\u202e\u2067]", shown.page.locator("body").inner_text())


def test_a_document_is_found_by_typing_a_part_of_its_name(shown: EditorPage, root: Path) -> None:
    page = shown.page
    (root / "Kür").mkdir()
    shutil.copy(root / "dance.xml", root / "Kür" / "waltz.xml")
    shown.press("Control+o")
    field = page.get_by_role("combobox", name="Part of the name")
    options = page.get_by_role("dialog").get_by_role("option")
    expect(field).to_be_focused()
    expect(options).to_have_count(5)
    expect(options.last).to_contain_text("Kür/waltz.xml")
    shown.type("FOLLOW")
    expect(options).to_have_count(2)
    expect(page.get_by_role("dialog").get_by_role("status")).to_have_text("2 found")
    shown.type(" ba")
    expect(options).to_have_count(1)
    expect(options).to_contain_text("follow_ball.xml")
    shown.type("x")
    expect(page.get_by_role("dialog").get_by_text("No matches for “FOLLOW bax”.")).to_be_visible()
    assert shown.violations("dialog") == []
    # A folder is opened like a document, and left with Backspace; a click leaves the focus in the field.
    field.fill("kur")
    expect(options).to_have_count(2)
    shown.press("Enter")
    expect(options.filter(has_text="waltz.xml")).to_have_attribute("aria-selected", "true")
    expect(field).to_have_value("")
    shown.press("Backspace")
    expect(options.filter(has_text="dance.xml")).to_be_visible()
    options.filter(has_text="dance.xml").click()
    expect(field).to_be_focused()
    field.fill("dance")
    expect(options).to_have_count(2)
    shown.press("ArrowDown", "ArrowUp", "ArrowUp")
    expect(options.nth(1)).to_have_attribute("aria-selected", "true")
    expect(field).to_have_attribute("aria-activedescendant", str(options.nth(1).get_attribute("id")))
    shown.press("ArrowUp", "Enter")
    shown.expect_states("up", "out", "front", "low")


def test_what_is_typed_before_the_documents_are_listed_counts(shown: EditorPage, root: Path) -> None:
    (root / "Kür").mkdir()
    shutil.copy(root / "dance.xml", root / "Kür" / "waltz.xml")
    shown.press("Control+o", *"kur", "Enter", *"wal", "Enter")
    expect(tab(shown, "waltz")).to_have_attribute("aria-selected", "true")

    late = held_answers(shown, "listFiles")
    shown.expect_states("up", "out", "front", "low")
    held = lambda: shown.page.evaluate("1") and late  # noqa: E731 - messages come while the page is talked to

    # The folder is opened while one types what to find in it.
    shown.press("Control+o", *"kur", "Enter", *"wal")
    until(held, PAGE_LIMIT)
    late.pop()()
    until(held, PAGE_LIMIT)
    shown.press("Enter")
    late.pop()()
    expect(tab(shown, "waltz")).to_have_attribute("aria-selected", "true")

    # Without a part of a name it is what is in the folder first, and not the way up.
    tab(shown, "waltz").locator("xpath=..").locator(".close-tab").click()
    shown.press("Control+o", *"kur", "Enter", "Enter")
    for _ in range(2):
        until(held, PAGE_LIMIT)
        late.pop()()
    expect(tab(shown, "waltz")).to_have_attribute("aria-selected", "true")


@OLD_DOCUMENTS
def test_documents_come_from_the_start_page_and_from_dropped_files(shown: EditorPage, root: Path) -> None:
    shown.page.get_by_role("button", name=re.compile("^Follow the ball")).click()
    shown.expect_states("follow", "search")
    shown.page.get_by_role("button", name="Start page").click()
    shown.page.get_by_role("button", name=re.compile("^Empty")).click()
    shown.expect_states()
    expect(shown.page.get_by_role("tablist", name="Open documents").get_by_role("tab")).to_have_count(2)

    # What is no document is refused.
    drop(shown, "picture.xml", "<svg><script>alert(1)</script></svg>")
    expect(shown.page.get_by_role("alert")).to_contain_text("picture.xml")
    drop(shown, "walk.mcap", "a recording")
    expect(shown.page.get_by_role("alert").last).to_contain_text(
        "walk.mcap is a recording: put it into the folder"
    )
    drop(shown, "dance.xml", (root / "dance.xml").read_text())
    shown.expect_states("up", "out", "front", "low")
    expect(tab(shown, "dance")).to_have_attribute("aria-selected", "true")

    # SCXML becomes a new document.
    drop(shown, "door.scxml", SCXML)
    shown.expect_states("open", "shut")
    expect(tab(shown, "door").get_by_role("img", name="not saved")).to_be_visible()
    expect(shown.page.get_by_role("status").filter(has_text="as a new document")).to_be_visible()

    # A folder that cannot be listed is reported.
    (root / "folder").mkdir()
    shown.press("Control+o")
    folder = shown.page.get_by_role("option", name="folder")
    expect(folder).to_be_visible()
    (root / "folder").rmdir()
    folder.dblclick()
    expect(shown.page.get_by_role("dialog").get_by_role("alert")).to_contain_text("folder is not a directory")
    expect(folder).to_have_count(0)
    expect(shown.page.get_by_role("option", name="dance.xml")).to_be_visible()


def test_each_tab_keeps_its_place_and_its_selection_also_while_the_server_is_away(shown: EditorPage) -> None:
    open_file(shown, "dance.xml")
    shown.expect_states("up", "out", "front", "low")
    open_file(shown, "dance_and_follow.xml")
    shown.expect_states("followBall", "dance")
    shown.state("followBall").dblclick()
    shown.expect_states("red", "green")
    shown.state("green").click()
    tab(shown, "dance").first.click()
    shown.expect_states("up", "out", "front", "low")
    expect(shown.page.locator(".selected")).to_have_count(0)
    shown.press("Alt+PageDown")
    shown.expect_states("red", "green")
    expect(shown.page.locator(".state.selected")).to_have_attribute("aria-label", re.compile("^State green"))

    tab(shown, "dance").first.click()
    shown.state("front").click()
    shown.connections.cut()
    banner = shown.page.get_by_role("alert").filter(has_text="No connection since")
    expect(banner).to_be_visible()
    shown.press("Delete")
    expect(shown.page.locator(".notice").filter(has_text="connects again by itself")).to_be_visible()
    expect(shown.state("front")).to_have_count(1)
    shown.connections.restore()
    expect(banner).to_have_count(0)
    expect(shown.page.locator(".state.selected")).to_have_attribute("aria-label", re.compile("^State front"))
    shown.press("Delete")
    shown.expect_states("up", "out", "low")

    tab(shown, "dance_and_follow").first.click()
    shown.state("green").wait_for()
    shown.page.reload()  # a window that is loaded again shows what it showed
    shown.expect_states("red", "green")
    expect(shown.page.locator(".state.selected")).to_have_attribute("aria-label", re.compile("^State green"))


@OLD_DOCUMENTS
def test_documents_are_saved_under_names_that_are_free(shown: EditorPage, root: Path) -> None:
    # The dialog keeps the name after an error, and makes folders.
    open_file(shown, "dance.xml")
    shown.expect_states("up", "out", "front", "low")
    shown.press("Control+Shift+s")
    dialog = shown.page.get_by_role("dialog").filter(has_text="Save the document as")
    name = dialog.get_by_label("Name")
    for wrong, why in (("../x", "is outside"), ("dance_and_follow.xml/x", "Cannot create the folder")):
        name.fill(wrong)
        name.press("Enter")
        expect(dialog.get_by_role("alert")).to_contain_text(why)
        expect(name).to_have_value(wrong)
    name.fill("mine/deep/dance")
    name.press("Enter")
    expect(dialog).to_have_count(0)
    assert (root / "mine" / "deep" / "dance.xml").is_file()

    # A sub-automaton is moved to a file once its name is free.
    (root / "main.xml").write_text(PANELS_DOCUMENT)
    open_file(shown, "main.xml")
    shown.state("wait").click()
    shown.choose_in("Actions", "Move to a file")
    dialog = shown.page.get_by_role("dialog")
    name = dialog.get_by_label("Name")
    name.fill("dance")
    name.press("Enter")
    expect(dialog.get_by_role("alert")).to_contain_text("exists")
    expect(name).to_have_value("dance")
    name.fill("look")
    name.press("Enter")
    expect(dialog).to_have_count(0)
    expect(
        shown.page.get_by_role("status").filter(has_text="Moved the sub-automaton to look.xml")
    ).to_be_visible()
    assert "<name>look</name>" in (root / "look.xml").read_text()

    # A document of an older format is replaced only after a question.
    path = root / "old.xml"
    path.write_text(SPANISH)
    open_file(shown, "old.xml")
    shown.expect_states("uno")
    add_state(shown, "dos")
    question = shown.page.get_by_role("dialog").filter(has_text="Spanish (2013)")
    shown.press("Control+s")
    question.get_by_role("button", name="Cancel").click()
    assert path.read_text() == SPANISH
    shown.press("Control+s")
    question.get_by_role("button", name="Overwrite").click()
    shown.page.get_by_role("status").filter(has_text="Saved old.xml").wait_for()
    assert "<name>uno</name>" in path.read_text()


def test_a_list_of_files_that_comes_late_takes_no_error_away(shown: EditorPage) -> None:
    open_file(shown, "dance.xml")
    shown.expect_states("up", "out", "front", "low")
    late = held_answers(shown, "listFiles")
    shown.expect_states("up", "out", "front", "low")
    shown.press("Control+Shift+s")
    dialog = shown.page.get_by_role("dialog").filter(has_text="Save the document as")
    dialog.get_by_label("Name").fill("../x")
    dialog.get_by_label("Name").press("Enter")
    expect(dialog.get_by_role("alert")).to_contain_text("is outside")
    late.pop()()
    expect(dialog.get_by_role("option").first).to_be_visible()
    expect(dialog.get_by_role("alert")).to_contain_text("is outside")


def test_unsaved_changes_show_a_dot_and_are_asked_about_before_closing(shown: EditorPage, root: Path) -> None:
    open_file(shown, "dance.xml")
    shown.expect_states("up", "out", "front", "low")
    expect(tab(shown, "dance").get_by_role("img", name="not saved")).to_have_count(0)
    add_state(shown, "bow")
    expect(tab(shown, "dance").get_by_role("img", name="not saved")).to_be_visible()
    tab(shown, "dance").locator("xpath=..").locator(".close-tab").click()
    shown.page.get_by_role("dialog").get_by_role("button", name="Cancel").click()
    expect(shown.state("bow")).to_be_visible()
    tab(shown, "dance").locator("xpath=..").locator(".close-tab").click()
    shown.page.get_by_role("dialog").get_by_role("button", name="Save", exact=True).click()
    shown.page.get_by_role("heading", name="Draw what your robot does").wait_for()
    assert "<name>bow</name>" in (root / "dance.xml").read_text()

    # An import leads to its file, and documents of one name to their folders.
    (root / "other").mkdir()
    (root / "other" / "dance.xml").write_text((root / "dance.xml").read_text())
    file = root / "main.xml"
    file.write_text(
        """<VisualHFSM>
          <SubAutomata id="1" idFather="0">
            <state initial="true" id="1"><name>all</name><idSubautomataSon>2</idSubautomataSon></state>
          </SubAutomata>
          <SubAutomata id="2" idFather="1"><import>other/dance.xml</import></SubAutomata>
        </VisualHFSM>"""
    )
    open_file(shown, "dance.xml")
    shown.expect_states("up", "out", "front", "low", "bow")
    open_file(shown, "main.xml")
    shown.state("all").click()
    shown.press("Enter", "Alt+t")
    data = shown.page.locator("hfsm-data-panel")
    expect(data.get_by_label("Automaton in it")).to_have_value("")
    data.get_by_role("button", name="other/dance.xml").click()
    chosen = shown.page.get_by_role("tablist", name="Open documents").get_by_role("tab", selected=True)
    expect(chosen).to_have_text(re.compile(r"dance\s+other"))


def test_what_another_program_wrote_is_merged(shown: EditorPage, root: Path) -> None:
    path = root / "dance.xml"
    banner = shown.page.get_by_role("alert").filter(has_text="Another program changed the file")
    open_file(shown, "dance.xml")
    shown.expect_states("up", "out", "front", "low")
    add_state(shown, "bow")
    path.write_text(path.read_text().replace("<name>front</name>", "<name>forward</name>"))
    banner.get_by_role("button", name="Merge both").click()
    shown.expect_states("up", "out", "forward", "low", "bow")
    expect(banner).to_have_count(0)

    # Saving over a file that changed offers what is possible.
    path.write_text(path.read_text().replace("<name>low</name>", "<name>theirs</name>"))
    banner.wait_for()
    shown.press("Control+s")
    shown.page.get_by_role("dialog").get_by_role("button", name="Merge both").click()
    shown.page.get_by_role("status").filter(has_text="Saved dance.xml").wait_for()
    assert {"<name>bow</name>", "<name>theirs</name>"} <= set(path.read_text().split())
    shown.state("bow").click()
    shown.press("F2")
    shown.name("again")
    shown.expect_states("up", "out", "forward", "theirs", "again")
    path.unlink()
    deleted = shown.page.get_by_role("alert").filter(has_text="deleted the file")
    deleted.wait_for()
    shown.press("Control+s")
    shown.page.get_by_role("dialog").get_by_role("button", name="Write it again").click()
    expect(deleted).to_have_count(0)
    assert "<name>again</name>" in path.read_text()

    # A merge names what both changed, and shows what no longer fits.
    shown.state("forward").click()
    shown.press("F2")
    shown.page.locator(".rename").fill("mine")
    shown.press("Enter")
    shown.state("out").click()
    shown.press("Delete")
    shown.expect_states("up", "mine", "theirs", "again")
    text = path.read_text().replace("<name>forward</name>", "<name>other</name>")
    path.write_text(text.replace("<name>there</name>", "<name>to out</name>", 1))
    banner.get_by_role("button", name="Merge both").click()
    notice = shown.page.locator(".notice").filter(has_text="Merged. Both sides had changed")
    expect(notice).to_contain_text("state “mine” (name): yours stays")
    expect(notice).to_contain_text("transition “to out” (deleted on one side): it stays")
    shown.expect_states("up", "mine", "theirs", "again")
    shown.page.get_by_role("button", name=re.compile("^1 error")).wait_for()


def test_a_comparison_shows_lines_that_differ_marks_what_is_new_and_draws_what_is_gone(
    shown: EditorPage,
) -> None:
    open_file(shown, "dance.xml")
    shown.expect_states("up", "out", "front", "low")
    with shown.editor.window() as window:
        (number,) = window.documents
        state = next(
            each for each in window.documents[number]["automata"][0]["states"] if each["name"] == "up"
        )
        command = {
            "command": "setText",
            "place": {"kind": "state", "automaton": 1, "id": state["id"], "part": "code"},
        }
        window.ask("do", tab=number, command={**command, "text": f"{state['code']}\nlast = 1"})
    expect(shown.page.locator(".last-step")).to_have_text("Edit the code of “up”")
    shown.choose_in("File", "Compare")
    shown.page.get_by_role("button", name="The saved version").click()
    shown.button("Next").click()
    expect(shown.page.get_by_role("region", name="Comparison")).to_contain_text("state up: code")
    lines = shown.page.get_by_role("list", name="Lines that differ").get_by_role("listitem")
    expect(lines.filter(has_text="last = 1")).to_have_class("added")
    assert lines.count() < 5
    shown.page.get_by_role("region", name="Comparison").get_by_role("button", name="Done").click()

    shown.state("out").click()
    shown.press("Delete")
    shown.expect_states("up", "front", "low")
    add_state(shown, "bow")
    shown.choose_in("File", "Compare")
    shown.page.get_by_role("button", name="The saved version").click()
    legend = shown.page.get_by_role("region", name="Comparison")
    expect(legend).to_contain_text("1 added")
    for name, mark in (("bow", "added"), ("out", "removed"), ("up", "changed"), ("low", "")):
        marked = re.compile(rf"\bis-{mark}")
        (expect(shown.state(name)).to_have_class if mark else expect(shown.state(name)).not_to_have_class)(
            marked
        )
    legend.get_by_role("button", name="Done").click()
    shown.expect_states("up", "front", "low", "bow")
    shown.choose_in("File", "Compare")
    shown.page.get_by_role("button", name="The saved version").click()
    expect(legend).to_be_visible()
    shown.state("bow").click()
    shown.press("Escape")
    expect(legend).to_have_count(0)
    shown.expect_states("up", "front", "low", "bow")


def test_imported_automata_that_come_late_are_printed(shown: EditorPage) -> None:
    open_file(shown, "dance_and_follow.xml")
    shown.expect_states("followBall", "dance")
    late = held_answers(shown, "imported")
    shown.expect_states("followBall", "dance")
    shown.page.evaluate("window.print = () => {}")
    shown.press("Control+e")
    shown.page.get_by_role("button", name="The whole behavior").click()
    expect(shown.page.get_by_role("dialog", name="Export")).to_have_count(0)
    until(lambda: shown.page.evaluate("1") and late, PAGE_LIMIT)  # messages come while the page is talked to
    while late:
        late.pop(0)()
    expect(shown.page.locator("body > .pages section figure svg")).to_have_count(5)
    shown.page.evaluate("dispatchEvent(new Event('afterprint'))")


def test_documents_are_exported_and_printed(shown: EditorPage, tmp_path: Path) -> None:
    # A document without automata can be selected in, and has no picture.
    drop(shown, "nothing.xml", "<VisualHFSM></VisualHFSM>")
    expect(tab(shown, "nothing")).to_have_attribute("aria-selected", "true")
    shown.page.locator("hfsm-canvas [role=application]").click()
    shown.press("Control+a")
    x, y = shown.middle(shown.page.locator("hfsm-canvas"))
    shown.page.mouse.move(x, y)
    shown.page.mouse.down()
    shown.page.mouse.move(x + 60, y + 40, steps=3)
    shown.page.mouse.up()
    shown.press("Control+e")
    dialog = shown.page.get_by_role("dialog", name="Export")
    dialog.wait_for()
    expect(dialog.get_by_role("button", name="Picture")).to_have_count(0)
    with shown.page.expect_download() as download:
        dialog.get_by_role("button", name="The document (XML)").click()
    shutil.copy(download.value.path(), tmp_path / "nothing.xml")
    assert ElementTree.parse(tmp_path / "nothing.xml").getroot().tag == "VisualHFSM"
    expect(shown.page.get_by_role("alert")).to_have_count(0)

    open_file(shown, "dance.xml")
    shown.expect_states("up", "out", "front", "low")
    for choice, name in (
        ("Picture of this automaton (SVG)", "dance.svg"),
        ("Picture of this automaton (PNG)", "dance.png"),
    ):
        shown.press("Control+e")
        with shown.page.expect_download() as download:
            shown.page.get_by_role("button", name=choice).click()
        assert download.value.suggested_filename == name
        shutil.copy(download.value.path(), tmp_path / name)
    picture = ElementTree.parse(tmp_path / "dance.svg").getroot()
    texts = {"".join(each.itertext()) for each in picture.iter("{http://www.w3.org/2000/svg}text")}
    assert {"up", "out", "front", "low"} <= texts
    assert not any("var(" in value for each in picture.iter() for value in each.attrib.values())
    content = (tmp_path / "dance.png").read_bytes()
    assert content.startswith(PNG_SIGNATURE)
    width, height = struct.unpack(">II", content[16:24])
    assert (width, height) == (2 * float(picture.attrib["width"]), 2 * float(picture.attrib["height"]))

    # The whole behavior is printed, and nothing else.
    open_file(shown, "dance_and_follow.xml")
    shown.expect_states("followBall", "dance")
    shown.page.evaluate("window.print = () => {}")  # the dialog of the browser stays open
    shown.press("Control+e")
    shown.page.get_by_role("button", name="The whole behavior").click()
    pages = shown.page.locator("body > .pages")
    shown.page.emulate_media(media="print")
    expect(pages.get_by_role("heading", name="dance_and_follow").first).to_be_visible()
    expect(pages.get_by_role("heading", name="State red, initial")).to_be_visible()
    expect(pages.get_by_text("→ dance: enough")).to_be_visible()
    expect(pages.locator("section figure svg")).to_have_count(5)
    expect(pages.get_by_role("cell", name="RightShoulderMotors").first).to_be_visible()
    expect(shown.page.locator("hfsm-app")).to_be_hidden()
    shown.page.evaluate("dispatchEvent(new Event('afterprint'))")
    expect(pages).to_have_count(0)
    expect(shown.page.locator("hfsm-app")).to_be_visible()
