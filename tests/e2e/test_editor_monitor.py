"""Run, follow and steer components from the editor's page: real components, a fake robot, Chromium."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from hfsm_recording.reader import RecordingFile
from tests.support.browser import EditorPage
from tests.support.editor import Editor
from tests.support.monitor import (
    comes_true,
    expect_current,
    follow,
    monitor_page,
    robot_and_editor,
    run,
    run_again,
    started_elsewhere,
    status,
)
from tests.support.robot_server import ServedRobot, eventually
from tests.support.watching import content


@pytest.fixture
def path(tmp_path: Path) -> Path:
    root = tmp_path / "root"
    root.mkdir()
    return root / "walk.xml"


@pytest.fixture
def served(path: Path) -> Iterator[tuple[ServedRobot, Editor]]:
    with robot_and_editor(path) as served:
        yield served


@pytest.fixture
def robot(served: tuple[ServedRobot, Editor]) -> ServedRobot:
    return served[0]


@pytest.fixture
def shown(browser: Browser, served: tuple[ServedRobot, Editor]) -> Iterator[EditorPage]:
    with monitor_page(browser, served[1]) as shown:
        yield shown


def notice(shown: EditorPage, text: str) -> None:
    """Wait for a message."""
    expect(shown.page.locator(".notice").filter(has_text=text)).to_be_visible()


# ------------------------------------------------------------------------------------------------ canvas


def test_f5_runs_the_component_and_shows_what_it_does(shown: EditorPage) -> None:
    run(shown)
    expect_current(shown, "wait")
    expect(shown.transition("late")).to_have_class(re.compile(r"\bwaiting\b"))
    expect(shown.transition("many")).to_have_attribute("aria-label", re.compile("condition false"))
    shown.state("wait").focus()
    shown.press("Control+Enter")
    expect_current(shown, "look")


def test_forced_transition_is_fired_and_leaves_a_trail_and_a_ghost(shown: EditorPage) -> None:
    run(shown)
    shown.transition("late").locator(".handle").click()
    shown.press("Alt+Enter")
    expect_current(shown, "go")
    expect(shown.state("wait")).to_have_class(re.compile(r"\btrail\b"))
    expect(shown.transition("late")).to_have_class(re.compile(r"\bfired\b"))
    shown.state("wait").focus()
    shown.press("Control+Enter")
    expect(shown.state("look")).to_have_class(re.compile(r"\bghost\b"))


def test_finished_automaton_is_marked(shown: EditorPage) -> None:
    run(shown)
    shown.press("Alt+e")
    shown.page.get_by_label("Event", exact=True).fill("ball")
    shown.press("Enter")
    notice(shown, "Sent ball.")
    shown.state("wait").focus()
    shown.press("Control+Enter")
    expect_current(shown, "found", "finished")


def test_component_is_started_from_the_selected_state(shown: EditorPage) -> None:
    shown.state("go").locator(".body").click()
    shown.press("Alt+F5")
    expect_current(shown, "go")
    expect(shown.page.locator(".transition.fired")).to_have_count(0)


def test_imported_automaton_is_followed_where_it_is_imported(shown: EditorPage, path: Path) -> None:
    stub = '<SubAutomata id="2" idFather="1"><import automaton="2">walk.xml</import></SubAutomata>'
    document = path.read_text()
    kept = document[: document.index('<SubAutomata id="2"')]
    path.with_name("guide.xml").write_text(f"{kept}{stub}</VisualHFSM>")
    shown.press("Control+o")
    shown.page.get_by_role("option", name="guide.xml").dblclick()
    shown.page.get_by_role("tab", name=re.compile("guide"), selected=True).wait_for()
    run(shown)
    shown.state("wait").focus()
    shown.press("Control+Enter")
    expect_current(shown, "look")
    expect(shown.page.locator("hfsm-status")).to_contain_text("from walk.xml")


def test_why_not_is_shown_for_pointer_and_key(shown: EditorPage) -> None:
    run(shown)
    shown.state("wait").locator(".body").hover()
    tooltip = shown.page.get_by_role("tooltip")
    expect(tooltip).to_contain_text("many")
    shown.page.mouse.move(5, 5)
    expect(tooltip).to_have_count(0)
    shown.transition("late").focus()
    shown.press("w")
    expect(tooltip).to_contain_text("its time comes after")
    shown.press("Escape")
    expect(tooltip).to_have_count(0)


def test_tree_shows_what_is_current_and_what_is_a_ghost(shown: EditorPage) -> None:
    run(shown)
    rows = shown.page.get_by_role("treeitem")
    expect(rows.filter(has_text="look")).to_have_attribute("data-live", "active")
    shown.transition("late").locator(".handle").click()
    shown.press("Alt+Enter")
    expect(rows.filter(has_text="go")).to_have_attribute("aria-current", "true")
    expect(rows.filter(has_text="look")).to_have_attribute("data-live", "ghost")


def test_sub_automaton_is_opened_as_it_becomes_active(shown: EditorPage) -> None:
    run(shown)
    shown.press("g")
    expect_current(shown, "look")
    shown.press("g", "Backspace")
    expect_current(shown, "wait")


def test_lost_component_is_grey_with_its_time_and_found_again(
    shown: EditorPage, robot: ServedRobot, path: Path
) -> None:
    with started_elsewhere(robot, path):
        follow(shown, "walk")
    expect(status(shown)).to_contain_text("Gone since")
    expect(shown.page.locator("hfsm-canvas")).to_have_class(re.compile(r"\bstale\b"))
    with started_elsewhere(robot, path):
        expect(status(shown)).to_have_text("Running")
        expect(shown.page.locator("hfsm-canvas")).not_to_have_class(re.compile(r"\bstale\b"))


# ------------------------------------------------------------------------------------------------ steering


def test_component_started_elsewhere_is_only_watched_by_default(
    shown: EditorPage, robot: ServedRobot, path: Path
) -> None:
    with started_elsewhere(robot, path) as process:
        follow(shown, "walk")
        expect(shown.button("Pause")).to_be_disabled()
        shown.press("F8")
        shown.page.get_by_role("switch", name="Only watching").click()
        shown.press("F8")
        expect(status(shown)).to_have_text("Paused")
        shown.press("F8")
        expect(status(shown)).to_have_text("Running")
        shown.button("Stop").click()
        assert process.wait() == 0
    expect(status(shown)).to_have_text("Ended: stopped")


def test_a_run_that_this_window_did_not_start_is_only_watched(
    shown: EditorPage, robot: ServedRobot, path: Path
) -> None:
    run(shown)
    shown.press("Shift+F5")
    expect(status(shown)).to_have_text("Ended: stopped")
    with started_elsewhere(robot, path):
        notice(shown, "Another run of walk has begun, which this window did not start")
        expect(shown.page.get_by_role("switch", name="Only watching")).to_be_visible()
        shown.press("F8")
        expect(shown.button("Pause")).to_be_disabled()
        expect(status(shown)).to_have_text("Running")


def test_the_output_says_when_the_component_is_paused(shown: EditorPage) -> None:
    run(shown)
    shown.press("Alt+o")
    output = shown.page.locator("hfsm-output").get_by_role("status")
    expect(output).to_have_text("Running")
    shown.press("F8")
    expect(output).to_have_text("Paused")
    shown.press("F8")
    expect(output).to_have_text("Running")


def test_breakpoint_pauses_and_the_component_is_stepped_on(shown: EditorPage) -> None:
    run(shown)
    shown.state("go").locator(".body").click()
    shown.press("b")
    expect(shown.state("go")).to_have_attribute("aria-label", re.compile("breakpoint"))
    shown.transition("late").locator(".handle").click()
    shown.press("Alt+Enter")
    expect(status(shown)).to_have_text("At a breakpoint")
    expect(shown.state("go")).to_have_attribute("aria-label", re.compile("paused at this breakpoint"))
    shown.press("F10")
    expect(status(shown)).to_have_text("Paused")
    shown.press("F8")
    expect(status(shown)).to_have_text("Running")


def test_breakpoint_in_another_document_is_gone_to(shown: EditorPage, path: Path) -> None:
    path.with_name("other.xml").write_text(path.read_text())
    run(shown)
    shown.transition("late").locator(".handle").click()
    shown.press("Alt+Enter")
    expect_current(shown, "go")
    shown.state("wait").locator(".body").click()
    shown.press("b")
    expect(shown.state("wait")).to_have_attribute("aria-label", re.compile("breakpoint"))
    shown.press("Control+Enter")  # into its sub-automaton
    shown.state("look").wait_for()
    shown.press("Control+o")
    shown.page.get_by_role("option", name="other.xml").dblclick()
    shown.page.get_by_role("tab", name=re.compile("other"), selected=True).wait_for()
    shown.press("Alt+e")
    shown.page.get_by_label("Event", exact=True).fill("home")
    shown.button("Send").click()
    expect(status(shown)).to_have_text("At a breakpoint")
    expect(shown.page.locator(".live-bar").get_by_role("button", name="State wait")).to_be_visible()
    shown.page.get_by_role("tab", name=re.compile("walk"), selected=True).wait_for()
    expect(shown.page.locator("hfsm-status").get_by_text("State wait", exact=True)).to_be_visible()


def test_the_end_of_a_run_is_shown_beside_its_own_document_alone(shown: EditorPage, path: Path) -> None:
    path.with_name("other.xml").write_text(path.read_text())
    timeline = shown.page.get_by_role("slider", name="Moment of the run")
    run(shown)
    shown.press("Control+o")
    shown.page.get_by_role("option", name="other.xml").dblclick()
    expect(shown.button("Show walk.xml")).to_be_visible()
    shown.button("Stop").click()
    expect(status(shown)).to_have_count(0)
    expect(timeline).to_have_count(0)
    shown.page.get_by_role("tab", name=re.compile("walk")).first.click()
    expect(status(shown)).to_have_text("Ended: stopped")
    expect(timeline).to_be_visible()


def test_breakpoint_is_kept_when_the_component_is_restarted(shown: EditorPage) -> None:
    run(shown)
    shown.state("go").locator(".body").click()
    shown.press("b")
    expect(shown.state("go")).to_have_attribute("aria-label", re.compile("breakpoint"))
    run_again(shown)
    expect(shown.state("go")).to_have_attribute("aria-label", re.compile("breakpoint"))
    shown.transition("late").locator(".handle").click()
    shown.press("Alt+Enter")
    expect(status(shown)).to_have_text("At a breakpoint")


def test_breakpoint_is_set_before_the_start_and_kept_by_the_page(shown: EditorPage) -> None:
    shown.state("wait").locator(".body").click()
    shown.press("b")
    expect(shown.state("wait")).to_have_attribute("aria-label", re.compile("breakpoint"))
    shown.page.reload()
    expect(shown.state("wait")).to_have_attribute("aria-label", re.compile("breakpoint"))
    shown.press("F5")
    expect(status(shown)).to_have_text("At a breakpoint")
    shown.press("Alt+l")
    expect(shown.page.get_by_role("textbox", name="count", exact=True)).to_have_value("0")  # before it ran


def test_condition_of_a_breakpoint_counts(shown: EditorPage) -> None:
    run(shown)
    shown.state("go").locator(".body").click(button="right")
    shown.page.get_by_role("menuitem", name="Breakpoint with a condition").click()
    shown.page.get_by_role("textbox").filter(visible=True).last.fill("count < 0")
    shown.press("Enter")
    expect(shown.state("go")).to_have_attribute("aria-label", re.compile("with a condition"))
    shown.transition("late").locator(".handle").click()
    shown.press("Alt+Enter")
    expect_current(shown, "go")
    expect(status(shown)).to_have_text("Running")


def test_variable_and_parameter_are_set(shown: EditorPage) -> None:
    run(shown)
    shown.press("Alt+l")
    for name, value, text in (("count", "2000000", "2000000"), ("speed", "0.5", "0.5")):
        shown.page.get_by_role("textbox", name=name, exact=True).fill(value)
        shown.press("Enter")
        notice(shown, f"Set {name} to {text}.")
    expect_current(shown, "go")


def test_reload_goes_on_with_the_changed_code(shown: EditorPage) -> None:
    run(shown)
    shown.state("wait").locator(".body").click()
    shown.press("Shift+Enter")
    expect(shown.page.get_by_role("textbox", name="Code of the state wait")).to_be_focused()
    shown.press("Control+End")
    expect(shown.button("Changed: reload")).to_have_count(0)
    shown.type("\ncount += 2000000")
    expect(shown.button("Changed: reload")).to_be_visible()
    shown.press("F9")
    notice(shown, "Reloaded.")
    expect(shown.button("Changed: reload")).to_have_count(0)
    expect_current(shown, "go")


def test_reload_reports_what_was_not_kept(shown: EditorPage) -> None:
    run(shown)
    expect_current(shown, "wait")
    shown.state("go").locator(".body").click()
    shown.press("i")
    expect(shown.state("go")).to_have_attribute("aria-label", re.compile("initial"))
    shown.state("wait").locator(".body").click()
    shown.press("Delete")
    expect(shown.state("wait")).to_have_count(0)
    shown.press("F9")
    expect(shown.page.get_by_role("dialog")).to_contain_text("wait")
    shown.press("Escape")
    expect_current(shown, "go")


def test_a_run_that_is_refused_leads_to_the_errors(shown: EditorPage) -> None:
    shown.state("go").locator(".body").click()
    shown.press("Shift+Enter")
    expect(shown.page.get_by_role("textbox", name="Code of the state go")).to_be_focused()
    shown.type("if x y")
    shown.press("F5")
    notice(shown, "nothing was generated")
    expect(shown.page.get_by_role("tab", name="Problems")).to_have_attribute("aria-selected", "true")
    expect(shown.page.get_by_role("list", name="Problems")).to_contain_text("invalid syntax")


@pytest.mark.parametrize("key", [True, False], ids=["key", "button"])
def test_stop_ends_the_component_even_while_only_watching_it(
    shown: EditorPage, robot: ServedRobot, path: Path, key: bool
) -> None:
    with started_elsewhere(robot, path) as process:
        follow(shown, "walk")
        shown.press("F1")
        expect(shown.page.get_by_role("dialog")).to_be_visible()
        if key:
            shown.press("Control+Shift+Space")
        else:  # behind the dialog, which lets no element take the click
            shown.page.locator(".stop-button").click(force=True)
        assert process.wait() == 0
        notice(shown, "Stopped: Body, Head, Motors, walk.")
    expect(status(shown)).to_have_text("Ended: stopped by STOP")
    expect(shown.page.locator("hfsm-canvas")).not_to_have_class(re.compile(r"\b(stale|live)\b"))


def test_error_leads_to_the_code_that_failed(shown: EditorPage) -> None:
    run(shown)
    shown.press("Alt+l")
    shown.page.get_by_role("textbox", name="count", exact=True).fill("null")
    shown.press("Enter")
    expect(status(shown)).to_have_text("Ended with exit code 1 after an error")
    notice(shown, "TypeError: '>' not supported")
    shown.page.get_by_role("tab", name=re.compile("^Errors")).click()
    shown.page.get_by_role("list", name="Errors of the component").get_by_role("button").first.click()
    expect(shown.page.get_by_label("Name of the transition")).to_have_value("many")


# ------------------------------------------------------------------------------------------------ time


def test_timeline_goes_back_through_the_run_and_to_now(shown: EditorPage) -> None:
    run(shown)
    expect_current(shown, "wait")
    shown.transition("late").locator(".handle").click()
    shown.press("Alt+Enter")
    expect_current(shown, "go")
    gone_on = """async () => {
      const entry = document.querySelector('script[src$="/app.js"]').src;
      const {past} = (await import(entry.replace('app.js', 'monitor/monitor.js'))).monitor;
      return past.end - past.changes.at(-1).time > 1;
    }"""
    comes_true(shown, gone_on)  # what was just now counts as now
    shown.page.get_by_role("slider", name="Moment of the run").focus()
    shown.press("PageDown", "ArrowLeft", "ArrowLeft")
    expect(status(shown)).to_have_text("Looking back")
    expect_current(shown, "wait")
    expect(shown.button("Pause")).to_be_disabled()
    shown.button("Back to now").click()
    expect(status(shown)).to_have_text("Running")
    expect_current(shown, "go")


def test_a_part_of_a_run_is_recorded_with_pictures_and_played(shown: EditorPage, path: Path) -> None:
    shown.press("Control+k")
    shown.type("pictures in rec")
    shown.press("Enter")
    shown.button("30").click()
    run(shown)
    shown.button("Record").click()
    expect(shown.button("End the recording")).to_contain_text("0:01")
    shown.transition("late").locator(".handle").click()
    shown.press("Alt+Enter")
    expect_current(shown, "go")
    shown.button("End the recording").click()
    expect(shown.button("Record")).to_be_visible()
    shown.button("Play it").click()
    expect(status(shown)).to_have_text("Recording")
    expect_current(shown, "wait")
    shown.page.get_by_role("slider", name="Moment of the run").focus()
    shown.press("End")
    expect_current(shown, "go")
    (recording,) = (path.parent / "recordings").glob("walk-*.mcap")
    kinds = [message.topic for message in RecordingFile(recording).messages()]
    assert kinds.count("/images/Camera") > 10
    assert {"/snapshots", "/robot", "/actions"} <= set(kinds)


def test_recording_is_played_on_the_document_that_it_contains(
    shown: EditorPage, robot: ServedRobot, path: Path
) -> None:
    with started_elsewhere(robot, path, "--record", str(path.with_name("walk.mcap"))):
        follow(shown, "walk")
        shown.page.get_by_role("switch").click()
        shown.transition("late").locator(".handle").click()
        shown.press("Alt+Enter")
        expect_current(shown, "go")
    expect(status(shown)).to_contain_text("Gone since")
    shown.state("go").click()
    shown.press("Delete")
    expect(shown.state("go")).to_have_count(0)
    shown.press("Alt+r")
    shown.page.get_by_role("option", name="walk.mcap").dblclick()
    expect(status(shown)).to_have_text("Recording")
    expect(shown.page.get_by_role("tab", name="walk.mcap")).to_have_attribute("aria-selected", "true")
    expect_current(shown, "wait")
    shown.state("go").click()
    shown.press("Delete")
    expect(shown.page.get_by_role("alert")).to_contain_text("walk.mcap cannot be changed")
    shown.button("Compare with walk.xml").click()
    legend = shown.page.get_by_role("region", name="Comparison")
    expect(legend).to_contain_text("Compared with walk.xml: 4 added")
    legend.get_by_role("button", name="Done").click()
    expect(shown.state("go")).to_be_visible()
    shown.press("Alt+l")
    shown.page.get_by_role("tab", name="Cameras").last.click()
    camera = shown.page.locator("hfsm-camera")
    shown.page.get_by_role("slider", name="Moment of the run").focus()
    shown.press("Home")
    expect(camera).to_be_visible()

    def shows_the_mark_a_step_later() -> bool:
        shown.press("ArrowRight")
        return "red spot 80, 60" in camera.inner_text()

    eventually(shows_the_mark_a_step_later)  # on a busy machine the first picture came after the first cycles
    shown.page.get_by_role("slider", name="Moment of the run").focus()
    shown.press("End")
    expect_current(shown, "go")
    shown.button("STOP the robot and all that runs").click()  # the robot may move meanwhile
    expect(shown.page.get_by_role("alert").filter(has_text="The robot is stopped")).to_be_visible()

    shown.press("Control+k")
    with shown.page.expect_download() as found:
        shown.page.keyboard.type("export as a page")
        shown.press("Enter")
    assert found.value.suggested_filename == "walk.html"
    exported, _ = content(found.value.path().read_text("utf-8"))
    assert exported["document"]["automata"][0]["states"][0]["name"] == "wait"
    expect(shown.page.locator(".notice", has_text="walk.html was exported")).to_contain_text("MB")
