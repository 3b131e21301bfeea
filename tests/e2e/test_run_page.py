"""An exported run, opened from disk: it plays without a server and without a network."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
from playwright.sync_api import Browser, Page, expect

from codegen.messages import Message
from tests.support.browser import new_context
from tests.support.component import dance_and_follow
from tests.support.places import ROOT
from tests.support.waiting import until
from tests.support.watching import recorded
from visualhfsm._document.serialization import parse
from visualhfsm._monitor.realm.pictures import encode_jpeg
from visualhfsm._monitor.run_page import ExportedRun, write_run_page

HOSTILE = "</script><img src=x onerror=\"document.title='hostile'\">"

ACTIVE = re.compile(r"\bactive\b")
COLORS = """() => new Promise((resolve) => {
  const {renderer, scene, viewpoints} = document.querySelector("hfsm-robot-view").drawing;
  renderer.render(scene, viewpoints.camera);
  const gl = renderer.getContext();
  const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const pixels = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  resolve(new Set(new Uint32Array(pixels.buffer)).size);
})"""

BRIGHTNESS = """() => {
  const canvas = document.querySelector(".lanes canvas");
  const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const drawn = [...data.keys()].filter((at) => at % 4 === 0 && data[at + 3] > 200);
  return drawn.reduce((sum, at) => sum + data[at], 0) / drawn.length;
}"""
"""The mean red of what is drawn in the lanes."""


def write(path: Path) -> None:
    """Write a page of 10.7 s of following a ball and dancing from 10 s on, with hostile names."""
    text = (ROOT / "behaviors" / "dance_and_follow.xml").read_text("utf-8")
    structure = dance_and_follow()
    structure.automata[4].name = HOSTILE
    log = recorded(10.7)
    write_run_page(path, ExportedRun(HOSTILE, structure, log, parse(text, Message("Cannot read"))))


def test_an_exported_run_plays_from_disk(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "run.html"
    write(path)
    with new_context(browser) as context:
        context.set_offline(True)
        page = context.new_page()
        mishaps: list[str] = []
        page.on("pageerror", lambda error: mishaps.append(str(error)))
        page.on("console", lambda message: mishaps.extend([message.text] if message.type == "error" else []))
        page.on("requestfailed", lambda request: mishaps.append(request.url))
        requests: list[str] = []
        page.on("request", lambda request: requests.append(request.url.partition(":")[0]))
        page.goto(path.as_uri())
        plays(page)
        assert not mishaps
        assert requests.count("file") == 1
        assert set(requests) <= {"data", "file"}


def test_an_exported_run_begins_where_it_has_pictures(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "run.html"
    log = recorded(3.0)
    first = log.at(0.0)
    assert first is not None
    began = msgspec.json.decode(first)["at"]
    jpeg = encode_jpeg(2, 1, bytes(6))
    pictures = {"Camera": [(began + 1.0, jpeg)], "CameraBottom": [(began + 1.5, jpeg)]}
    write_run_page(path, ExportedRun("dance", dance_and_follow(), log, pictures=pictures))
    with new_context(browser) as context:
        page = context.new_page()
        page.goto(path.as_uri())
        expect(page.get_by_role("slider", name="Moment of the run")).to_have_attribute("aria-valuenow", "1.5")
        expect(page.locator("hfsm-camera canvas")).to_have_count(2)
        expect(page.locator(".camera.lost")).to_have_count(0)


def test_five_lanes_and_their_times_are_seen_whole(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "run.html"
    write(path)
    with new_context(browser) as context:
        page = context.new_page()
        page.set_viewport_size({"width": 1280, "height": 800})
        page.goto(path.as_uri())
        lanes = page.locator(".lanes-area")
        expect(page.locator(".lane-names > *")).to_have_count(5)
        assert lanes.evaluate("lanes => lanes.scrollHeight <= lanes.clientHeight")
        change = page.locator(".change-list button").first
        assert change.evaluate("row => row.offsetHeight") <= 30


def test_the_lanes_take_the_colors_of_the_dark_page(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "run.html"
    write(path)
    with new_context(browser) as context:
        page = context.new_page()
        page.goto(path.as_uri())
        page.locator(".lanes canvas").wait_for()
        until(lambda: page.evaluate(BRIGHTNESS) > 180)
        page.get_by_role("button", name="Light or dark").click()
        until(lambda: page.evaluate(BRIGHTNESS) < 100)


def plays(page: Page) -> None:
    expect(page.get_by_role("heading", level=1)).to_have_text(HOSTILE)
    expect(page).to_have_title(HOSTILE)
    following = page.locator("hfsm-canvas [data-key=s1]")
    expect(following).to_have_class(ACTIVE)
    page.wait_for_function("document.querySelector('hfsm-robot-view').drawing?.body?.torso.visible")
    assert page.evaluate(COLORS) > 50
    moment = page.get_by_role("slider", name="Moment of the run")
    moment.focus()
    page.keyboard.press("End")
    page.keyboard.press("Shift+ArrowLeft")
    expect(moment).to_have_attribute("aria-valuenow", "9.6")
    expect(following).to_have_class(ACTIVE)
    page.get_by_role("button", name="Play from here").click()
    expect(page.locator("hfsm-canvas [data-key=s2]")).to_have_class(ACTIVE)
    expect(moment).to_have_attribute("aria-valuenow", "10.6")
