"""The page fits: in no situation is a word cut, does a bar scroll, a button leave its bar, or the drawing jump."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from typing import Final

import pytest
from playwright.sync_api import Browser

from tests.support.browser import Box, EditorPage, editor_page
from tests.support.editor import Editor
from tests.support.monitor import comes_true, robot_and_editor
from tests.support.plugins import OF_THE_WHOLE
from tests.support.soak import cases

SIZES: Final = ((1280, 800), (1024, 768), (390, 844))

DOCUMENT: Final = """<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <parameters><parameter><name>speed</name><type>float</type><default>0.3</default></parameter></parameters>
  <events><event><name>ball</name></event></events>
  <SubAutomata id="1" idFather="0">
    <state initial="true" id="1">
      <posx>100</posx><posy>150</posy><name>lookAround</name><code>self.Head.setPose(0.8, 0.0, 0.3)</code>
    </state>
    <state id="2">
      <posx>400</posx><posy>150</posy><name>followBall</name>
      <code>for number in range(3):
    self.log.info("a line that is longer than the panel beside the drawing is wide, in which it is written")
    value = number / number</code>
    </state>
    <state id="3"><posx>250</posx><posy>380</posy><name>rest</name></state>
    <transition id="1">
      <posx>250</posx><posy>90</posy><name>seen</name><origin>1</origin><destiny>2</destiny>
      <trans type="event">ball</trans>
    </transition>
    <transition id="2">
      <posx>250</posx><posy>220</posy><name>there</name><origin>2</origin><destiny>1</destiny>
      <trans type="condition">self.Head.getPose().pan &lt; -0.7</trans>
    </transition>
    <variables>count = 0</variables>
  </SubAutomata>
  <config>
    <iceinterface>
      <nameinterface>Head</nameinterface><nameproxy>Head</nameproxy><ip>localhost</ip><port>7447</port>
      <interface>PoseHead</interface>
    </iceinterface>
  </config>
</VisualHFSM>
"""

FAULTS: Final = """([canvasTop]) => {
  // Names and messages of the user: a title, a click or the code below has them whole.
  const whole = ".live-status, .tab, hfsm-breadcrumbs, .lane-names, .last-step, .about, .where, .excerpt, .component";
  const scrolling = "hfsm-tabs [role=tablist], hfsm-tree";
  const bars = "header, .second-row, .toolbar, .tools, .panel-tabs, .dock-head, hfsm-status, .timeline-tools, .banner";
  const name = (each) => `${each.localName}.${each.getAttribute("class")} ${each.textContent.replace(/\\s+/g, " ").trim().slice(0, 60)}`;
  const inside = (root) =>
    [...root.querySelectorAll("*")].flatMap((each) => [each, ...(each.shadowRoot ? inside(each.shadowRoot) : [])]);
  const seen = inside(document.body).filter(
    (each) => each.checkVisibility({opacityProperty: true, visibilityProperty: true}) && !each.closest("svg, .for-readers"));
  const found = [];
  for (const each of seen) {
    const {overflowX, clipPath} = getComputedStyle(each);
    if (clipPath !== "none" || overflowX === "visible" || each.scrollWidth <= each.clientWidth + 1) continue;
    if (!each.closest(whole) && !each.closest(scrolling) && each.clientWidth > 1)
      found.push(`${overflowX === "hidden" || overflowX === "clip" ? "cut" : "scrolls"}: ${name(each)}`);
  }
  for (const bar of seen.filter((each) => each.matches(bars))) {
    const {left, right, top, bottom} = bar.getBoundingClientRect();
    for (const each of bar.querySelectorAll("button:not([popover] *), select, label, a")) {
      if (!each.checkVisibility({opacityProperty: true}) || each.closest(scrolling)) continue;
      const box = each.getBoundingClientRect();
      if (box.left < left - 1 || box.right > right + 1 || box.top < top - 1 || box.bottom > bottom + 1 || box.right > innerWidth)
        found.push(`beyond its bar: ${name(each)}`);
    }
  }
  for (const head of document.querySelectorAll(".code-panel > :is(.about, .inner-tabs)")) {
    const [{top}, box] = [head.closest(".content"), head].map((each) => each.getBoundingClientRect());
    if (innerWidth > 720 && box.top < top - 1 && box.bottom > top + 1) found.push(`half scrolled away: ${name(head)}`);
  }
  const focused = document.activeElement.closest(".scrolling .section");
  if (focused) {
    const [place, box] = [focused.closest(".scrolling"), focused].map((each) => each.getBoundingClientRect());
    if (box.top < place.top || box.top + 60 > place.bottom) found.push(`out of view: ${name(focused)}`);
  }
  for (const row of innerWidth > 560 ? document.querySelectorAll("hfsm-problems .row") : []) {
    const [words, where] = [".message", ".where"].map((each) => row.querySelector(each).getBoundingClientRect().top);
    if (Math.abs(words - where) > 1) found.push(`not in one line: ${name(row)}`);
  }
  const tree = document.querySelector("hfsm-tree");
  if (tree.scrollLeft) found.push("the tree has slid");
  if (innerWidth > 1100 && tree.scrollWidth > tree.clientWidth) found.push("the tree scrolls sideways");
  const page = document.scrollingElement;
  if (page.scrollWidth > innerWidth || page.scrollHeight > innerHeight) found.push("the page scrolls");
  const canvas = document.querySelector(".drawing"); // with a banner in it, which moves nothing that is drawn
  if (canvas.checkVisibility() && canvasTop && canvas.getBoundingClientRect().top !== canvasTop)
    found.push(`the drawing is at ${canvas.getBoundingClientRect().top}, not ${canvasTop}`);
  return found;
}"""
"""What does not fit; the argument is where the top of the drawing was at first."""

TOP: Final = "document.querySelector('.drawing').getBoundingClientRect().top"
APP: Final = "document.querySelector('hfsm-app')"
COVERED: Final = """() => {
  const sentence = document.querySelector(".invitation")?.getBoundingClientRect();
  return [...document.querySelectorAll("hfsm-canvas .state .body")].map((each) => each.getBoundingClientRect())
    .filter(({left, right, top, bottom}) => sentence?.width && left < sentence.right && sentence.left < right &&
      top < sentence.bottom && sentence.top < bottom)
    .map((_, index) => `the sentence for newcomers covers state ${index + 1}`);
}"""
BELOW: Final = (
    "problems",
    "search",
    "output",
    "tests-panel",
    *(("trials-panel",) if find_spec("visualhfsm_trials") else ()),
    "undo-steps",
    "monitor-timeline",
)
RUNS: Final = "() => document.querySelector('.live-status.running')"
ENDED: Final = "() => document.querySelector('.live-status.failed')"


def situations(shown: EditorPage) -> Iterator[str]:
    """Bring the page into one situation after the other, in whatever language it speaks."""
    page = shown.page
    states, transitions = page.locator("hfsm-canvas .state"), page.locator("hfsm-canvas .transition .knob")
    yield "fresh"
    states.nth(1).click()
    shown.edit_code()
    comes_true(shown, "() => document.querySelector('hfsm-code-field').shadowRoot.querySelector('.cm-line')")
    yield "code"
    transitions.nth(1).click()
    page.locator(".type-choice").wait_for()
    yield "a transition"
    for tag, first in (("hfsm-data-panel", "hfsm-code-field"), ("hfsm-monitor-panel", "p")):
        page.evaluate(f"{APP}.showSide('{tag}')")
        page.locator(f"{tag} {first}").first.wait_for()
        yield tag
    page.evaluate(f"{APP}.showSide('')")
    heights = set()
    for tag in BELOW:
        page.evaluate(f"{APP}.showBottom('hfsm-{tag}')")
        page.locator(f".bottom hfsm-{tag} > *").first.wait_for()
        heights.add(Box.of(page.locator(".bottom")).height)
        yield f"{tag}, before a run"
    assert len(heights) == 1
    page.evaluate(f"{APP}.showBottom('')")
    states.nth(0).click(button="right")
    page.get_by_role("menu").wait_for()
    yield "a menu"
    shown.press("Escape")
    for key, what in (("Control+k", "the palette"), ("Control+Shift+S", "a dialog"), ("?", "the help")):
        shown.press(key)
        page.get_by_role("dialog").wait_for()
        yield what
        shown.press("Escape")
    shown.press("F5")
    comes_true(shown, RUNS)
    page.locator("main > hfsm-monitor-timeline .timeline").wait_for()
    assert page.locator(".invitation").is_visible()  # who has run it may change it
    yield "running"
    page.evaluate(f"{APP}.foldRobot(false)")
    page.locator(".dock .stage canvas").wait_for()
    yield "running, with the robot"
    page.evaluate(f"{APP}.showBottom('hfsm-problems')")
    states.nth(1).click()
    shown.edit_code()
    comes_true(shown, "() => document.activeElement.closest('.code-panel')")
    yield "code below the robot"
    shown.press("Alt+v")
    comes_true(shown, "() => document.activeElement.closest('.data-panel')")
    yield "variables below the robot"
    page.evaluate(f"{APP}.showBottom('')")
    page.evaluate(f"{APP}.foldRobot(true)")
    page.evaluate(f"{APP}.showLive('variables')")
    page.locator(".monitor-panel .live-values").wait_for()
    yield "values of a run"
    page.evaluate(f"{APP}.showLive('cycles')")
    page.locator(".cycles td").first.wait_for()
    yield "cycles of a run"
    page.evaluate(f"{APP}.showSide('')")
    for tag in (*BELOW[4:-2], "monitor-timeline"):
        page.evaluate(f"{APP}.showBottom('hfsm-{tag}')")
        page.locator(f".bottom hfsm-{tag} > *").first.wait_for()
        yield f"{tag}, during a run"
    page.evaluate(f"{APP}.showBottom('')")
    page.locator(".timeline canvas").first.click(position={"x": 20, "y": 8})
    page.locator("hfsm-canvas.past").wait_for()
    yield "looking back"
    shown.press("Alt+End")
    page.locator("hfsm-canvas:not(.past)").wait_for()
    shown.press("F8")
    comes_true(shown, "() => document.querySelector('.live-status.paused')")
    yield "paused"
    shown.press("F8")
    comes_true(shown, RUNS)
    shown.press("Alt+e")
    page.get_by_role("dialog").locator("input").first.fill("ball")  # the next state fails
    shown.press("Enter")
    comes_true(shown, ENDED)
    assert page.locator(".switch").is_hidden()  # its room is for the error
    yield "an error"
    page.locator(".live-bar .link").click()
    comes_true(
        shown, "() => document.querySelector('hfsm-code-field')?.shadowRoot.querySelector('.cm-failed')"
    )
    page.evaluate(f"{APP}.showBottom('hfsm-output')")
    page.locator(".bottom .line").first.wait_for()
    yield "an error at its line, with its output"
    page.evaluate(f"{APP}.showBottom('')")
    page.evaluate(f"{APP}.showSide('')")
    page.locator(".stop-button").click()
    page.locator(".banner.error").wait_for()
    yield "stopped"
    page.locator(".banner.error button").click()
    page.locator(".banner").wait_for(state="detached")
    shown.connections.cut()
    page.locator(".banner.error").wait_for()
    yield "offline"
    shown.connections.restore()
    page.locator(".banner.error button").first.click()
    page.locator(".banner").wait_for(state="detached")
    page.locator("hfsm-tabs > .action").click()
    page.locator("hfsm-start h1, hfsm-start h2").first.wait_for()
    yield "the start page"


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Editor]:
    """An editor with a robot."""
    with robot_and_editor(tmp_path_factory.mktemp("width") / "dance_and_follow.xml", DOCUMENT) as (
        _,
        running,
    ):
        yield running


@OF_THE_WHOLE
@pytest.mark.parametrize("language", cases(["es"], ["en"]))  # the longer words
def test_everything_fits_in_every_situation(browser: Browser, running: Editor, language: str) -> None:
    found: dict[str, list[str]] = {}
    tops: dict[int, float] = {}
    with editor_page(browser, running, language=language) as shown:
        shown.page.locator("hfsm-shelf .ready").first.wait_for()
        for situation in situations(shown):
            for width, height in SIZES:
                shown.resize(width, height)
                tops.setdefault(width, shown.page.evaluate(TOP))
                faults = shown.page.evaluate(FAULTS, [tops[width]]) + shown.page.evaluate(COVERED)
                found[f"{situation}, {width}"] = faults
            shown.resize(*SIZES[0])
    assert len(found) == 31 * len(SIZES)
    assert [f"{situation}: {fault}" for situation, faults in found.items() for fault in faults] == []
