"""The pages that are written as files are accessible, too: runs, drawings and trials."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Annotation, Text
from codegen.messages import Message
from tests.support.browser import new_context
from tests.support.component import dance_and_follow
from tests.support.exported_pages import FOUND, TOO_WIDE, check
from tests.support.places import ROOT
from tests.support.watching import recorded
from visualhfsm._document.serialization import parse
from visualhfsm._drawing.page import drawing_page
from visualhfsm._monitor.run_page import ExportedRun, write_run_page
from visualhfsm.trials import Outcome, Plan, Spread
from visualhfsm.trials._outcomes import Header, Record, StateChange
from visualhfsm.trials._page import trials_page
from visualhfsm.trials._summary import summarize
from visualhfsm.trials._view import view_of


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with new_context(browser) as context:
        yield context.new_page()


def test_the_page_of_a_run_is_accessible(page: Page, tmp_path: Path) -> None:
    text = (ROOT / "behaviors" / "dance_and_follow.xml").read_text("utf-8")
    path = tmp_path / "run.html"
    write_run_page(
        path, ExportedRun("dance", dance_and_follow(), recorded(6.0), parse(text, Message("Cannot read")))
    )
    check(page, path)


def test_the_page_of_a_drawing_is_accessible_whatever_is_selected(page: Page, tmp_path: Path) -> None:
    document = read_document(ROOT / "behaviors" / "dance_and_follow.xml", Diagnostics())
    assert document is not None
    note = "The robot dances when it has followed\nthe ball for ten seconds,\nand no longer."
    (root, *others) = document.automata
    written = (Annotation(id=1, text=Text(note), x=100.0, y=300.0, width=160.0, height=96.0),)
    document = replace(document, automata=(replace(root, annotations=written), *others))
    path = tmp_path / "drawing.html"
    path.write_text(drawing_page("dance_and_follow", document), "utf-8")
    check(page, path)
    for key, text in (("s1", "State followBall"), ("t1", "enough"), ("a1", "The robot dances")):
        page.locator(f"hfsm-canvas [data-key={key}][role=button]").focus()
        page.locator("hfsm-selected-code").get_by_text(text).first.wait_for()
        assert page.evaluate(FOUND) == [], key
    page.locator("hfsm-canvas [data-key=s2]").dblclick()
    page.get_by_text("arm_there").first.wait_for()
    assert page.evaluate(FOUND) == []


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
