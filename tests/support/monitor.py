"""A component for the tests of the editor's monitor, without a robot or with a fake one."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from playwright.sync_api import Browser, Locator, expect

from codegen.diagnostics import Diagnostics
from naoserver.fake import FakeRobot
from naoserver.robot import Robot
from tests.support.browser import EditorPage, editor_page
from tests.support.editor import Editor, editor
from tests.support.limits import CALL_LIMIT, END_LIMIT, EVENT_LIMIT, MOVE_LIMIT, START_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint
from tests.support.robot_server import ServedRobot, served
from visualhfsm._document.generate import generate_component
from visualhfsm._editor.parts import MakeParts, make_parts
from visualhfsm._monitor.messages import PartLimits
from zenoh_ice import Settings

DOCUMENT = """<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <parameters><parameter><name>speed</name><type>float</type><default>0.3</default></parameter></parameters>
  <events><event><name>home</name></event><event><name>ball</name></event></events>
  <SubAutomata id="1" idFather="0">
    <state initial="true" id="1">
      <posx>100</posx><posy>150</posy><name>wait</name><idSubautomataSon>2</idSubautomataSon>
      <code>count += 1
self.mark("Camera", 80, 60, "red spot")</code>
    </state>
    <state id="2"><posx>400</posx><posy>150</posy><name>go</name></state>
    <transition id="1">
      <posx>250</posx><posy>90</posy><name>late</name><origin>1</origin><destiny>2</destiny>
      <trans type="time">240000</trans>
    </transition>
    <transition id="2">
      <posx>250</posx><posy>220</posy><name>many</name><origin>1</origin><destiny>2</destiny>
      <trans type="condition">count &gt; 1000000</trans>
    </transition>
    <transition id="3">
      <posx>250</posx><posy>290</posy><name>back</name><origin>2</origin><destiny>1</destiny>
      <trans type="event">home</trans>
    </transition>
    <variables>count = 0</variables>
  </SubAutomata>
  <SubAutomata id="2" idFather="1">
    <state initial="true" id="1"><posx>100</posx><posy>150</posy><name>look</name></state>
    <state id="2"><posx>300</posx><posy>150</posy><name>found</name><final>true</final></state>
    <transition id="1">
      <posx>200</posx><posy>90</posy><name>seen</name><origin>1</origin><destiny>2</destiny>
      <trans type="event">ball</trans>
    </transition>
    <iteration_time>20</iteration_time>
  </SubAutomata>
</VisualHFSM>
"""


PATIENT: Final = PartLimits(
    refreshment=0.1,
    silence=EVENT_LIMIT,
    appearance=START_LIMIT,
    component_end=END_LIMIT,
    stop_answer=CALL_LIMIT,
    standstill=EVENT_LIMIT,
)
"""The limits of a busy machine: those of the product are for one that does little else.

Only what comes by itself is looked at more often.
"""


def patient_parts(settings: Settings, folder: Path | None = None, limits: PartLimits = PATIENT) -> MakeParts:
    """Return a factory of the parts of a realm that waits for robots and components on a busy machine, too."""
    return make_parts(settings, folder=folder, limits=limits)


@contextlib.contextmanager
def robot_and_editor(
    path: Path, document: str = DOCUMENT, nao: Robot | None = None, limits: PartLimits = PATIENT
) -> Iterator[tuple[ServedRobot, Editor]]:
    """Serve a robot, by default a fake one, and the editor of a document in its realm."""
    path.write_text(document)
    with (
        served(nao or FakeRobot()) as robot,
        editor_beside(robot, path.parent, path, limits=limits) as running,
    ):
        yield robot, running


@contextlib.contextmanager
def editor_beside(
    robot: ServedRobot, root: Path, *files: Path, limits: PartLimits = PATIENT
) -> Iterator[Editor]:
    """Serve an editor in the realm of a robot."""
    settings = Settings(realm=robot.realm, connect=(robot.endpoint,), clock="wall", timeout=CALL_LIMIT)
    with editor(root, *files, make_parts=patient_parts(settings, limits=limits)) as running:
        yield running


@contextlib.contextmanager
def editor_without_robot(root: Path, *files: Path) -> Iterator[Editor]:
    """Serve an editor that runs components and starts robots, in a realm without one."""
    settings = Settings(realm="test-alone", connect=(free_endpoint(),), clock="wall", timeout=CALL_LIMIT)
    with editor(root, *files, make_parts=patient_parts(settings, folder=root)) as running:
        yield running


@contextlib.contextmanager
def monitor_page(
    browser: Browser, running: Editor, *, cached: bool = True, holds: str = ""
) -> Iterator[EditorPage]:
    """Show the document in a window."""
    with editor_page(browser, running, cached=cached, holds=holds) as shown:
        shown.state("wait").wait_for()
        yield shown


@contextlib.contextmanager
def started_elsewhere(robot: ServedRobot, path: Path, *arguments: str) -> Iterator[ComponentProcess]:
    """Run the component of a document from a terminal, like another user."""
    component = generate_component(path, path.parent, Diagnostics())
    assert component is not None
    environment = {"VISUALHFSM_REALM": robot.realm, "VISUALHFSM_CONNECT": robot.endpoint}
    with ComponentProcess([sys.executable, str(component), *arguments], environment) as process:
        yield process


def status(shown: EditorPage) -> Locator:
    """The status of the followed component as text."""
    return shown.page.locator(".live-status")


def run(shown: EditorPage) -> None:
    """Press F5 and wait until the component is followed."""
    shown.press("F5")
    expect(status(shown)).to_have_text("Running")


def run_again(shown: EditorPage) -> None:
    """Press F5 while the component runs, let it run again, and wait until another one is followed."""
    started = (
        "async () => (await import(document.querySelector('script[src$=\"/app.js\"]').src"
        ".replace('shell/app.js', 'run/monitor.js'))).monitor.newest?.component.startedAt"
    )
    before = shown.page.evaluate(started)
    shown.press("F5")
    shown.page.get_by_role("dialog").get_by_role("button", name="Run again").click()
    comes_true(shown, f"async (before) => ![before, null, undefined].includes(await ({started})())", before)
    expect(status(shown)).to_have_text("Running")


def comes_true(shown: EditorPage, condition: str, argument: object = None) -> None:
    """Wait until a function of JavaScript, which may be async, returns a true value: the page itself polls it."""
    shown.page.evaluate(
        f"""async ([argument, limit]) => {{
          const end = performance.now() + limit;
          while (!(await ({condition})(argument))) {{
            if (performance.now() > end) throw new Error("it did not come true in time");
            await new Promise((resolve) => setTimeout(resolve, 30));
          }}
        }}""",
        [argument, MOVE_LIMIT * 1000],
    )


def follow(shown: EditorPage, component: str) -> None:
    """Choose one of the running components."""
    shown.button("1 running").click()
    shown.page.get_by_role("menuitem", name=component).click()
    expect(status(shown)).to_have_text("Running")


def expect_current(shown: EditorPage, name: str, *words: str) -> None:
    """Wait until a state is the current one, with `words` in its description."""
    label = ".*".join([f"State {name}", "active", *words])
    expect(shown.page.locator("hfsm-canvas .state.active")).to_have_attribute("aria-label", re.compile(label))


def expect_breakpoint(shown: EditorPage, state: str, words: str = "breakpoint") -> None:
    """Wait until a state's description has `words`."""
    expect(shown.state(state)).to_have_attribute("aria-label", re.compile(words))
