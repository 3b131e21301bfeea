"""*Try it* in the page: a real component in its own process, without a robot, in Chromium."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.limits import RUN_LIMIT
from tests.support.monitor import editor_without_robot, expect_current, status

STARTED = RUN_LIMIT * 1000

DOCUMENT = """<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <events><event><name>clap</name></event></events>
  <SubAutomata id="1" idFather="0">
    <state initial="true" id="1">
      <posx>100</posx><posy>150</posy><name>look</name><code>self.Head.setPose(0.5, 0.1, 1.0)</code>
    </state>
    <state id="2"><posx>300</posx><posy>150</posy><name>rest</name></state>
    <state id="3"><posx>500</posx><posy>150</posy><name>sleep</name></state>
    <transition id="1">
      <posx>200</posx><posy>90</posy><name>enough</name><origin>1</origin><destiny>2</destiny>
      <trans type="event">clap</trans>
    </transition>
    <transition id="3">
      <posx>200</posx><posy>250</posy><name>startled</name><origin>1</origin><destiny>2</destiny>
      <trans type="event">bang</trans>
    </transition>
    <transition id="2">
      <posx>400</posx><posy>90</posy><name>tired</name><origin>2</origin><destiny>3</destiny>
      <trans type="time">7200000</trans>
    </transition>
    <iteration_time>50</iteration_time>
  </SubAutomata>
  <config>
    <iceinterface>
      <nameinterface>Head</nameinterface><nameproxy>Head</nameproxy><ip>localhost</ip><port>7447</port>
      <interface>PoseHead</interface>
    </iceinterface>
  </config>
</VisualHFSM>
"""


@pytest.fixture
def shown(browser: Browser, tmp_path: Path) -> Iterator[EditorPage]:
    path = tmp_path / "clapping.xml"
    path.write_text(DOCUMENT)
    with editor_without_robot(tmp_path, path) as running, editor_page(browser, running) as shown:
        yield shown


def test_a_behavior_is_tried_without_a_robot(shown: EditorPage) -> None:
    page = shown.page
    shown.state("look").wait_for()
    shown.button("Other ways to run").click()
    page.get_by_role("menuitem", name="Try it without a robot").click()
    expect(status(shown)).to_have_text("Trying, 1 x", timeout=STARTED)
    expect(page.get_by_role("tab", name="Try it")).to_have_attribute("aria-selected", "true")
    expect(page.get_by_role("button", name="See the robot")).to_be_visible()
    expect_current(shown, "look")
    page.get_by_role("tab", name="Variables").click()
    expect(page.locator("hfsm-live-variables")).to_contain_text("28.6°")  # 0.5 rad
    page.get_by_role("tab", name="Try it").click()
    assert shown.violations("header", ".side") == []
    events = page.get_by_role("group", name="Events")
    expect(events.get_by_role("button")).to_have_text(["clap"])  # the other is not declared
    expect(events).to_contain_text("Only the behavior's own code may send bang: declare it in Data, Behavior")
    shown.button("clap").click()
    expect_current(shown, "rest")
    shown.button("20 x").click()
    expect(status(shown)).to_have_text("Trying, 20 x")
    shown.press("F8")
    expect(status(shown)).to_have_text("Paused")
    shown.button("tired").click()
    shown.press("Control+F10")
    expect_current(shown, "sleep")
    expect(shown.button("No robot: start a simulation")).to_be_visible()
    shown.press("Control+Shift+Space")
    expect(status(shown)).to_have_text(re.compile(r"^\s*Ended"))
    shown.press("F5")
    shown.button("Try it without one").click()
    expect(status(shown)).to_have_text("Trying, 1 x", timeout=STARTED)
    expect(shown.button("No robot: start a simulation")).to_be_visible()
    shown.button("clap").click()
    expect_current(shown, "rest")
    shown.press("Shift+F5")
    expect(status(shown)).to_have_text(re.compile(r"^\s*Ended"))
    page.get_by_role("slider", name="Moment").first.focus()
    shown.press("Home")
    expect(status(shown)).to_have_text("Looking back")
