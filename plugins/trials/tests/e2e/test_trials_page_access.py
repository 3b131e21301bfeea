"""The page of trials that is written as a file is accessible, and speaks its reader's language."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.support.browser import new_context
from tests.support.exported_pages import TOO_WIDE, check
from visualhfsm.plugins import html_file
from visualhfsm.trials import Outcome, Plan, Spread, StateChange
from visualhfsm_trials._drawn import view_of
from visualhfsm_trials._page import trials_page
from visualhfsm_trials._record import Header, Record
from visualhfsm_trials._summary import summarize
from visualhfsm_trials._view import view as page_view

TRIALS: Final = {
    "name": "walk",
    "share": {"successes": 1, "trials": 2, "lowest": 0.1, "highest": 0.9},
    "planned": 2,
    **dict.fromkeys(("looks", "histograms", "dependences", "maps", "ways", "worst"), ()),
}
"""A series of two trials, as the page of one shows it."""


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with new_context(browser) as context:
        yield context.new_page()


@pytest.fixture(scope="module")
def trials(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of forty trials, whose times and places vary."""
    folder = tmp_path_factory.mktemp("trials")
    file = folder / "walk.outcomes.jsonl"
    with Record(file, Header("walk.xml", "", {})) as record:
        for number in range(1, 41):
            record.look(20 if number <= 20 else 40)
            record.add(
                Outcome(
                    number=number,
                    values={"robot.x": number / 40},
                    success=number < 31,
                    reason="" if number < 31 else "not in goal after 9 s",
                    time=3.0 + number % 7,
                    states="goal",
                    numbers={"distance to the ball at its end": number / 8},
                    changes=(StateChange(0.0, "search"),),
                )
            )
    plan = Plan(document="walk.xml", runs=40, scene={"robot.x": Spread(lowest=0, highest=1)})
    path = folder / "trials.html"
    view = view_of(plan, summarize(file, ("robot.x",), 40), file, {35: "walk/35.html"})
    path.write_text(trials_page(view), "utf-8")
    return path


def test_the_page_of_trials_is_accessible(page: Page, trials: Path) -> None:
    check(page, trials)


def test_the_page_of_trials_fits_a_phone(page: Page, trials: Path) -> None:
    page.set_viewport_size({"width": 390, "height": 800})
    page.goto(trials.as_uri())
    page.get_by_role("heading", level=1).wait_for()
    assert page.evaluate(TOO_WIDE) == []


COUNTS_BESIDE_BARS = """(each) => {
  const boxes = (name) => [...each.querySelectorAll(name)].map((found) => found.getBoundingClientRect());
  const [{top, height}] = boxes("svg");
  const labels = boxes(".counts span").map((box) => ((box.top + box.bottom) / 2 - top) / height);
  const [first] = boxes("g");
  return [labels[0], labels.at(-1), first.height / height];
}"""
"""Where the highest count and 0 stand beside the bars, and how high the first bar is."""


def test_bars_of_trials_have_counts(page: Page, trials: Path) -> None:
    page.goto(trials.as_uri())
    counts = page.get_by_role("region", name="Numbers").locator(".histogram").first
    expect(counts).to_contain_text("Trials")
    labels = counts.locator(".counts span").all_inner_texts()
    assert labels == ["6", "4", "2", "0"]
    assert counts.evaluate(COUNTS_BESIDE_BARS) == pytest.approx([0.0, 1.0, 5 / 6], abs=0.02)


def test_chance_is_named_where_trials_were_added_and_parts_are_small(page: Page, trials: Path) -> None:
    page.goto(trials.as_uri())
    expect(page.get_by_role("region", name="Success", exact=True)).to_contain_text(
        "Trials were added after a look (20, 40): the interval is that of a single look."
    )
    expect(page.get_by_role("region", name="What success depends on")).to_contain_text(
        "Parts with fewer than 20 trials may differ by chance."
    )


def test_trials_are_printed_to_their_end_in_dark_ink(page: Page, trials: Path) -> None:
    page.emulate_media(color_scheme="dark")
    page.goto(trials.as_uri())
    page.get_by_role("heading", level=1).wait_for()
    page.emulate_media(media="print", color_scheme="dark")
    hidden = "() => [...document.querySelectorAll('html, body, .trials-page, main')].map((each) => getComputedStyle(each).overflowY)"
    assert page.evaluate(hidden) == ["visible"] * 4
    red, *_ = page.evaluate("() => getComputedStyle(document.body).color.match(/\\d+/g).map(Number)")
    assert red < 80


def test_the_page_of_trials_speaks_the_language_of_its_reader(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "run.html"
    path.write_text(
        html_file("run", page_view.static / "trials-page.js", (), json.dumps(TRIALS).encode()), "utf-8"
    )
    for language, words in (("es", "1 de 2 ensayos lo consiguen"), ("en", "1 of 2 trials succeed")):
        with new_context(browser, language) as context:
            page = context.new_page()
            page.goto(path.as_uri())
            expect(page.get_by_text(words)).to_be_visible()
            expect(page.locator("html")).to_have_attribute("lang", language)
