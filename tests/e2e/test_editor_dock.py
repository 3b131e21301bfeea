"""The robot beside the drawing: above all code, on every run, once, and only while it is seen."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, expect

from hfsm_runtime.recording_file.messages import Snapshot
from hfsm_runtime.recording_file.writer import Entry, RecordingWriter
from interfaces.nao import SoundsPrx, SpeechPrx
from naoserver.fake import FakeRobot
from tests.support.browser import Box, EditorPage, new_context, shared_address
from tests.support.component import short_snapshot
from tests.support.editor import editor
from tests.support.monitor import (
    DOCUMENT,
    comes_true,
    monitor_page,
    patient_parts,
    robot_and_editor,
    run,
    status,
)
from tests.support.robot_server import ServedRobot, clock_at, eventually
from zenoh_ice import Settings

SEVERAL_FRAMES = """async () => {
    for (let frame = 0; frame < 4; frame++) await new Promise(requestAnimationFrame);
}"""
SLOW = 0.05
"""Robot seconds in a second of the wall: a tone, of 10 s at most, lasts while a busy machine draws the page."""
IS_DRAWN = "() => document.querySelector('hfsm-robot-view')?.drawing?.body?.torso.visible"


@pytest.fixture
def document() -> str:
    return DOCUMENT


@pytest.fixture
def shown(live_page: EditorPage) -> EditorPage:
    return live_page


def dock(shown: EditorPage) -> Locator:
    return shown.page.get_by_role("region", name="The robot")


def show(shown: EditorPage) -> None:
    """Show the robot, and wait until it is drawn."""
    shown.show_robot()
    comes_true(shown, IS_DRAWN)


def test_the_robot_stays_above_the_code_on_every_run_and_covers_nothing_of_the_drawing(
    shown: EditorPage,
) -> None:
    page = shown.page
    show(shown)
    for _ in range(2):
        run(shown)
        expect(dock(shown).locator(".stage canvas")).to_be_visible()
        shown.state("wait").click()
        shown.edit_code()
        expect(page.get_by_role("tab", name="Code", exact=True)).to_have_attribute("aria-selected", "true")
        expect(dock(shown).locator(".stage canvas")).to_be_visible()
        shown.press("Escape")
        shown.button("Close the panel").click()
        shown.press("Shift+F5")
        expect(status(shown)).to_contain_text("Ended")
    assert not Box.of(page.locator("hfsm-canvas")).overlaps(Box.of(dock(shown)))
    assert shown.violations(".dock") == []


def test_the_robot_is_drawn_once_wherever_it_moves_and_not_while_it_is_folded_or_hidden(
    shown: EditorPage,
) -> None:
    page = shown.page
    show(shown)
    page.evaluate("() => (window.first = document.querySelector('hfsm-robot-view').drawing)")
    dock(shown).get_by_role("button", name="Larger, in the panel").click()
    expect(page.get_by_role("tab", name="3D")).to_have_attribute("aria-selected", "true")
    expect(dock(shown)).to_have_count(0)
    expect(page.locator(".side .stage canvas")).to_be_visible()
    page.get_by_role("tab", name="Cameras").click()
    expect(dock(shown).locator(".stage canvas")).to_be_visible()
    shown.press("Alt+l")
    page.get_by_role("tab", name="3D").click()
    shown.button("Close the panel").click()
    expect(dock(shown).locator(".stage canvas")).to_be_visible()
    shown.press("Alt+l")
    expect(page.locator(".side .stage canvas")).to_be_visible()
    assert page.evaluate("window.first === document.querySelector('hfsm-robot-view').drawing")
    assert page.locator(".stage canvas").count() == 1

    shown.button("Close the panel").click()
    page.evaluate(
        """() => {
          window.view = document.querySelector("hfsm-robot-view");
          const {renderer} = window.view.drawing;
          window.frames = () => renderer.info.render.frame;
        }"""
    )
    page.get_by_role("button", name="Start page").click()
    expect(dock(shown)).to_be_hidden()
    page.evaluate(SEVERAL_FRAMES)  # within which it notices
    before = page.evaluate("window.frames()")
    page.evaluate("window.view.drawing.drawn()")
    page.evaluate(SEVERAL_FRAMES)
    assert page.evaluate("window.frames()") == before
    page.get_by_role("tab", name="walk").click()
    comes_true(shown, "before => window.frames() > before", before)
    dock(shown).get_by_role("button", name="Fold the robot's picture").click()
    comes_true(shown, "() => !window.view.drawing && !window.view.frames")
    expect(shown.button("See the robot")).to_be_focused()


def test_what_the_user_chose_is_remembered(shown: EditorPage) -> None:
    page = shown.page
    show(shown)
    picture = dock(shown).get_by_role("combobox", name="Picture of the robot")
    picture.select_option("Camera")
    expect(dock(shown).locator("hfsm-camera canvas")).to_be_visible()
    expect(page.locator(".stage")).to_have_count(0)
    assert shown.violations(".dock") == []
    shown.press("Alt+l")
    expect(page.locator(".with-panel .dock")).to_be_visible()  # until then it has all of the height
    high = Box.of(dock(shown)).height
    dock(shown).get_by_role("separator", name="Height of the robot's picture").press("ArrowDown")
    comes_true(shown, "high => document.querySelector('.dock').offsetHeight > high", high + 10)
    page.reload()
    shown.state("wait").wait_for()
    expect(picture).to_have_value("Camera")
    shown.press("Alt+l")
    comes_true(shown, "high => document.querySelector('.dock').offsetHeight > high", high + 10)
    shown.press("Alt+Shift+b")
    expect(dock(shown)).to_have_count(0)
    page.reload()
    expect(shown.button("See the robot")).to_be_visible()


def test_a_browser_without_3d_says_so_and_shows_a_camera(shown: EditorPage) -> None:
    shown.page.evaluate(
        """() => {
          const original = HTMLCanvasElement.prototype.getContext;
          HTMLCanvasElement.prototype.getContext = function (kind, ...options) {
            return kind.startsWith("webgl") ? null : original.call(this, kind, ...options);
          };
        }"""
    )
    shown.button("See the robot").click()
    picture = dock(shown).get_by_role("combobox", name="Picture of the robot")
    expect(dock(shown).locator("hfsm-camera canvas")).to_be_visible()
    expect(picture).to_have_value("Camera")
    expect(picture.get_by_role("option", name="In 3D")).to_be_disabled()

    # While the robot is lost there is no camera to choose, and no empty choice.
    set_cameras = "async (names) => { (await import(window.monitorModule)).monitor.robot.cameras = names; }"
    shown.page.evaluate(
        """() => { window.monitorModule = document.querySelector("script[src$='/app.js']").src
            .replace("shell/app.js", "run/monitor.js"); }"""
    )
    for names, value in (([], "3D"), (["Camera"], "Camera")):
        shown.page.evaluate(set_cameras, names)
        shown.page.evaluate("document.querySelector('hfsm-robot-dock').requestUpdate()")
        expect(picture).to_have_value(value)
    expect(dock(shown).locator("hfsm-camera canvas")).to_be_visible()
    shown.mishaps.clear()  # three.js logs it


def test_what_the_robot_says_and_plays_is_seen(browser: Browser, tmp_path: Path) -> None:
    with (
        robot_and_editor(tmp_path / "walk.xml", nao=FakeRobot(clock_at(SLOW))) as (robot, running),
        monitor_page(browser, running) as shown,
        robot.client() as client,
    ):
        show(shown)
        caption = dock(shown).locator(".heard")
        speech, sounds = client.proxy(SpeechPrx, "Speech"), client.proxy(SoundsPrx, "Sounds")
        speech.say("I see the ball, and walk to it. " * 4)
        expect(caption).to_contain_text("“I see the ball")
        assert shown.violations(".dock") == []
        speech.stop()
        expect(caption).to_have_text("")
        sounds.playTone(440.0, 5.0, 0.5)
        expect(caption).to_contain_text("♪ tone")
        sounds.stop()
        expect(caption).to_have_text("")


SAYS = """async () => {
    const entry = document.querySelector('script[src$="/app.js"]').src;
    const {monitor} = await import(entry.replace('shell/app.js', 'run/monitor.js'));
    const {robot, component} = monitor.newest;
    if (!robot.says || !robot.sound) return false;
    window.since ??= component.time;
    return component.time - window.since > 1;
}"""
"""Whether the moments that are recorded have contained what is said and played for a second, longer than a step."""
IS_THERE = """async () => {
    const entry = document.querySelector('script[src$="/app.js"]').src;
    const {monitor} = await import(entry.replace('shell/app.js', 'run/monitor.js'));
    const {scrubbing} = await import(entry.replace('shell/app.js', 'run/scrubbing.js'));
    const {component} = await monitor.ask('moment', {time: scrubbing.time});
    return component.time === monitor.looking?.component.time;
}"""
"""Whether the moment that was chosen is shown."""


def test_the_caption_is_read_on_a_phone_by_users_and_viewers_and_in_forced_colors(
    browser: Browser, tmp_path: Path
) -> None:
    with (
        robot_and_editor(tmp_path / "walk.xml", nao=FakeRobot(clock_at(SLOW))) as (robot, running),
        monitor_page(browser, running) as shown,
        robot.client() as client,
        contextlib.closing(new_context(browser, "es")) as context,
    ):
        viewer = context.new_page()
        viewer.goto(shared_address(shown))
        speech, sounds = client.proxy(SpeechPrx, "Speech"), client.proxy(SoundsPrx, "Sounds")
        speech.say("I see the ball, and walk to it as far as I can. " * 20)
        shown.button("See the robot").click()
        for page in (shown.page, viewer):
            page.set_viewport_size({"width": 390, "height": 844})
            page.locator(".dock .stage canvas").wait_for()
            sounds.playTone(440.0, 10.0, 0.5)
            for width in (390, 1024):
                page.set_viewport_size({"width": width, "height": 844})
                expect(page.locator(".dock .heard p")).to_have_count(2)
                caption = [Box.of(each) for each in page.locator(".dock .heard p").all()]
                picture = Box.of(page.locator(".dock .stage"))
                assert all(each.is_within(picture) for each in caption)
                buttons = [*page.locator(".dock .view-tools button").all(), page.locator(".stop-button")]
                assert not [each for each in buttons if any(Box.of(each).overlaps(part) for part in caption)]
        shown.page.emulate_media(forced_colors="active")
        ink, paper, edge = shown.page.locator(".dock .heard p").first.evaluate(
            "(each) => (({color, backgroundColor, borderTopColor}) => [color, backgroundColor, borderTopColor])"
            "(getComputedStyle(each))"
        )
        assert ink != paper != edge


def test_the_editor_shows_a_recording_among_its_files(browser: Browser, tmp_path: Path) -> None:
    file, root = tmp_path / "run.mcap", tmp_path / "root"
    root.mkdir()
    writer = RecordingWriter.watching(file, "walk", DOCUMENT)
    writer.put(Entry("/snapshots", 1, Snapshot.of(short_snapshot(0.0))))
    writer.close()
    parts = patient_parts(Settings(listen=(), connect=(), clock="wall"))
    with editor(root, file, make_parts=parts) as running, monitor_page(browser, running) as shown:
        expect(status(shown)).to_have_text("Recording")


def test_a_recording_shows_what_the_robot_said_and_played(shown: EditorPage, robot: ServedRobot) -> None:
    with robot.client() as client:
        show(shown)
        run(shown)
        shown.button("Record").click()
        shown.button("End the recording").wait_for()
        caption = dock(shown).locator(".heard")
        expect(caption).to_have_text("")
        speech, sounds = client.proxy(SpeechPrx, "Speech"), client.proxy(SoundsPrx, "Sounds")
        speech.say("I see the ball, and walk to it. " * 20)
        sounds.playTone(440.0, 10.0, 0.5)
        comes_true(shown, "() => document.querySelectorAll('.heard p').length === 2")
        comes_true(shown, SAYS)
        sounds.stop()
        speech.stop()
        expect(caption).to_have_text("")
        shown.button("End the recording").click()
        shown.button("Play it").click()
        expect(status(shown)).to_have_text("Recording")
        expect(caption).to_have_text("")
        shown.page.get_by_role("slider", name="Moment of the run").focus()

        def is_seen_at_a_later_moment() -> bool:
            shown.press("ArrowRight")
            comes_true(shown, IS_THERE)  # or the next steps would go beyond the moment before it is shown
            return "“I see the ball" in caption.inner_text() and "♪ tone" in caption.inner_text()

        eventually(is_seen_at_a_later_moment)
