"""Run, follow and steer components from the editor's page: real components, a fake robot, Chromium."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from hfsm_runtime.recording_file.reader import RecordingFile
from tests.support.browser import EditorPage, new_context, shared_address
from tests.support.editor import Editor
from tests.support.monitor import (
    DOCUMENT,
    comes_true,
    expect_breakpoint,
    expect_current,
    follow,
    monitor_page,
    run,
    run_again,
    started_elsewhere,
    status,
)
from tests.support.robot_server import ServedRobot, eventually
from tests.support.watching import content

COVERED = """() => {
  const tip = document.querySelector("[role=tooltip]").getBoundingClientRect();
  const named = document.querySelector("hfsm-canvas").surface.querySelectorAll(".label text, .state");
  return [...named].filter((each) => {
    const {left, right, top, bottom} = each.getBoundingClientRect();
    return left < tip.right && tip.left < right && top < tip.bottom && tip.top < bottom;
  }).map((each) => each.textContent);
}"""
"""The names that a tooltip lies over."""


@pytest.fixture
def document() -> str:
    return DOCUMENT


@pytest.fixture
def shown(live_page: EditorPage) -> EditorPage:
    return live_page


def notice(shown: EditorPage, text: str | re.Pattern[str]) -> None:
    """Wait for a message."""
    expect(shown.page.locator(".notice").filter(has_text=text)).to_be_visible()


def open_document(shown: EditorPage, name: str) -> None:
    """Open another document of the folder."""
    shown.press("Control+o")
    shown.page.get_by_role("option", name=f"{name}.xml").dblclick()
    show_document(shown, name)


def show_document(shown: EditorPage, name: str) -> None:
    """Show an open document, and wait until it is there."""
    tab = re.compile(f"^{name}( |$)")
    shown.page.get_by_role("tab", name=tab).click()
    shown.page.get_by_role("tab", name=tab, selected=True).wait_for()


def send(shown: EditorPage, event: str) -> None:
    """Send an event to the component."""
    shown.press("Alt+e")
    shown.page.get_by_label("Event", exact=True).fill(event)
    shown.press("Enter")
    notice(shown, f"Sent {event}.")


def force_late(shown: EditorPage) -> None:
    """Fire the transition from `wait` to `go`."""
    shown.transition("late").locator(".handle").click()
    shown.press("Alt+Enter")


def toggle_breakpoint(shown: EditorPage, state: str) -> None:
    """Set or remove the breakpoint of a state."""
    shown.state(state).locator(".body").click()
    expect(shown.page.locator("hfsm-canvas :focus")).to_have_count(1)  # keys without Alt are the drawing's
    shown.press("b")


# ------------------------------------------------------------------------------------------------ canvas


def test_a_run_is_shown_on_the_canvas_in_the_tree_and_in_the_output(shown: EditorPage) -> None:
    rows = shown.page.get_by_role("treeitem")
    tooltip = shown.page.get_by_role("tooltip")
    run(shown)
    expect_current(shown, "wait")
    expect(shown.transition("late")).to_have_class(re.compile(r"\bwaiting\b"))
    expect(shown.transition("many")).to_have_attribute("aria-label", re.compile("condition false"))
    expect(rows.filter(has_text="look")).to_have_attribute("data-live", "active")

    shown.hover(shown.state("wait").locator(".body"), shows=tooltip)  # why not
    expect(tooltip).to_contain_text("many")
    assert shown.page.evaluate(COVERED) == []
    shown.page.mouse.move(5, 5)
    expect(tooltip).to_have_count(0)
    shown.state("wait").focus()
    shown.press("a")
    expect(shown.page.get_by_role("combobox", name="Search the shelf")).to_be_focused()
    shown.hover(shown.state("wait").locator(".body"), shows=tooltip)
    shown.type("w")  # what one types is not covered
    expect(tooltip).to_have_count(0)
    shown.press("Escape", "Escape")
    shown.page.mouse.move(5, 5)
    shown.transition("late").focus()
    shown.press("w")
    expect(tooltip).to_contain_text("its time comes after")
    shown.press("Escape")
    expect(tooltip).to_have_count(0)

    shown.press("g")  # follow what is active deepest
    expect_current(shown, "look")
    shown.press("g", "Backspace")
    expect_current(shown, "wait")

    force_late(shown)
    expect_current(shown, "go")
    expect(shown.state("wait")).to_have_class(re.compile(r"\btrail\b"))
    expect(shown.page.locator("hfsm-canvas .state:not(.selected) .glow:visible")).to_have_count(
        0
    )  # a ring: selected
    expect(shown.transition("late")).to_have_class(re.compile(r"\bfired\b"))
    expect(rows.filter(has_text="go")).to_have_attribute("aria-current", "true")
    expect(rows.filter(has_text="look")).to_have_attribute("data-live", "ghost")
    shown.state("wait").focus()
    shown.press("Control+Enter")
    expect(shown.state("look")).to_have_class(re.compile(r"\bghost\b"))
    send(shown, "home")
    expect_current(shown, "look")
    send(shown, "ball")
    expect_current(shown, "found", "finished")

    shown.state("look").focus()
    shown.press("Backspace")
    expect_current(shown, "wait")
    shown.press("Alt+l")
    for name, value, text in (("speed", "0.5", "0.5"), ("count", "2000000", "2000000")):
        shown.page.get_by_role("textbox", name=name, exact=True).fill(value)
        shown.press("Enter")
        notice(shown, f"Set {name} to {text}.")
    expect_current(shown, "go")  # through `many`

    shown.press("Alt+o")
    output = shown.page.locator("hfsm-output .list-tools > span").first
    expect(output).to_have_text("Running")
    shown.press("F8")
    expect(output).to_have_text("Paused")
    expect(status(shown)).to_have_attribute("title", "Paused\nThe robot and its world go on.")
    shown.press("F8")
    expect(output).to_have_text("Running")


def test_a_run_leaves_the_drawing_in_its_place_and_its_state_can_be_read_from_far_away(
    shown: EditorPage,
) -> None:
    place = shown.middle_of("wait")
    run(shown)
    expect_current(shown, "wait")
    expect(shown.page.locator("main > hfsm-monitor-timeline")).to_be_visible()
    shown.expect_at("wait", place)
    shown.page.evaluate("document.querySelector('hfsm-canvas').viewport.zoom(0.3)")
    name, body = (shown.state("wait").locator(part) for part in (".name", ".body"))
    expect(name).to_have_css("stroke", body.evaluate("body => getComputedStyle(body).fill"))
    scale = shown.page.evaluate("document.querySelector('hfsm-canvas').viewport.scale")
    width = name.evaluate("name => parseFloat(getComputedStyle(name).strokeWidth)")
    assert 2 < width / 2 * scale < 4  # pixels around its letters


def test_output_that_was_opened_before_a_run_stays_open_while_it_is_empty(
    browser: Browser, followed: Editor
) -> None:
    output = "**/panels/output.js"
    with monitor_page(browser, followed, cached=False, holds=output) as shown:
        asked = shown.held(output, lambda: shown.press("Alt+o"))
        run(shown)
        asked.continue_()
        panel = shown.page.locator("hfsm-output")
        expect(panel.locator(".list-tools > span").first).to_have_text("Running")
        expect(panel.locator(".line")).to_have_count(0)


def test_a_run_is_shown_beside_its_own_document_and_started_from_a_state(
    shown: EditorPage, path: Path
) -> None:
    document = path.read_text()
    beginning, _, _ = document.partition('<SubAutomata id="2"')
    stub = '<SubAutomata id="2" idFather="1"><import automaton="2">walk.xml</import></SubAutomata>'
    path.with_name("guide.xml").write_text(f"{beginning}{stub}</VisualHFSM>")
    path.with_name("other.xml").write_text(document)
    timeline = shown.page.get_by_role("slider", name="Moment of the run")
    open_document(shown, "guide")
    run(shown)
    shown.state("wait").focus()
    shown.press("Control+Enter")
    expect_current(shown, "look")  # where it is imported
    expect(shown.page.locator("hfsm-status")).to_contain_text("from walk.xml")
    shown.press("Alt+l")
    values = shown.page.locator("hfsm-live-variables")
    expect(values).to_be_visible()

    open_document(shown, "other")
    expect(shown.button("Show guide")).to_be_visible()
    expect(values).to_be_visible()
    shown.button("Stop").click()
    expect(status(shown)).to_have_count(0)
    expect(timeline).to_have_count(0)
    expect(values).to_have_count(0)
    expect(shown.page.locator("hfsm-monitor-panel")).to_contain_text("Nothing runs yet.")
    show_document(shown, "guide")
    expect(status(shown)).to_have_text("Ended: stopped")
    expect(timeline).to_be_visible()
    expect(values).to_be_visible()

    show_document(shown, "walk")
    shown.state("go").locator(".body").click()
    shown.press("Alt+F5")
    expect_current(shown, "go")
    expect(shown.page.locator("hfsm-canvas .transition.fired")).to_have_count(0)
    lanes = shown.page.locator("main > hfsm-monitor-timeline").get_by_role("list", name="Automata")
    expect(lanes.get_by_role("listitem")).to_have_count(1)  # not the one below `wait`, which was not active


# ------------------------------------------------------------------------------------------------ steering


def test_breakpoints_pause_before_the_start_in_other_documents_and_after_a_restart(
    shown: EditorPage, path: Path
) -> None:
    path.with_name("other.xml").write_text(path.read_text())
    toggle_breakpoint(shown, "wait")
    expect_breakpoint(shown, "wait")
    shown.page.reload()
    expect_breakpoint(shown, "wait")  # the page keeps it
    shown.press("F5")
    expect(status(shown)).to_have_text("At a breakpoint")
    shown.press("Alt+l")
    expect(shown.page.get_by_role("textbox", name="count", exact=True)).to_have_value("0")  # before it ran
    shown.press("F8")
    expect(status(shown)).to_have_text("Running")

    toggle_breakpoint(shown, "go")
    expect_breakpoint(shown, "go")
    force_late(shown)
    expect(status(shown)).to_have_text("At a breakpoint")
    expect_breakpoint(shown, "go", "paused at this breakpoint")
    shown.press("F10")
    expect(status(shown)).to_have_text("Paused")
    shown.state("wait").locator(".body").click()
    shown.press("Control+Enter")  # into its sub-automaton, which is a ghost now
    shown.state("look").wait_for()
    shown.press("F10")
    notice(shown, re.compile(" does not run now: the state above it is not the current one"))
    shown.press("Backspace")
    shown.state("go").wait_for()
    shown.press("F8")
    expect(status(shown)).to_have_text("Running")

    shown.state("wait").locator(".body").click()
    shown.press("Control+Enter")  # into its sub-automaton
    shown.state("look").wait_for()
    open_document(shown, "other")
    shown.press("Alt+e")
    shown.page.get_by_label("Event", exact=True).fill("home")
    shown.button("Send").click()
    expect(status(shown)).to_have_text("At a breakpoint")
    expect(shown.page.locator(".live-bar").get_by_role("button", name="State wait")).to_be_visible()
    shown.page.get_by_role("tab", name=re.compile("walk"), selected=True).wait_for()
    expect(shown.page.locator("hfsm-status").get_by_text("State wait", exact=True)).to_be_visible()

    toggle_breakpoint(shown, "wait")
    expect(shown.state("wait")).not_to_have_attribute("aria-label", re.compile("breakpoint"))
    run_again(shown)
    expect_breakpoint(shown, "go")
    force_late(shown)
    expect(status(shown)).to_have_text("At a breakpoint")
    expect_breakpoint(shown, "go", "paused at this breakpoint")
    shown.press("F8")
    expect(status(shown)).to_have_text("Running")

    shown.state("go").locator(".body").click(button="right")
    shown.page.get_by_role("menuitem", name="Breakpoint with a condition").click()
    shown.page.get_by_role("textbox", name="Condition, in Python").fill("count < 0")
    shown.press("Enter")
    expect_breakpoint(shown, "go", "with a condition")
    send(shown, "home")
    expect_current(shown, "wait")
    force_late(shown)
    expect_current(shown, "go")
    expect(status(shown)).to_have_text("Running")


def test_a_key_that_steers_nothing_now_says_why(shown: EditorPage, robot: ServedRobot, path: Path) -> None:
    with started_elsewhere(robot, path):
        follow(shown, "walk")
        toggle_breakpoint(shown, "go")
        notice(shown, "Only watching")
        shown.button("Take control").click()
        toggle_breakpoint(shown, "go")
        expect_breakpoint(shown, "go")
        gone_on = """async () => {
          const entry = document.querySelector('script[src$="/app.js"]').src;
          const {past} = (await import(entry.replace('shell/app.js', 'run/monitor.js'))).monitor;
          return past.end - past.start > 1;
        }"""
        comes_true(shown, gone_on)  # what was just now counts as now
        shown.page.get_by_role("slider", name="Moment of the run").focus()
        shown.press("Home")
        expect(status(shown)).to_have_text("Looking back")
        toggle_breakpoint(shown, "wait")
        notice(shown, "Looking back")
        shown.button("Back to now").click()
        expect(status(shown)).to_have_text("Running")
    expect(status(shown)).to_contain_text("Gone since")
    shown.press("F8")
    notice(shown, "Gone since")


def test_reload_goes_on_with_the_changed_code_and_reports_what_was_not_kept(shown: EditorPage) -> None:
    run(shown)
    shown.state("wait").locator(".body").click()
    shown.press("Shift+Enter")
    expect(shown.page.get_by_role("textbox", name="Code of the state wait")).to_be_focused()
    shown.press("Control+End")
    expect(shown.button("Changed: reload")).to_have_count(0)
    shown.insert("\ncount += 2000000")
    expect(shown.button("Changed: reload")).to_be_visible()
    shown.press("F9")
    notice(shown, "Reloaded. States and timers were kept, as were variables that code had changed")
    expect(shown.button("Changed: reload")).to_have_count(0)
    expect_current(shown, "go")

    shown.state("go").locator(".body").click()
    shown.press("Delete")
    expect(shown.state("go")).to_have_count(0)
    shown.press("F9")
    notice(shown, "Reloaded: automaton 1 (walk) was in the state go, which is gone")
    expect(shown.page.get_by_role("dialog")).to_have_count(0)
    expect_current(shown, "wait")  # the initial state


def test_errors_of_a_start_and_of_a_run_lead_to_their_code(shown: EditorPage) -> None:
    shown.state("go").locator(".body").click()
    shown.press("Shift+Enter")
    code = shown.page.get_by_role("textbox", name="Code of the state go")
    expect(code).to_be_focused()
    shown.insert("if x y")
    shown.press("F5")
    notice(shown, re.compile("It is not ready: code of go \\(.*xml:[0-9]+\\): .*invalid syntax \\[E520\\]"))
    expect(shown.page.get_by_role("tab", name="Problems")).to_have_attribute("aria-selected", "true")
    expect(shown.page.get_by_role("button", name=re.compile("^error: .*invalid syntax"))).to_be_visible()
    expect(code).to_be_focused()  # one types on

    code.focus()
    shown.press("Control+a", "Delete")
    run(shown)
    shown.press("Alt+l")
    shown.page.get_by_role("textbox", name="count", exact=True).fill("null")
    shown.press("Enter")
    expect(status(shown)).to_contain_text("Ended: '>' not supported")
    spoken = shown.page.locator("hfsm-canvas [aria-live]")
    expect(spoken).to_contain_text("walk ended: '>' not supported")
    shown.page.get_by_role("tab", name=re.compile("^Errors")).click()
    error = shown.page.get_by_role("list", name="Errors of the behavior").get_by_role("button").first
    sign, message = error.get_by_role("img").bounding_box(), error.locator(".message").bounding_box()
    assert sign is not None
    assert message is not None
    assert message["y"] <= sign["y"] < message["y"] + message["height"], "the sign stands beside its message"
    error.click()
    expect(shown.page.get_by_label("Name of the transition")).to_have_value("many")


def test_a_component_started_elsewhere_is_watched_found_again_and_stopped(
    shown: EditorPage, robot: ServedRobot, path: Path
) -> None:
    steering = shown.page.get_by_role("switch", name="Only watching")
    canvas = shown.page.locator("hfsm-canvas")
    with started_elsewhere(robot, path) as process:
        follow(shown, "walk")
        expect(shown.button("Pause")).to_be_disabled()
        shown.press("F8")
        shown.page.get_by_role("button", name="Take control").click()
        shown.press("F8")
        expect(status(shown)).to_have_text("Paused")
        shown.press("F8")
        expect(status(shown)).to_have_text("Running")
        shown.button("Stop").click()
        assert process.wait() == 0
    expect(status(shown)).to_have_text("Ended: stopped")

    run(shown)
    shown.press("Shift+F5")
    expect(status(shown)).to_have_text("Ended: stopped")
    with started_elsewhere(robot, path):
        notice(shown, "Another run of walk has begun, which this window did not start")
        expect(steering).to_be_visible()
        shown.press("F8")
        expect(shown.button("Pause")).to_be_disabled()
        expect(status(shown)).to_have_text("Running")
    expect(status(shown)).to_contain_text("Gone since")
    expect(canvas).to_have_class(re.compile(r"\bstale\b"))

    stopped = shown.page.locator(".notice").filter(has_text="The robot stands still. Ended: walk.")
    for by_key in (True, False):
        with started_elsewhere(robot, path) as process:
            expect(status(shown)).to_have_text("Running")
            expect(canvas).not_to_have_class(re.compile(r"\bstale\b"))
            shown.press("F1")
            expect(shown.page.get_by_role("dialog")).to_be_visible()
            if by_key:
                shown.press("Control+Shift+Space")
            else:  # behind the dialog, which lets no element take the click
                shown.page.locator(".stop-button").click(force=True)
            assert process.wait() == 0
            expect(stopped).to_be_visible()
        expect(status(shown)).to_have_text("Ended: stopped by STOP")
        expect(canvas).not_to_have_class(re.compile(r"\b(stale|live)\b"))
        shown.press("Escape")
        stopped.get_by_role("button", name="Dismiss").click()


# ------------------------------------------------------------------------------------------------ time


def test_a_run_is_looked_back_at_recorded_and_played_on_the_document_that_it_had(
    shown: EditorPage, path: Path
) -> None:
    moment = shown.page.get_by_role("slider", name="Moment of the run")
    shown.press("Control+k")
    shown.type("pictures in rec")
    shown.press("Enter")
    shown.button("30").click()
    run(shown)
    shown.button("Record").click()
    expect(shown.button("End the recording")).to_contain_text(re.compile(r"0:0[1-9]|0:[1-5]\d|[1-9]:"))
    expect_current(shown, "wait")
    force_late(shown)
    expect_current(shown, "go")

    gone_on = """async () => {
      const entry = document.querySelector('script[src$="/app.js"]').src;
      const {past} = (await import(entry.replace('shell/app.js', 'run/monitor.js'))).monitor;
      return past.end - past.changes.at(-1).time > 1;
    }"""
    comes_true(shown, gone_on)  # what was just now counts as now
    moment.focus()
    shown.press("PageDown", "ArrowLeft", "ArrowLeft")
    expect(status(shown)).to_have_text("Looking back")
    expect_current(shown, "wait")
    expect(shown.button("Pause")).to_be_disabled()
    one_time = """() => {
      const [bar, cursor] = [".live-bar .time", "[role=slider] .cursor"].map((each) => document.querySelector(each));
      return bar.innerText.trim() === cursor.innerText.trim();
    }"""
    for _ in range(8):  # a step is shorter than what a moment lasts
        moment.focus()
        shown.press("ArrowLeft")
        comes_true(shown, one_time)
    shown.button("Back to now").click()
    expect(status(shown)).to_have_text("Running")
    expect_current(shown, "go")

    shown.button("End the recording").click()
    expect(shown.button("Record")).to_be_visible()
    shown.button("Play it").click()
    expect(status(shown)).to_have_text("Recording")
    expect_current(shown, "wait")
    moment.focus()
    shown.press("End")
    expect_current(shown, "go")
    (recording,) = (path.parent / "recordings").glob("walk-*.mcap")
    kinds = [message.topic for message in RecordingFile(recording).messages()]
    assert kinds.count("/images/Camera") > 10
    assert {"/snapshots", "/robot", "/actions"} <= set(kinds)

    show_document(shown, "walk")
    shown.state("go").click()
    shown.press("Delete")
    expect(shown.state("go")).to_have_count(0)
    shown.press("Alt+r")
    shown.page.get_by_role("option", name=f"recordings/{recording.name}").dblclick()
    expect(shown.page.get_by_role("tab", name=recording.name)).to_have_attribute("aria-selected", "true")
    expect(status(shown)).to_have_text("Recording")
    expect_current(shown, "wait")
    shown.state("go").click()
    shown.press("Delete")
    expect(shown.page.get_by_role("alert")).to_contain_text(f"{recording.name} cannot be changed")
    shown.button("Compare with walk.xml").click()
    legend = shown.page.get_by_role("region", name="Comparison")
    expect(legend).to_contain_text("Compared with walk.xml: 4 added")
    legend.get_by_role("button", name="Done").click()
    expect(shown.state("go")).to_be_visible()

    shown.press("Alt+l")
    shown.page.get_by_role("tab", name="Cameras").last.click()
    camera = shown.page.locator("hfsm-camera").filter(has_text="Top camera")
    moment.focus()
    shown.press("Home")
    expect(camera).to_be_visible()

    there = """async () => {
      const entry = document.querySelector('script[src$="/app.js"]').src;
      const {monitor} = await import(entry.replace('shell/app.js', 'run/monitor.js'));
      const {scrubbing} = await import(entry.replace('shell/app.js', 'run/scrubbing.js'));
      const {component} = await monitor.ask('moment', {time: scrubbing.time});
      return component.time === monitor.looking?.component.time;
    }"""

    def shows_the_mark_a_step_later() -> bool:
        shown.press("ArrowRight")
        comes_true(shown, there)  # or the next steps would go beyond all marks before one is shown
        return "red spot 80, 60" in camera.inner_text()

    eventually(shows_the_mark_a_step_later)  # on a busy machine the first picture came after the first cycles
    moment.focus()
    shown.press("End")
    expect_current(shown, "go")
    shown.button("STOP the robot and all that runs").click()  # the robot may move meanwhile
    expect(shown.page.get_by_role("alert").filter(has_text="The robot is stopped")).to_be_visible()

    shown.press("Control+k")
    with shown.page.expect_download() as found:
        shown.type("export as a page")
        shown.press("Enter")
    assert found.value.suggested_filename == f"{recording.stem}.html"
    exported, _ = content(found.value.path().read_text("utf-8"))
    assert exported["document"]["automata"][0]["states"][0]["name"] == "wait"
    expect(shown.page.locator(".notice", has_text=f"{recording.stem}.html was exported")).to_contain_text(
        "MB"
    )


def test_who_looks_on_follows_what_runs_and_all_but_the_window_that_stops_it_say_who_did(
    shown: EditorPage, followed: Editor, browser: Browser
) -> None:
    address = shared_address(shown)
    with contextlib.ExitStack() as opened:

        def viewer_in(language: str | None) -> EditorPage:
            context = opened.enter_context(contextlib.closing(new_context(browser, language)))
            viewer = EditorPage(context.new_page(), followed, address)
            viewer.page.locator("hfsm-canvas .state").first.wait_for()
            return viewer

        other = opened.enter_context(monitor_page(browser, followed))
        viewer = viewer_in(None)
        expect(viewer.page.get_by_text("You look on")).to_be_visible()
        run(shown)
        phone = viewer_in("es")  # who comes late follows, too
        phone.resize(390, 844)

        def expect_running() -> None:
            follow(other, "walk")
            expect(status(viewer)).to_have_text("Running")
            expect(status(phone)).to_have_text("En marcha")

        def expect_ends(*ends: str) -> None:
            for each, end in zip((shown, other, viewer, phone), ends, strict=True):
                expect(status(each)).to_have_text(end)

        expect_running()
        shown.button("Stop").click()
        elsewhere = "Ended: stopped in another window"
        expect_ends("Ended: stopped", elsewhere, elsewhere, "Terminado: detenido en otra ventana")
        run(shown)
        expect_running()
        phone.button("STOP: parar el robot y todo lo que se ejecuta").click()
        by_a_viewer = "Ended: stopped by a viewer"
        expect_ends(*[by_a_viewer] * 3, "Terminado: parado con STOP")
        other.press("Alt+o")
        expect(other.page.locator("hfsm-output")).to_contain_text(by_a_viewer)
