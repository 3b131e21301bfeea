"""What the editor's page shows next to the canvas while a component runs: numbers, cameras, the robot."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage
from tests.support.editor import Editor
from tests.support.monitor import DOCUMENT, monitor_page, run, status
from tests.support.robot_server import eventually


@pytest.fixture
def document() -> str:
    return DOCUMENT


def choose(shown: EditorPage, tab: str) -> None:
    """Show one of the tabs of live values."""
    shown.page.get_by_role("tab", name=re.compile(f"^{tab}")).last.click()


def loaded(shown: EditorPage, library: str) -> bool:
    """Whether a library was loaded."""
    names: list[str] = shown.page.evaluate("performance.getEntriesByType('resource').map(each => each.name)")
    return any(f"vendor/{library}.js" in name for name in names)


def painted(shown: EditorPage, selector: str) -> bool:
    """Whether a canvas shows anything but one color."""
    found: bool = shown.page.evaluate(
        """selector => {
          const canvas = document.querySelector(selector);
          if (!canvas?.width) return false;
          const copy = Object.assign(document.createElement("canvas"), {width: canvas.width, height: canvas.height});
          const pen = copy.getContext("2d");
          pen.drawImage(canvas, 0, 0);
          return new Set(new Uint32Array(pen.getImageData(0, 0, copy.width, copy.height).data.buffer)).size > 3;
        }""",
        selector,
    )
    return found


def pixel(shown: EditorPage, u: int, v: int) -> list[int]:
    """Return red, green and blue of a pixel of the first camera's picture."""
    found: list[int] = shown.page.evaluate(
        """([u, v]) => {
          const canvas = document.querySelector("hfsm-camera canvas");
          return [...canvas.getContext("2d").getImageData(u, v, 1, 1).data];
        }""",
        [u, v],
    )
    return found


def differ(shown: EditorPage, one: str, other: str, what: str) -> None:
    """Check that a color is not the same for two elements."""
    found: list[str] = shown.page.evaluate(
        """([selectors, what]) => selectors.map((each) => {
          const color = getComputedStyle(document.querySelector(each))[what];
          return color === "rgba(0, 0, 0, 0)" ? getComputedStyle(document.body)[what] : color;
        })""",
        [[one, other], what],
    )
    assert found[0] != found[1], f"{one} and {other}: {found}"


def test_each_tab_shows_its_values_and_loads_its_library(browser: Browser, followed: Editor) -> None:
    with monitor_page(browser, followed, cached=False) as shown:
        page = shown.page
        run(shown)
        shown.press("Alt+l")
        choose(shown, "Variables")
        expect(page.locator("hfsm-live-variables")).to_be_visible()
        found = shown.violations("header", ".live-bar", ".side")
        assert not loaded(shown, "uplot")
        assert not loaded(shown, "three")

        choose(shown, "Plots")
        expect(page.locator(".uplot")).to_be_visible()
        expect(page.locator("output[data-name='1.count']")).to_have_text(re.compile(r"\d+"))
        page.get_by_label("Add a number to plot 1").select_option("joint.HeadYaw")
        expect(page.locator("output[data-name='joint.HeadYaw']")).to_have_text(re.compile(r"-?\d"))
        shown.button("Add a plot").click()
        expect(page.get_by_role("region", name=re.compile("Plot \\d"))).to_have_count(2)
        found += shown.violations("hfsm-monitor-panel")  # nothing else has changed

        choose(shown, "Cameras")
        expect(page.get_by_role("img", name="Top camera")).to_be_visible()
        expect(page.get_by_role("img", name="Bottom camera")).to_be_visible()
        page.wait_for_function(
            "() => document.querySelector('hfsm-camera .rate')?.textContent.match(/images?.s/)"
        )
        eventually(lambda: painted(shown, "hfsm-camera canvas"))
        top, bottom = (page.locator("hfsm-camera").nth(number) for number in (0, 1))
        expect(top).to_contain_text("red spot 80, 60")
        expect(bottom).not_to_contain_text("red spot")

        def is_red() -> bool:
            red, green, *_ = pixel(shown, 80, 60)
            return red > 200 and green < 100

        eventually(is_red)
        found += shown.violations("hfsm-monitor-panel")
        shown.button("Larger: Bottom camera").click()
        widths = "[...document.querySelectorAll('hfsm-camera canvas')].map(each => each.clientWidth)"
        eventually(lambda: page.evaluate(f"(([top, bottom]) => bottom > 3 * top)({widths})"))

        choose(shown, "Joints")
        expect(page.get_by_role("row", name=re.compile("HeadYaw.*°"))).to_be_visible()
        found += shown.violations("hfsm-monitor-panel")

        choose(shown, "3D")
        expect(page.get_by_role("img", name="The robot in 3D")).to_be_visible()
        eventually(lambda: loaded(shown, "uplot") and loaded(shown, "three"))
        found += shown.violations("hfsm-monitor-panel")

        choose(shown, "Cycles")
        expect(page.get_by_role("row", name=re.compile("^look|^wait|^walk")).first).to_contain_text("/ 100")
        found += shown.violations("hfsm-monitor-panel")

        choose(shown, "Errors")
        expect(page.locator("#live-panel > *")).to_be_visible()
        found += shown.violations("hfsm-monitor-panel")
        assert not found


def test_what_comes_and_goes_with_a_run_is_accessible_and_seen_in_forced_colors(
    browser: Browser, followed: Editor
) -> None:
    with monitor_page(browser, followed) as shown:
        page = shown.page
        speed = page.get_by_label("speed", exact=True)
        shown.button("Other ways to run").click()
        expect(page.get_by_role("menu", name="Run")).to_be_visible()
        found = shown.violations("header", ".menu")
        page.get_by_role("menuitem", name="Run with parameters").click()
        expect(speed).to_have_attribute("placeholder", "0.3")
        found += shown.violations("dialog")
        speed.fill("-0.7")
        shown.press("Enter")
        expect(status(shown)).to_have_text("Running")
        shown.press("Alt+l")
        choose(shown, "Variables")
        expect(page.locator("#live-panel").get_by_label("speed")).to_have_value("-0.7")
        shown.press("Alt+Shift+F5")
        expect(speed.and_(page.locator("dialog input"))).to_have_value("-0.7")
        shown.press("Escape")

        shown.button("1 running").click()
        expect(page.get_by_role("menuitem", name="walk", exact=False).first).to_be_visible()
        found += shown.violations("header", ".menu")
        shown.press("Escape")
        shown.press("Alt+b")
        robot = page.get_by_role("dialog", name="Robot")
        expect(robot.locator(":focus")).to_have_count(1)
        found += shown.violations("header", ".menu")
        shown.press("Escape")
        expect(robot).to_have_count(0)
        shown.state("wait").focus()
        shown.press("w")
        expect(page.get_by_role("tooltip")).to_be_visible()
        found += shown.violations("hfsm-canvas")
        page.get_by_role("slider", name="Moment of the run").focus()
        shown.press("Home")
        expect(status(shown)).to_have_text("Looking back")
        shown.press("Alt+o")
        page.get_by_role("tab", name="Timeline").click()
        expect(page.locator(".change-list")).to_be_visible()
        found += shown.violations()

        shown.button("Back to now").click()
        expect(status(shown)).to_have_text("Running")
        shown.transition("many").locator(".handle").click()
        shown.press("Delete")
        shown.state("go").locator(".body").click()
        expect(page.locator(".dirty")).to_be_visible()
        page.emulate_media(forced_colors="active")
        differ(shown, ".switch .knob", ".switch", "backgroundColor")
        differ(shown, ".dirty", ".tab.chosen", "backgroundColor")
        differ(shown, ".branch[aria-selected=true]", ".branch[aria-selected=false]", "backgroundColor")
        differ(shown, ".branch[data-live=active] .dot", ".branch.root .dot", "backgroundColor")
        for tabs in (".panel-tabs", ".inner-tabs"):
            differ(
                shown, f"{tabs} [aria-selected=true]", f"{tabs} [aria-selected=false]", "borderBottomColor"
            )
        found += shown.violations()
        assert not found
