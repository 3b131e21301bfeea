"""The world of a simulation in the page: it is shown, a ball is carried, and looking back shows where it was."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from tests.support.browser import EditorPage
from tests.support.monitor import comes_true, monitor_page, robot_and_editor, status
from tests.support.robot_server import ServedRobot, eventually

pytestmark = pytest.mark.sim

BALL = """async () => {
  const drawing = document.querySelector("hfsm-robot-view")?.drawing;
  const ball = drawing?.world.objects.get("Ball");
  if (!ball?.visible) return null;
  await drawing.drawn();
  const {left, top, width, height} = drawing.stage.getBoundingClientRect();
  const {x, y} = ball.position.clone().project(drawing.viewpoints.camera);
  return [left + (1 + x) * width / 2, top + (1 - y) * height / 2, ...ball.position.toArray()];
}"""
NOW = """async () => {
  const entry = document.querySelector('script[src$="/app.js"]').src;
  return (await import(entry.replace("shell/app.js", "run/monitor.js"))).monitor.newest.component.time;
}"""
LOOK_BACK = """async time => {
  const entry = document.querySelector('script[src$="/app.js"]').src;
  const {scrubbing} = await import(entry.replace("shell/app.js", "run/scrubbing.js"));
  await scrubbing.to(time);
}"""


@pytest.fixture
def world(tmp_path: Path, browser: Browser) -> Iterator[tuple[ServedRobot, EditorPage]]:
    nao = SimulatedRobot(skin=False, world=load_world("room"))
    with (
        robot_and_editor(tmp_path / "walk.xml", nao=nao) as (robot, running),
        monitor_page(browser, running) as shown,
    ):
        yield robot, shown


def test_the_world_is_shown_and_recorded_and_a_ball_is_carried_in_it(
    world: tuple[ServedRobot, EditorPage],
) -> None:
    robot, shown = world
    stage = robot.robot.stage
    assert stage is not None
    page = shown.page
    expect(page.get_by_role("button", name="Simulated Nao")).to_be_visible()  # nothing is followed
    shown.press("Alt+l")
    expect(page.get_by_role("tab", name="3D")).to_have_attribute("aria-selected", "true")
    expect(page.get_by_role("tab", name="Variables")).to_have_count(0)
    comes_true(shown, BALL)
    page.get_by_role("tab", name="Cameras").click()
    expect(page.locator("hfsm-camera").first).to_contain_text("camera")

    shown.press("Alt+Shift+r")
    expect(status(shown)).to_have_text("Running")
    page.get_by_role("tab", name="3D").click()
    comes_true(shown, BALL)
    comes_true(shown, f"async () => await ({NOW})() > 1")  # by then it is written where the ball is
    page.locator(".view-tools").get_by_role("button", name="Top").click()
    comes_true(shown, "() => document.querySelector('hfsm-robot-view').grabbing.enabled")

    def is_over_ball() -> bool:
        ball = page.evaluate(BALL)
        if not ball:
            return False
        x, y, *_ = ball
        page.mouse.move(x - 1, y)
        page.mouse.move(x, y)
        stands = (page.evaluate(BALL) or [])[:2] == pytest.approx([x, y], abs=1.0)
        return stands and page.locator(".grabbable").count() == 1

    eventually(is_over_ball)  # not before the view stands, and the ball
    x, y, *start = page.evaluate(BALL)
    before = page.evaluate(NOW)
    page.mouse.down()
    expect(page.locator(".holding")).to_have_count(1)
    page.mouse.move(x + 60, y + 10, steps=4)
    eventually(lambda: stage.truth().objects["Ball"].position[1] < start[1] - 0.1)
    page.mouse.up()
    comes_true(shown, f"async limit => (await ({BALL})())[3] < limit", start[1] - 0.1)

    hint, sentence = page.locator(".robot-hint"), page.get_by_label("Say something to the robot")
    expect(sentence).to_have_count(0)
    page.locator(".view-tools").get_by_role("button", name="Say").click()
    sentence.fill("Go left")
    sentence.press("Enter")
    expect(hint).to_have_text("No program recognized that.")
    robot.assembly.hearing.listen(str.lower)
    sentence.fill("Go LEFT")
    page.get_by_role("button", name="Say it").click()
    expect(hint).to_have_text("It understood: go left")
    expect(sentence).to_have_value("")

    page.evaluate(LOOK_BACK, before)
    expect(sentence).to_have_count(0)
    eventually(lambda: (page.evaluate(BALL) or [])[2:] == pytest.approx(start, abs=0.02))
    assert stage.truth().objects["Ball"].position[1] < start[1] - 0.1
    assert not page.evaluate("document.querySelector('hfsm-robot-view').grabbing.enabled")

    shown.press("Shift+F5")
    shown.button("Play it").click()
    expect(status(shown)).to_have_text("Recording")
    stage.place_object("Ball", (0.5, -1.0, 0.05))
    page.evaluate(LOOK_BACK, before)
    eventually(lambda: (page.evaluate(BALL) or [])[2:] == pytest.approx(start, abs=0.02))
    assert page.locator(".push").count() == 0
