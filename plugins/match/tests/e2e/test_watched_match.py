"""A match that is watched in a browser while it is played, until it is over or somebody ends it."""

from __future__ import annotations

import http.client
import re
import signal
from pathlib import Path
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page, expect

from tests.support.documents import document, state, sub
from tests.support.processes import ComponentProcess, module

pytestmark = [pytest.mark.sim, pytest.mark.slow]


def started(folder: Path, minutes: float) -> ComponentProcess:
    path = folder / "stands.xml"
    path.write_text(document(sub(1, 0, state(1, "only", "pass", initial=True))))
    options = ("--players", "1", "--minutes", str(minutes), "--report", str(folder / "match.html"), "--watch")
    return ComponentProcess(module("visualhfsm", "match", str(path), str(path), *options))


def address_of(process: ComponentProcess) -> str:
    return str(process.wait_for(r"watch it at (http://127\.0\.0\.1:\S+)")[1])


def picture_of(page: Page) -> NDArray[np.uint8]:
    """Return the match as it is seen."""
    picture = cv2.imdecode(np.frombuffer(page.locator(".stage").screenshot(), np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return np.asarray(picture, np.uint8)


def assert_whole_field(page: Page) -> None:
    picture = picture_of(page)
    sides = picture[1:, [0, -1]]  # without what the line of the head leaves of a row of pixels
    assert np.ptp(sides.reshape(-1, 3), axis=0).max() == 0, "no part of the field is cut off"
    assert np.ptp(picture) > 100, "the field is seen"


def orange(page: Page) -> int:
    """Return how many pixels of the match have the color of the ball, and of parts of robots."""
    picture = picture_of(page)
    return cv2.countNonZero(cv2.inRange(picture, np.array([0, 40, 150]), np.array([60, 160, 255])))


def asked(address: str, path: str, host: str = "") -> tuple[int, bytes]:
    """Ask for a path, as a host that one calls so."""
    at = urlsplit(address)
    connection = http.client.HTTPConnection(at.hostname or "", at.port, timeout=10)
    try:
        connection.request("GET", path, headers={"Host": host or at.netloc})
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


def test_a_match_is_seen_as_it_is_played_and_to_the_end(browser: Browser, tmp_path: Path) -> None:
    with started(tmp_path, 0.2) as process, browser.new_context() as context:
        address = address_of(process)
        page = context.new_page()
        troubles: list[str] = []
        page.on("pageerror", lambda error: troubles.append(str(error)))
        page.goto(address)
        expect(page.locator("header [role=status]")).to_have_text("It is being played.")
        expect(page.locator("output")).to_have_text(re.compile(r"^([1-9]|1\d)\.\d s$"))
        expect(page.locator(".stage canvas")).to_have_count(1)
        assert process.wait() == 0, process.output
        expect(page.locator("header [role=status]")).to_have_text("nobody wins")
        expect(page.locator("h1")).to_have_text(re.compile(r"stands\s*0 : 0\s*stands_2"))
        expect(page.locator("output")).to_have_text("12.0 s")
        page.get_by_role("button", name="the end").wait_for()
        page.get_by_label("Time").fill("3")  # all of it is there, without a server
        expect(page.locator("output")).to_have_text("3.0 s")
        for width in (390, 1280):
            page.set_viewport_size({"width": width, "height": 800})
            page.wait_for_function(
                "width => document.querySelector('.stage canvas').clientWidth <= width", arg=width
            )
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            assert_whole_field(page)
        near = []
        views = page.get_by_label("View of the match")
        for view in ("Ball: Around", "Ball: Top", "red1: Behind"):
            views.select_option(label=view)
            near.append(orange(page))
        views.select_option(label="Whole field")
        assert_whole_field(page)
        assert min(near) > 10 * orange(page) > 0
        assert troubles == []
    with pytest.raises(ConnectionRefusedError):
        asked(address, "/")
    assert (tmp_path / "match.html").is_file()


def test_who_has_no_token_sees_nothing_and_an_interrupted_match_ends_with_all(tmp_path: Path) -> None:
    with started(tmp_path, 30.0) as process:
        address = address_of(process)
        path = urlsplit(address).path
        assert asked(address, path)[0] == 200
        assert asked(address, f"{path}film?from=0")[0] == 200
        wrong = ["/", "/film?from=0", f"/{'x' * 43}/", f"{path}../", f"{path}film?from=-1", f"{path}film"]
        assert {asked(address, each)[0] for each in wrong} == {403}
        assert asked(address, path, host="evil.example")[0] == 403
        process.process.send_signal(signal.SIGINT)
        assert process.wait() == 130
    with pytest.raises(ConnectionRefusedError):
        asked(address, path)
