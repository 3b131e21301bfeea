"""Edit code and data in the panels next to the canvas, through the real server."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest
from playwright.sync_api import Browser, Locator, WebSocketRoute, expect

from tests.support.browser import Box, EditorPage, editor_page, saved
from tests.support.editor import Editor, NoPart, editor, parts
from tests.support.limits import FOREVER, PAGE_LIMIT, RUN_LIMIT
from tests.support.panels import DOCUMENT, add, choose, edit, panel_violations, show_list, undo_names
from visualhfsm.project._code_help.service import CodeHelp

CAMERA = """
  <config>
    <iceinterface>
      <nameinterface>eye</nameinterface><nameproxy>Camera</nameproxy><interface>Camera</interface>
    </iceinterface>
  </config>
"""

RING: Final = """each => {
  const {outlineOffset, outlineWidth} = getComputedStyle(each);
  return each.getBoundingClientRect().bottom + parseFloat(outlineOffset) + parseFloat(outlineWidth);
}"""
"""Where the ring around a focused element ends."""


@pytest.fixture
def document() -> str:
    return DOCUMENT


CUT_HINTS = """panel => [...panel.querySelectorAll("input[placeholder]")].filter((each) => {
  const {font, paddingLeft, paddingRight} = getComputedStyle(each);
  const context = document.createElement("canvas").getContext("2d");
  context.font = font;
  const room = each.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight);
  return context.measureText(each.placeholder).width > room;
}).map((each) => each.placeholder)"""
"""The texts in empty fields that are longer than these."""

LISTENS_AFTER = 150
"""A list has the keys so many ms after it came; before that, an arrow moves the cursor, which closes the list."""


def until_selected(shown: EditorPage, option: Locator) -> None:
    """Press a key until it leads to an option of a list that is open."""
    option.wait_for()
    shown.page.wait_for_timeout(LISTENS_AFTER)
    deadline = time.monotonic() + PAGE_LIMIT
    while option.get_attribute("aria-selected") is None:
        assert time.monotonic() < deadline
        shown.press("ArrowDown")


# ------------------------------------------------------------------------------------------------ code


def test_nothing_of_codemirror_is_loaded_before_the_first_code(browser: Browser, opened: Editor) -> None:
    loaded: list[str] = []
    with editor_page(browser, opened, cached=False) as shown:
        shown.page.on("request", lambda request: loaded.append(request.url))
        shown.state("wait").wait_for()
        assert not [url for url in loaded if "codemirror" in url]
        edit(shown, "wait")
        assert [url for url in loaded if "codemirror" in url]


@pytest.mark.parametrize("merge_within", [FOREVER])
def test_code_is_typed_in_named_steps(own: EditorPage, path: Path) -> None:
    code = edit(own, "wait")

    # A burst of typing is one step.
    for word in ("\nspeed = 1", "\nspeed = 2", "\nspeed = 3"):
        own.insert(word)
        own.page.wait_for_function(
            "() => document.querySelector('hfsm-status').textContent.includes('Edit the code')"
        )
    assert undo_names(own) == ["Edit the code of “wait”"]
    own.press("Control+z")
    expect(code).to_have_text("count += 1")
    own.press("Control+Shift+Z")
    expect(code).to_contain_text("speed = 3")
    own.press("Control+z")
    expect(code).to_have_text("count += 1")

    # What is typed over colored code replaces it. The page fails when the browser reports a style that the policy
    # refuses.
    own.type(" if 3 else 'text'")
    own.press("Shift+Home")
    own.type("x")
    expect(code).to_have_text("x")
    own.press("Control+a")
    own.type("(")  # brackets go around what is selected
    expect(code).to_have_text("(x)")

    own.press("Control+a")
    own.type("count += 1\nif count > 3:\nself.log.info('many')")
    document = saved(own, path)
    assert document.automata[0].states[0].code.text == "count += 1\nif count > 3:\n    self.log.info('many')"


@pytest.fixture
def fresh(browser: Browser, opened: Editor) -> Iterator[EditorPage]:
    """A window without a cache, so that all that it loads is seen."""
    with editor_page(browser, opened, cached=False) as shown:
        shown.state("wait").wait_for()
        yield shown


def test_keys_lead_into_the_code_and_what_is_typed_stays_there(fresh: EditorPage, path: Path) -> None:
    shown = fresh
    # What is typed before the panel is there is typed into it.
    shown.state("wait").locator(".body").click()
    asked = shown.held("**/code/editor.js", lambda: shown.press("Shift+Enter"))
    shown.type("sti = 1\n")  # each of which does something on the canvas
    asked.continue_()
    code = shown.page.get_by_role("textbox", name="Code of the state wait")
    expect(code).to_be_focused()
    lines = code.locator(".cm-line")
    expect(lines).to_have_text(["sti = 1", "count += 1"])
    shown.expect_states("wait", "go")
    shown.press("Escape")
    expect(shown.state("wait")).to_be_focused()

    # The cursor stays while another panel is shown.
    edit(shown, "wait")
    shown.page.get_by_role("tab", name="Data", exact=True).click()
    expect(code).to_have_count(0)
    shown.state("wait").locator(".body").click()
    shown.press("Shift+Enter")
    expect(code).to_be_focused()
    shown.type("0")
    expect(lines).to_have_text(["sti = 1", "count += 10"])

    # What is typed last is not lost when another state is selected.
    shown.insert("\nlast = 1")
    shown.page.get_by_role("treeitem", name="go").click()
    text = "sti = 1\ncount += 10\nlast = 1"
    assert saved(shown, path).automata[0].states[0].code.text == text

    # The cursor stays where it is when the code changes elsewhere.
    edit(shown, "wait")
    shown.press("Home", "Control+ArrowRight")
    place = {"kind": "state", "automaton": 1, "id": 1, "part": "code"}
    shown.editor.do({"command": "setText", "place": place, "text": f"first = 1\n{text}"})
    expect(code).to_contain_text("first = 1")
    shown.type("s")
    expect(lines).to_have_text(["first = 1", "sti = 1", "count += 10", "lasts = 1"])

    # Names that may complete what was typed, and are not shown yet, do not take the key.
    shown.type("s")
    shown.press("Escape")
    expect(shown.state("wait")).to_be_focused()
    expect(lines).to_have_text(["first = 1", "sti = 1", "count += 10", "lastss = 1"])


def test_keys_after_a_new_document_go_to_its_canvas(shown: EditorPage) -> None:
    code = edit(shown, "wait")
    shown.type("1")
    expect(code).to_contain_text("count += 11")
    shown.press("Alt+n", "s", "Enter")
    shown.name("first")
    shown.expect_states("first")
    expect(shown.state("first")).to_be_focused()
    # The same from a field of a panel, and by the menu.
    shown.press("Control+f")
    expect(shown.page.get_by_role("searchbox")).to_be_focused()
    shown.press("Alt+n")
    expect(shown.page.get_by_role("application")).to_be_focused()
    shown.choose_in("File", "New")
    shown.press("s", "Enter")
    shown.name("second")
    shown.expect_states("second")
    shown.page.get_by_role("tab", name="walk").click()
    expect(edit(shown, "wait")).to_have_text("count += 11")


def test_shift_enter_in_a_name_that_is_typed_opens_the_code(shown: EditorPage) -> None:
    shown.state("go").locator(".body").click()
    shown.press("F2")
    shown.type("run")
    shown.press("Shift+Enter")
    shown.type("sei = 1\n")
    code = shown.page.get_by_role("textbox", name="Code of the state run")
    expect(code).to_be_focused()
    expect(code.locator(".cm-line").first).to_have_text("sei = 1")
    shown.expect_states("wait", "run")

    # The same keys are pressed before a new state is there.
    sent: list[str] = []
    answers: list[str] = []

    def hold(route: WebSocketRoute) -> None:
        server = route.connect_to_server()

        def forward(message: str | bytes) -> None:
            sent.append(str(message))
            server.send(message)

        route.on_message(forward)
        server.on_message(
            lambda message: (
                answers.append(str(message)) if "addState" in "".join(sent) else route.send(message)
            )
        )
        held.append(route)

    held: list[WebSocketRoute] = []
    shown.page.route_web_socket("**/ws", hold)
    shown.page.reload()
    shown.state("wait").wait_for()
    shown.press("s", "Enter")
    shown.type("turn")
    shown.press("Enter", "Shift+Enter")
    shown.type("sei = 1\n")
    deadline = time.monotonic() + PAGE_LIMIT
    while not any('"re"' in answer for answer in answers):
        assert time.monotonic() < deadline, answers
        shown.page.wait_for_timeout(20)
    while answers:
        held[-1].send(answers.pop(0))
    sent.clear()
    code = shown.page.get_by_role("textbox", name="Code of the state turn")
    expect(code).to_be_focused()
    expect(code.locator(".cm-line").first).to_have_text("sei = 1")
    shown.expect_states("wait", "run", "turn")
    shown.spent = True  # its connections pass through the test


def test_problems_that_come_before_the_answer_to_an_edit_are_marked(shown: EditorPage) -> None:
    edits: set[int] = set()
    late: list[str | bytes] = []

    def hold(route: WebSocketRoute) -> None:
        server = route.connect_to_server()

        def ask(message: str | bytes) -> None:
            request = json.loads(message)
            if request["op"] == "do":
                edits.add(request["id"])
            server.send(message)

        def answer(message: str | bytes) -> None:
            content = json.loads(message)
            if content.get("re") in edits:
                late.append(message)
                return
            route.send(message)
            if content.get("push") == "problems":
                while late:
                    route.send(late.pop(0))

        route.on_message(ask)
        server.on_message(answer)

    shown.page.route_web_socket("**/ws", hold)
    shown.page.reload()
    shown.spent = True  # its connections pass through the test
    code = edit(shown, "wait")
    shown.insert("\nif count")
    code.locator(".cm-lintRange-error").wait_for()
    shown.insert(" > 3: pass")
    expect(code.locator(".cm-lintRange-error")).to_have_count(0)


def test_a_problem_a_huge_paste_and_a_lost_connection_are_met_while_typing(
    shown: EditorPage, path: Path
) -> None:
    code = edit(shown, "wait")
    shown.type("1")
    shown.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    shown.page.evaluate("navigator.clipboard.writeText('x'.repeat(1_000_000))")
    shown.press("Control+v")
    refusal = shown.page.get_by_role("alert").filter(has_text="at most 1,000,000")
    expect(refusal).to_contain_text("That would be 1,000,011 characters")
    expect(code).to_have_text("count += 11")
    name = "hfsm-text-field[data-part=name] input"
    shown.page.locator(name).first.fill("y" * 1_000_001)
    expect(shown.page.locator(name).first).to_have_value("wait")
    assert saved(shown, path).automata[0].states[0].code.text == "count += 11"
    away = shown.page.get_by_role("alert").filter(has_text="No connection since")
    expect(away).to_have_count(0)
    shown.dismiss(shown.page.get_by_role("alert"))

    # An error is marked as it is typed, and no longer when it is fixed.
    edit(shown, "wait")
    shown.insert("\nif count")
    code.locator(".cm-lintRange-error").wait_for()
    badge = shown.page.get_by_role("tab", name="Code, not empty, 1 problem", exact=True)
    badge.wait_for()
    assert panel_violations(shown) == []
    shown.insert(" > 3: pass")
    expect(code.locator(".cm-lintRange-error")).to_have_count(0)
    expect(badge).to_have_count(0)

    # What is typed while the server is away comes when it is back.
    shown.connections.cut()
    away.wait_for()
    shown.insert("\nspeed = 1")
    expect(code).to_contain_text("speed = 1")
    shown.press("Control+s")
    expect(shown.page.locator(".notice.error")).to_contain_text("The editor is offline")
    shown.connections.restore()
    # On a busy machine the page may have tried by itself, and the button is gone.
    shown.button("Try now").evaluate_all("all => all.forEach((each) => each.click())")
    expect(away).to_have_count(0)
    text = "count += 11\nif count > 3: pass\nspeed = 1"
    assert saved(shown, path).automata[0].states[0].code.text == text


def test_two_windows_type_into_the_same_code_at_once(browser: Browser, shown: EditorPage, path: Path) -> None:
    with editor_page(browser, shown.editor) as other:
        for window in (shown, other):
            edit(window, "wait")
        shown.press("Control+Home")
        for letter in range(10):
            shown.insert(chr(ord("a") + letter))
            other.insert(chr(ord("A") + letter))
        code = "abcdefghijcount += 1ABCDEFGHIJ"
        for window in (shown, other):
            expect(window.page.get_by_role("textbox", name="Code of the state wait")).to_have_text(code)
        assert saved(shown, path).automata[0].states[0].code.text == code


class Graph(NoPart):
    """A graph of ROS, and a realm in which a robot serves its head and a camera."""

    async def identities(self) -> object:
        return {"Head": ["::nao::PoseHead"], "Camera": ["::nao::Camera"]}

    async def ros_graph(self) -> object:
        twist, scan = "geometry_msgs/msg/Twist", "sensor_msgs/msg/LaserScan"
        return {
            "topics": {"/base/cmd_vel": [twist], "/scan": [scan]},
            "services": {"/stop": ["std_srvs/srv/Trigger"]},
            "actions": {},
            "types": {"msg": [twist, scan], "srv": ["std_srvs/srv/Trigger"], "action": []},
        }


@pytest.fixture(scope="module")
def helpful(shared_root: Path) -> Iterator[Editor]:
    """An editor that knows the interfaces, a robot and a graph: it reads for seconds what code imports."""
    known = parts(code_help=CodeHelp(RUN_LIMIT), followers=Graph())
    with editor(shared_root, make_parts=lambda _: known) as helpful:
        yield helpful


@pytest.fixture
def declared() -> str:
    """What the document declares of interfaces."""
    return ""


@pytest.fixture
def helped(browser: Browser, helpful: Editor, path: Path, declared: str) -> Iterator[EditorPage]:
    """The page of that editor, in which code is completed."""
    path.write_text(DOCUMENT.replace("</VisualHFSM>", declared + "</VisualHFSM>"))
    with helpful.opened(path), editor_page(browser, helpful) as shown:
        shown.state("wait").wait_for()
        yield shown


@pytest.mark.parametrize("declared", [CAMERA], ids=["a camera"])
def test_completion_knows_the_document_and_the_interfaces(helped: EditorPage) -> None:
    code = edit(helped, "wait")
    options = helped.page.locator(".cm-tooltip").get_by_role("option")
    info = helped.page.locator(".cm-completionInfo")
    signature = helped.page.locator(".cm-tooltip.cm-help")
    helped.insert("\nself.eye.getImageDat")
    options.first.wait_for(timeout=RUN_LIMIT * 1000)  # the first answer reads all that the code imports
    expect(options).to_have_count(1)
    info.wait_for()
    expect(info).to_contain_text("newest image")
    options.first.click()
    expect(code).to_contain_text("self.eye.getImageData")
    helped.type("(")
    signature.wait_for()
    expect(signature).to_contain_text("getImageData(format")
    assert Box.of(signature).y > Box.of(code.locator(".cm-activeLine")).y  # no tab above is covered
    assert Box.of(signature).y + Box.of(signature).height <= sum(Box.of(code)[1::2])
    helped.press("Escape")
    helped.insert(")\ncou")
    options.first.wait_for()
    expect(options.first).to_have_text(re.compile("^count"))
    helped.press("Escape")
    helped.insert("\n''.")
    options.first.wait_for()
    expect(options.first).to_have_text(re.compile("^capitalize"))
    until_selected(helped, options.nth(1))
    for _ in range(4):
        helped.press("PageDown")  # to options whose documentation did not come along
    info.wait_for()
    expect(info).to_contain_text("Return")
    helped.press("Enter")
    expect(code).to_contain_text(re.compile(r"''\.\w"))

    # A word that nothing else begins with is not offered once it is there.
    helped.press("Control+a", "Delete")
    helped.type("brea")
    options.filter(has_text="breakpoint").wait_for()
    expect(options).to_have_count(2)
    helped.type("k")
    expect(options.first).to_have_text(re.compile("^break"))
    helped.type("point")
    expect(options).to_have_count(0)

    # On a phone the options are all that there is room for.
    helped.press("Escape")
    helped.resize(390, 844)
    code.click()
    helped.press("Control+End")
    helped.insert("\nself.eye.")
    options.first.wait_for()
    info.wait_for(state="attached")
    expect(info).to_be_hidden()


# --------------------------------------------------------------------------------- states and transitions


def test_transitions_get_times_events_and_places(shown: EditorPage, path: Path) -> None:
    # A condition becomes a time and keeps its expression as guard.
    choose(shown, "enough")
    shown.choose("Time")
    after = shown.page.get_by_label("After", exact=True)
    expect(after).to_be_focused()
    expect(after).to_have_value("1 s")
    shown.type("1500 ms")
    expect(after).to_have_value("1500 ms")
    shown.press("Tab")
    expect(after).to_have_value("1.5 s")
    expect(shown.page.get_by_role("textbox", name="Guard of enough")).to_have_text("count > 5")
    transition = saved(shown, path).automata[0].transitions[0]
    assert (transition.type, transition.trigger.text, transition.guard.text) == ("time", "1500", "count > 5")

    # Events that the code sends are offered.
    edit(shown, "wait")
    shown.insert("\nself.send('ball lost')")
    choose(shown, "late")
    shown.choose("Event")
    field = shown.page.get_by_label("Event", exact=True).and_(shown.page.locator("input[type=text]"))
    offered = field.evaluate("input => [...input.list.options].map(each => each.value)")
    assert offered == ["ball lost"]
    field.fill("ball lost")
    transition = saved(shown, path).automata[0].transitions[1]
    assert (transition.type, transition.trigger.text) == ("event", "ball lost")
    assert panel_violations(shown) == []

    # Transitions of a state change places.
    expect(shown.page.get_by_text("tried as number 2 of 2")).to_be_visible()
    shown.page.locator("hfsm-code-panel").get_by_role("button", name="Evaluate earlier").click()
    expect(shown.page.get_by_text("tried as number 1 of 2")).to_be_visible()


def test_entry_and_exit_code_and_arguments_have_tabs_that_arrows_go_through(
    shown: EditorPage, path: Path
) -> None:
    edit(shown, "wait")
    shown.page.get_by_role("tab", name="Entry").click()
    expect(shown.page.get_by_role("textbox", name="Entry code of the state wait")).to_be_focused()
    hint = Box.of(shown.page.locator(".side .cm-placeholder"))
    assert hint.is_within(Box.of(shown.page.locator(".side .cm-scroller")))
    shown.page.get_by_role("tab", name="Entry").focus()
    shown.press("ArrowRight", "ArrowRight")
    expect(shown.page.get_by_role("tab", name="Exit, not empty")).to_be_focused()
    expect(shown.page.get_by_role("textbox", name="Exit code of the state wait")).to_contain_text("leaving")
    shown.press("Home")
    entry = shown.page.get_by_role("textbox", name="Entry code of the state wait")
    entry.click()
    shown.insert("count = 0")
    shown.page.get_by_role("tab", name="Arguments").click()
    shown.page.get_by_role("textbox", name="Argument color").click()
    shown.insert("'green'")
    state = saved(shown, path).automata[0].states[0]
    assert state.entry.text == "count = 0"
    assert [(each.name, each.value.text) for each in state.arguments] == [("color", "'green'")]
    shown.button("Remove the argument color").click()
    expect(shown.button("Remove the argument color")).to_have_count(0)


# ------------------------------------------------------------------------------------------------- data


def test_labels_stand_at_one_edge_and_fields_at_one_edge(shown: EditorPage) -> None:
    show_list(shown, "Alt+i", "interface")
    add(shown, "interface", "camera")
    panel = shown.page.locator(".data-panel")
    for what, count in ((panel.locator("label"), 8), (panel.locator("input, select, textarea"), 8)):
        assert len({round(Box.of(each).x) for each in what.all()[:count]}) == 1
    assert panel.evaluate(CUT_HINTS) == []


def test_the_ring_around_a_button_covers_nothing_of_the_line_below_it(shown: EditorPage) -> None:
    shown.press("Alt+p")
    add = shown.button("Add an interface")
    add.focus()
    shown.press("Shift+Tab", "Tab")  # a ring is for who uses keys
    expect(add).to_be_focused()
    assert add.evaluate(RING) <= Box.of(shown.page.locator("hfsm-entries .explain").first).y


def test_interfaces_parameters_properties_and_variables_are_edited(shown: EditorPage, path: Path) -> None:
    show_list(shown, "Alt+i", "interface")
    entry = add(shown, "interface", "camera")
    entry.get_by_label("Interface", exact=True).fill("Camera")
    entry.get_by_label("On the robot", exact=True).fill("CameraBottom")

    show_list(shown, "Alt+p", "parameter")
    field = add(shown, "parameter", "speed").get_by_label("Default", exact=True)
    field.fill("fast")
    expect(field).to_have_attribute("aria-invalid", "true")
    expect(field).to_have_accessible_description(re.compile("not a Python literal"))
    field.fill("0.3")
    expect(field).not_to_have_attribute("aria-invalid", "true")
    second = add(shown, "parameter", "loud")
    second.get_by_label("Type", exact=True).select_option("bool")
    second.get_by_label("Default", exact=True).fill("False")
    shown.press("Alt+ArrowUp")
    expect(shown.page.get_by_role("group", name="parameter")).to_have_count(2)
    expect(shown.page.get_by_role("group", name="parameter").first).to_have_accessible_name("parameter loud")
    document = saved(shown, path)
    (interface,) = document.interfaces
    assert (interface.name, interface.type, interface.proxy) == ("camera", "Camera", "CameraBottom")
    found = [(each.name, each.type.text, each.default.text) for each in document.parameters]
    assert found == [("loud", "bool", "False"), ("speed", "float", "0.3")]
    shown.button("Remove parameter loud").click()
    expect(
        shown.page.get_by_role("group", name="parameter speed").get_by_label("Name", exact=True)
    ).to_be_focused()

    entry = add(shown, "property", "stays")
    entry.get_by_label("Expression", exact=True).fill("wait or go")
    entry.get_by_text("Holds in every run.").wait_for()
    shown.page.get_by_text("hold as long as cycles begin and end within their periods").wait_for()
    entry.get_by_label("Kind", exact=True).select_option("never")
    entry.get_by_text("Violated.").wait_for()
    entry.get_by_label("Expression", exact=True).fill("go")

    shown.press("Alt+t")
    period = shown.page.get_by_label("Period", exact=True)
    expect(period).to_be_focused()
    period.fill("20")
    shown.page.get_by_text("50 Hz").wait_for()
    shown.press("Alt+v")
    expect(shown.page.get_by_role("textbox", name="Variables")).to_be_focused()
    shown.press("Control+End")
    shown.insert("\nspeed = 0.0")
    automaton = saved(shown, path).automata[0]
    assert (automaton.iteration_time.text, automaton.variables.text) == ("20", "count = 0\nspeed = 0.0")

    # The counterexample of a property is played on the canvas.
    shown.press("Control+m")
    expect(shown.page.get_by_role("button", name=re.compile("stays is violated"))).to_be_visible()
    shown.page.get_by_role("button", name=re.compile(r"Play the \d+ steps")).click()
    expect(shown.page.locator(".state.active")).to_have_count(1)
    expect(shown.page.get_by_text("Step 1 of")).to_be_visible()
    shown.button("Next step").focus()
    shown.press("End")
    expect(shown.page.locator('.state.active[aria-label^="State go"]')).to_have_count(1)
    assert panel_violations(shown) == []
    shown.button("Stop playing").click()
    expect(shown.page.locator(".state.active")).to_have_count(0)

    shown.press("Alt+p")
    for entry_of_a_list in ("a parameter", "a property", "an interface"):
        shown.button(f"Add {entry_of_a_list}").click()
    shown.page.get_by_role("list", name="Problems").wait_for()
    assert panel_violations(shown) == []


def test_what_it_must_survive_is_chosen_of_what_its_robot_can_have(shown: EditorPage, path: Path) -> None:
    shown.press("Alt+p")
    entry = add(shown, "failure", "LKneePitch")
    kind = entry.get_by_label("How it fails", exact=True)
    offered = "input => [...input.list?.options ?? []].map((each) => each.value)"
    expect(kind).to_have_attribute("list", re.compile("."))
    assert "stuck" in kind.evaluate(offered)
    assert "Camera" in entry.get_by_label("Part that fails", exact=True).evaluate(offered)
    kind.fill("weak")
    amount = entry.get_by_label("How much", exact=True)
    amount.fill("half")
    expect(entry).to_contain_text("amount is half: write a number")
    amount.fill("0.5")
    entry.get_by_label("What it must do", exact=True).select_option("succeed")
    (survives,) = saved(shown, path).survives
    assert (survives.failure, survives.must) == ("LKneePitch weak 0.5", "succeed")
    assert panel_violations(shown) == []
    shown.button("Remove failure LKneePitch").click()
    expect(shown.page.get_by_role("group", name=re.compile("^failure "))).to_have_count(0)
    shown.press("Control+z")
    assert [each.failure for each in saved(shown, path).survives] == ["LKneePitch weak 0.5"]


def test_what_the_robot_has_is_offered_to_code_and_declared_by_choosing_it(
    helped: EditorPage, path: Path
) -> None:
    code = edit(helped, "wait")
    helped.insert("\nself.Came")
    option = helped.page.locator(".cm-tooltip").get_by_role("option")
    option.wait_for(timeout=RUN_LIMIT * 1000)
    expect(option).to_have_text("Cameradeclare Camera")
    option.click()
    expect(code).to_contain_text("self.Camera")
    document = saved(helped, path)
    assert [(each.name, each.type) for each in document.interfaces] == [("Camera", "Camera")]
    helped.insert(".getCameraDescr")
    expect(option).to_have_text(re.compile("^getCameraDescription"))


def test_what_the_robot_and_the_graph_of_ros_have_is_declared_by_a_click(
    browser: Browser, path: Path
) -> None:
    with (
        editor(path.parent, path, make_parts=lambda _: parts(followers=Graph())) as running,
        editor_page(browser, running) as shown,
    ):
        code = edit(shown, "wait")
        shown.insert("\nself.Head.stop()")
        squiggle = code.locator(".cm-lintRange-warning", has_text="Head")
        declare = shown.page.get_by_role("button", name="Declare Head (PoseHead)")
        shown.hover(squiggle, shows=declare)
        declare.click()
        expect(squiggle).to_have_count(0)
        shown.press("Alt+i")
        shown.page.get_by_text("What a Nao has: 2").click()
        shown.page.get_by_text("What the graph of ROS has").click()
        shown.button("subscribe /scan").click()
        expect(shown.button("subscribe /scan")).to_have_count(0)
        assert panel_violations(shown) == []
        shown.button("publish /base/cmd_vel").click()
        entry = shown.page.get_by_role("group", name="topic cmd_vel")
        entry.get_by_label("At the stop").select_option("false")
        offered = entry.get_by_label("Type", exact=True).evaluate(
            "input => [...input.list.options].map(each => each.value)"
        )
        assert offered == ["geometry_msgs/msg/Twist", "sensor_msgs/msg/LaserScan"]
        shown.button("Declare Camera").click()
        expect(shown.button("Declare Camera")).to_have_count(0)
        expect(shown.button("Declare Head")).to_have_count(0)
        document = saved(shown, path)
        declared = [(each.name, each.type) for each in document.interfaces]
        assert declared == [("Head", "PoseHead"), ("Camera", "Camera")]
        scan, cmd_vel = document.ros
        assert (scan.name, scan.kind, scan.target, scan.type) == ("scan", "subscribe", "/scan", offered[1])
        assert (cmd_vel.name, cmd_vel.kind, cmd_vel.stop.text) == ("cmd_vel", "publish", "false")
