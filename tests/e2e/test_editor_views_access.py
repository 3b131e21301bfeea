"""Every view of the page: nothing that axe finds, and nothing too small to be pressed.

Axe looks at most views in the tests of what they show; `make soak` looks at the whole page with each, in both themes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from importlib.util import find_spec

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage
from tests.support.monitor import monitor_page, robot_and_editor, run
from tests.support.soak import SOAKS, cases
from tests.support.targets import small_targets


@pytest.fixture(scope="module")
def live(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[EditorPage]:
    """A component that runs on a robot."""
    path = tmp_path_factory.mktemp("views") / "walk.xml"
    with robot_and_editor(path) as (_, running), monitor_page(browser, running) as shown:
        run(shown)
        shown.page.emulate_media(reduced_motion="reduce")  # axe would look at colors while they fade
        yield shown
        shown.page.emulate_media(reduced_motion="null")


def panel(tag: str) -> Callable[[EditorPage], None]:
    side = {"hfsm-code-panel", "hfsm-data-panel"}

    def show(shown: EditorPage) -> None:
        method = "showSide" if tag in side else "showBottom"
        shown.page.evaluate(f"tag => document.querySelector('hfsm-app').{method}(tag)", tag)
        shown.page.locator(tag).wait_for()

    return show


def live_tab(name: str) -> Callable[[EditorPage], None]:
    def show(shown: EditorPage) -> None:
        shown.page.evaluate("name => document.querySelector('hfsm-app').showLive(name)", name)
        expect(shown.page.locator(f"#live-tab-{name}")).to_have_attribute("aria-selected", "true")
        expect(shown.page.locator("#live-panel > *")).to_be_visible()

    return show


def keys(*pressed: str, role: str = "dialog") -> Callable[[EditorPage], None]:
    def show(shown: EditorPage) -> None:
        shown.state("go").focus()
        shown.press(*pressed)
        shown.page.get_by_role(role).first.wait_for()  # type: ignore[arg-type]

    return show


def menu(name: str) -> Callable[[EditorPage], None]:
    def show(shown: EditorPage) -> None:
        shown.page.locator("hfsm-menubar, hfsm-tools").get_by_text(name, exact=True).click()
        shown.page.get_by_role("menu").wait_for()

    return show


def code(shown: EditorPage) -> None:
    shown.state("wait").click()
    shown.edit_code()
    shown.page.get_by_role("textbox", name="Code of the state wait").wait_for()


def arc(shown: EditorPage) -> None:
    shown.transition("late").focus()
    shown.edit_code()
    shown.page.get_by_role("radio", name="Time").wait_for()


def found(shown: EditorPage) -> None:
    shown.press("Control+f")
    shown.page.get_by_role("searchbox").fill("count")
    shown.page.get_by_role("list", name="Found").wait_for()


def context_menu(shown: EditorPage) -> None:
    shown.state("go").click(button="right")
    shown.page.get_by_role("menu").wait_for()


def run_menu(shown: EditorPage) -> None:
    shown.button("Other ways to run").click()
    shown.page.get_by_role("menu").wait_for()


def robot(shown: EditorPage) -> None:
    shown.button("See the robot").click()
    expect(shown.page.locator(".dock canvas")).to_be_visible()


def why_not(shown: EditorPage) -> None:
    shown.state("wait").focus()
    shown.press("w")
    shown.page.get_by_role("tooltip").wait_for()


def shelf(shown: EditorPage) -> None:
    shown.state("go").focus()
    shown.press("a")
    shown.page.get_by_role("combobox", name="Search the shelf").wait_for()


def start(shown: EditorPage) -> None:
    shown.button("Start page").click()
    shown.page.get_by_role("heading", name="Draw what your robot does").wait_for()


VIEWS: dict[str, Callable[[EditorPage], None]] = {
    "code": code,
    "transition": arc,
    "data": panel("hfsm-data-panel"),
    **{
        f"live {name}": live_tab(name)
        for name in ("variables", "plots", "cameras", "view", "cycles", "errors")
    },
    "problems": panel("hfsm-problems"),
    "search": found,
    "output": panel("hfsm-output"),
    "tests": panel("hfsm-tests-panel"),
    **({"trials": panel("hfsm-trials-panel")} if find_spec("visualhfsm_trials") else {}),
    "undo steps": panel("hfsm-undo-steps"),
    "timeline": panel("hfsm-monitor-timeline"),
    "shelf": shelf,
    "robot on the canvas": robot,
    "why not": why_not,
    "open": keys("Control+o"),
    "save as": keys("Control+Shift+S"),
    "export": keys("Control+e"),
    "actions": keys("Control+k"),
    "help": keys("?"),
    "send an event": keys("Alt+e"),
    "parameters": keys("Alt+Shift+F5"),
    "breakpoint": keys("Shift+b"),
    "robot": keys("Alt+b"),
    "menu of a state": context_menu,
    "menu of runs": run_menu,
    "menu of files": menu("File"),
    "menu of actions": menu("Actions"),
    "start page": start,
}


WHOLE = ("code", "why not", "start page")
"""Views with which the whole page is looked at, in both themes."""
PARTS = (
    "dialog[open]",
    "[role=menu]",
    "[role=tooltip]",
    ".side",
    ".bottom",
    ".dock",
    "hfsm-shelf",
    "hfsm-app > .menu",
)
"""What the other views show."""
HERE_ALONE = (*WHOLE, "undo steps", "send an event", "breakpoint")
"""Views that no other test in `make test` lets axe look at."""


@pytest.fixture
def closed(live: EditorPage) -> Iterator[EditorPage]:
    """The page whose views are closed after the test."""
    yield live
    close(live)


def close(shown: EditorPage) -> None:
    """Show nothing but the drawing."""
    shown.press("Escape", "Escape")
    shown.page.get_by_role("tab", name=re.compile("^walk")).click()
    shown.page.evaluate("document.querySelector('hfsm-app').showSide('')")
    shown.page.evaluate("document.querySelector('hfsm-app').showBottom('')")
    shown.state("go").wait_for()


@pytest.mark.parametrize("view", cases(HERE_ALONE, [each for each in VIEWS if each not in HERE_ALONE]))
def test_a_view_is_accessible(closed: EditorPage, view: str) -> None:
    VIEWS[view](closed)
    if SOAKS or view in WHOLE:
        assert closed.violations(in_both_themes=True) == []
    else:
        assert closed.violations(", ".join(PARTS)) == []


def test_everything_in_a_view_is_large_enough_to_press(closed: EditorPage) -> None:
    found = {}
    for view, show in VIEWS.items():
        show(closed)
        found[view] = small_targets(closed.page)
        close(closed)
    assert {view: small for view, small in found.items() if small} == {}


def test_at_200_percent_everything_is_reached_without_scrolling_sideways(live: EditorPage) -> None:
    live.resize(640, 400)  # what is left of 1280 by 800
    try:
        live.state("go").focus()
        for show in (code, panel("hfsm-problems"), panel("hfsm-data-panel"), live_tab("variables"), start):
            live.page.evaluate("document.querySelector('hfsm-app').showBottom('')")
            show(live)
            assert live.page.evaluate("document.documentElement.scrollWidth") <= 640
            expect(live.page.get_by_role("button", name="STOP the robot")).to_be_in_viewport(ratio=1)
            assert live.violations() == []
            assert small_targets(live.page, drawn=False) == []  # the canvas zooms
    finally:
        live.resize(1280, 800)
        live.page.get_by_role("tab", name=re.compile("^walk")).click()


def test_nothing_moves_for_those_who_want_less_motion(live: EditorPage) -> None:
    page = live.page
    page.emulate_media(reduced_motion="no-preference")
    moving = """() => document.getAnimations().length || [...document.querySelectorAll("*")].some((each) =>
      ["", "::before", "::after"].some((part) => {
        const {animationName, transitionDuration} = getComputedStyle(each, part);
        return animationName !== "none" || !/^(0s(, )?)+$/.test(transitionDuration);
      }))"""
    page.evaluate(
        "document.body.append(Object.assign(document.createElement('i'), {style: 'transition: opacity 1s'}))"
    )
    assert page.evaluate(moving), "something moves otherwise"
    page.emulate_media(reduced_motion="reduce")
    assert not page.evaluate(moving)
    page.evaluate("document.body.lastElementChild.remove()")
