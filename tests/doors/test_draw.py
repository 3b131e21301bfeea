"""Draw: a behavior from nothing, and the documents of others."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, chromium
from tests.support.editor import shared_checks
from tests.support.expecting import awaited_elements
from tests.support.pages import DOCS, blocks_of
from tests.support.panels import add, show_list
from tests.support.plugins import needs
from tests.support.screenshots import picture
from tests.support.tutorial import page_of_a_reader, start_simulation
from visualhfsm import Project

pytest_plugins = "pytester"

PAGE = (DOCS / "tutorial/first-behavior.md").read_text("utf-8")
CODE = [block.text.strip() for block in blocks_of(PAGE) if block.language == "python"]
LEFT, RIGHT, THERE, MISSPELT, DIVIDED, TEST = CODE


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Chromium, whose driver runs an event loop in this thread: it ends before other doors run one."""
    with chromium() as browser, shared_checks(), awaited_elements():
        yield browser


@pytest.mark.gl
@pytest.mark.promise("automata in automata, with completion and checks while you type")
@pytest.mark.promise("states, timers, cameras and the robot in 3D")
@pytest.mark.promise("your first behavior in 20 minutes")
def test_the_first_behavior_is_drawn_run_broken_fixed_and_tested(
    browser: Browser, tmp_path: Path, pytester: pytest.Pytester
) -> None:
    with page_of_a_reader(browser, tmp_path) as shown:
        draw(shown)
        shown.press("Control+s")
        expect(shown.page.get_by_role("dialog").get_by_label("Name")).to_be_focused()
        shown.press("Control+a")
        shown.type("look_around.xml")
        shown.press("Enter")
        expect(shown.page.get_by_role("status").filter(has_text="Saved")).to_be_visible()

        # Later than on the page, and ended before the test runs: the simulation computes at all times.
        start_simulation(shown)
        watch(shown)
        break_and_fix(shown)
        shown.press("Shift+F5", "Control+s")
        expect(shown.page.locator(".live-status")).to_contain_text("Ended")
        expect(shown.page.locator(".dirty")).to_have_count(0)

    shutil.copy(tmp_path / "look_around.xml", pytester.path)
    pytester.makepyfile(test_look_around=TEST)
    pytester.runpytest_inprocess("-p", "no:cacheprovider", "-p", "no:anyio").assert_outcomes(passed=1)


def draw(shown: EditorPage) -> None:
    shown.page.get_by_role("button", name="Empty").click()
    expect(shown.page.locator("hfsm-canvas .empty")).to_be_visible()
    show_list(shown, "Alt+i", "interface")
    add(shown, "interface", "Head").get_by_label("Interface", exact=True).fill("PoseHead")
    expect(shown.page.get_by_text("5 operations of PoseHead")).to_be_visible()
    picture(shown.page, "interface", "tutorial")
    shown.press("Escape")

    box = shown.page.locator("hfsm-canvas").bounding_box()
    assert box is not None
    for name, part in (("left", 0.25), ("right", 0.75)):
        shown.page.mouse.dblclick(box["x"] + part * box["width"], box["y"] + 0.5 * box["height"])
        shown.name(name)
        expect(shown.state(name)).to_have_count(1)
    shown.connect("left", "right")
    shown.name("two seconds")
    shown.edit_code()
    shown.choose("Time")
    shown.page.get_by_label("After", exact=True).fill("2 s")
    shown.press("Escape")
    shown.connect("right", "left")
    shown.name("there")
    shown.edit_code()
    write(shown, "Condition of there", THERE, shown.type)
    shown.press("Escape")
    for name, code in (("right", RIGHT), ("left", LEFT)):
        select(shown, name)
        write(shown, f"Code of the state {name}", code)
    expect(shown.page.get_by_text("Edit the code of “left”")).to_be_visible()
    expect(shown.page.get_by_text("No problems")).to_be_visible()
    picture(shown.page, "drawn", "tutorial")


def select(shown: EditorPage, state: str) -> None:
    shown.state(state).locator(".body").click()
    shown.press("Shift+Enter")
    expect(shown.page.get_by_role("textbox", name=f"Code of the state {state}")).to_be_focused()


def write(shown: EditorPage, label: str, text: str, enter: Callable[[str], None] | None = None) -> None:
    """Write into a code field, at once, which takes much less work than to type it."""
    field = shown.page.get_by_role("textbox", name=label, exact=True)
    field.click()
    shown.press("Control+a")
    (enter or shown.insert)(text)
    expect(field).to_have_text(text)


def watch(shown: EditorPage) -> None:
    shown.press("F5")
    active = shown.page.locator(".active")
    expect(shown.state("right").and_(active)).to_be_visible()
    shown.show_robot()
    expect(shown.state("left").and_(active)).to_be_visible()
    picture(shown.page, "running", "tutorial", after=1000)
    shown.button("Fold the robot's picture").click()  # drawing it takes more than all else


def break_and_fix(shown: EditorPage) -> None:
    select(shown, "left")
    write(shown, "Code of the state left", MISSPELT)
    expect(shown.page.get_by_text("1 warning")).to_be_visible()
    shown.press("Control+m")
    expect(shown.page.locator("hfsm-problems :focus")).to_have_count(1)  # later it would take the focus back
    expect(shown.page.get_by_text("setPosse").last).to_be_visible()
    picture(shown.page, "misspelt", "tutorial")

    select(shown, "left")
    write(shown, "Code of the state left", DIVIDED)
    shown.press("Alt+v")
    write(shown, "Variables", "slower = 0")
    shown.press("F9")
    status = shown.page.locator(".live-status")
    expect(status).to_have_text("Ended: float division by zero in left")
    shown.page.locator(".live-bar").get_by_role("button", name="line 1").click()
    expect(shown.page.get_by_text("ZeroDivisionError: float division by zero").last).to_be_visible()
    shown.press("Control+m")  # closes the list of problems
    picture(shown.page, "error", "tutorial")

    shown.press("Alt+v")
    write(shown, "Variables", "slower = 2")
    shown.press("F5")
    expect(shown.state("right").and_(shown.page.locator(".active"))).to_be_visible()


@needs("visualhfsm_old_documents")
@pytest.mark.promise("Documents of VisualHFSM (2013) and of VisualStates open as they are")
def test_documents_of_2013_and_of_visualstates_open_as_they_are(tmp_path: Path) -> None:
    from plugins.old_documents.tests.support.old_dialects import SPANISH, VISUALSTATES

    states = {"spanish": (SPANISH, "buscar pelota"), "visualstates": (VISUALSTATES, "search")}
    for name, (text, first) in states.items():
        (tmp_path / f"{name}.xml").write_text(text, "utf-8")
        with Project(tmp_path) as project:
            opened = project.open(f"{name}.xml")
            root, *_ = opened.automata
            assert root.states[0].name == first
            assert root.transitions
        assert (tmp_path / f"{name}.xml").read_text("utf-8") == text
