"""The pages of marks, which are written as files, are accessible and fit a phone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from tests.support.browser import new_context
from tests.support.exported_pages import TOO_WIDE, check
from tests.support.places import ROOT
from visualhfsm_classes._exercise import read_exercise
from visualhfsm_classes._marks import Earned, Listed, Marks
from visualhfsm_classes._page import index_page, write_page


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with new_context(browser) as context:
        yield context.new_page()


def marks_in(folder: Path) -> tuple[Path, Path]:
    """Write the page of a submission, and that of its class."""
    exercise = read_exercise(ROOT / "exercises" / "ball")
    earned = (
        Earned("It sees the `ball`", 2, 3, "It saw everything in 4 of 6 trials"),
        Earned("It waits", 0, 1, "Never"),
    )
    name = "Maximilian_Konstantin_and_everything_in_one_name"
    marks = Marks(
        name=name,
        language="en",
        earned=earned,
        error="division by zero in look",
        digest="0123456789ab",
        handed_in="2026-11-30 07:12:05+01:00",
    )
    path, index = folder / "ana.html", folder / "index.html"
    write_page(path, exercise, marks)
    rows = [
        Listed("Ana", "ana", f"{marks.points:g}", marks.summary),
        Listed("Ben", "ben", "three", "Never", "no document now"),
    ]
    index.write_text(index_page(exercise, "en", rows), "utf-8")
    return path, index


def test_the_pages_of_marks_are_accessible(page: Page, tmp_path: Path) -> None:
    for path in marks_in(tmp_path):
        check(page, path)


def test_the_pages_of_marks_fit_a_phone(page: Page, tmp_path: Path) -> None:
    page.set_viewport_size({"width": 390, "height": 800})
    for path in marks_in(tmp_path):
        page.goto(path.as_uri())
        page.get_by_role("heading", level=1).wait_for()
        assert page.evaluate(TOO_WIDE) == [], path.name
    box = page.get_by_role("cell", name="It saw everything").bounding_box()
    assert box is not None
    assert box["width"] > 300, "what happened is too narrow for its words"
