"""The pages that are written as files are accessible, too: runs, trials, and marks of a class."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Browser, Page, expect

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Annotation, Text
from codegen.messages import Message
from tests.support.browser import load_axe, new_context
from tests.support.component import dance_and_follow
from tests.support.places import ROOT
from tests.support.targets import small_targets
from tests.support.watching import recorded
from visualhfsm._document.serialization import parse
from visualhfsm._drawing.page import drawing_page
from visualhfsm._monitor.run_page import Run, write_run_page
from visualhfsm.trials import Outcome, Plan, Spread
from visualhfsm.trials._outcomes import Header, Record, StateChange
from visualhfsm.trials._page import trials_page
from visualhfsm.trials._summary import summarize
from visualhfsm.trials._view import view_of
from visualhfsm_classes._exercise import read_exercise
from visualhfsm_classes._marks import Earned, Marks
from visualhfsm_classes._page import write_index, write_page
from visualhfsm_classes._submissions import Submission

FOUND = """async () => {
  const rules = {"label-content-name-mismatch": {enabled: true}};
  const {violations} = await axe.run(document, {resultTypes: ["violations"], rules});
  return violations.flatMap(({id, nodes}) =>
    nodes.map((node) => `${id}: ${node.html.slice(0, 150)} ${node.failureSummary}`));
}"""


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with new_context(browser) as context:
        yield context.new_page()


def check(page: Page, path: Path) -> None:
    """Open a page in both themes, and look for what is wrong."""
    themes: tuple[Literal["light", "dark"], ...] = ("light", "dark")
    for theme in themes:
        page.emulate_media(color_scheme=theme)
        page.goto(path.as_uri())
        page.get_by_role("heading", level=1).wait_for()
        load_axe(page)
        assert page.evaluate(FOUND) == [], theme
        assert small_targets(page) == []


def test_the_page_of_a_run_is_accessible(page: Page, tmp_path: Path) -> None:
    text = (ROOT / "behaviors" / "dance_and_follow.xml").read_text("utf-8")
    path = tmp_path / "run.html"
    write_run_page(path, Run("dance", dance_and_follow(), recorded(6.0), parse(text, Message("Cannot read"))))
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


def trials_in(folder: Path) -> Path:
    """Write the page of forty trials, whose times and places vary."""
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


def marks_in(folder: Path) -> tuple[Path, Path]:
    """Write the page of a submission, and that of its class."""
    exercise = read_exercise(ROOT / "exercises" / "ball")
    earned = (
        Earned("It sees the `ball`", 2, 3, "It saw everything in 4 of 6 trials"),
        Earned("It waits", 0, 1, "Never"),
    )
    name = "Maximilian_Konstantin_and_everything_in_one_name"
    marks = Marks(name=name, language="en", earned=earned, error="division by zero in look")
    path, index = folder / "ana.html", folder / "index.html"
    write_page(path, exercise, marks)
    write_index(index, exercise, "en", [(Submission("Ana", folder / "ana.xml", "ana"), marks)])
    return path, index


def test_the_page_of_trials_is_accessible(page: Page, tmp_path: Path) -> None:
    check(page, trials_in(tmp_path))


def test_the_pages_of_marks_are_accessible(page: Page, tmp_path: Path) -> None:
    for path in marks_in(tmp_path):
        check(page, path)


TOO_WIDE = """() => [document.documentElement, ...document.querySelectorAll("main, figure, table, section")]
  .filter((each) => each.scrollWidth > each.clientWidth + 1)
  .map((each) => `${each.tagName} ${each.className} ${each.scrollWidth} > ${each.clientWidth}`)"""


def test_pages_of_trials_and_marks_fit_a_phone(page: Page, tmp_path: Path) -> None:
    page.set_viewport_size({"width": 390, "height": 800})
    for path in (trials_in(tmp_path), *marks_in(tmp_path)):
        page.goto(path.as_uri())
        page.get_by_role("heading", level=1).wait_for()
        assert page.evaluate(TOO_WIDE) == [], path.name
    box = page.get_by_role("cell", name="It saw everything").bounding_box()
    assert box is not None
    assert box["width"] > 300, "what happened is too narrow for its words"


COUNTS_BESIDE_BARS = """(each) => {
  const boxes = (name) => [...each.querySelectorAll(name)].map((found) => found.getBoundingClientRect());
  const [{top, height}] = boxes("svg");
  const labels = boxes(".counts span").map((box) => ((box.top + box.bottom) / 2 - top) / height);
  const [first] = boxes("g");
  return [labels[0], labels.at(-1), first.height / height];
}"""
"""Where the highest count and 0 stand beside the bars, and how high the first bar is."""


def test_bars_of_trials_have_counts(page: Page, tmp_path: Path) -> None:
    page.goto(trials_in(tmp_path).as_uri())
    counts = page.get_by_role("region", name="Numbers").locator(".histogram").first
    expect(counts).to_contain_text("Trials")
    labels = counts.locator(".counts span").all_inner_texts()
    assert labels == ["6", "4", "2", "0"]
    assert counts.evaluate(COUNTS_BESIDE_BARS) == pytest.approx([0.0, 1.0, 5 / 6], abs=0.02)


def test_chance_is_named_where_trials_were_added_and_parts_are_small(page: Page, tmp_path: Path) -> None:
    page.goto(trials_in(tmp_path).as_uri())
    expect(page.get_by_role("region", name="Success", exact=True)).to_contain_text(
        "Trials were added after a look (20, 40): the interval is that of a single look."
    )
    expect(page.get_by_role("region", name="What success depends on")).to_contain_text(
        "Parts with fewer than 20 trials may differ by chance."
    )


def test_trials_are_printed_to_their_end_in_dark_ink(page: Page, tmp_path: Path) -> None:
    page.emulate_media(color_scheme="dark")
    page.goto(trials_in(tmp_path).as_uri())
    page.get_by_role("heading", level=1).wait_for()
    page.emulate_media(media="print", color_scheme="dark")
    hidden = "() => [...document.querySelectorAll('html, body, .trials-page, main')].map((each) => getComputedStyle(each).overflowY)"
    assert page.evaluate(hidden) == ["visible"] * 4
    red, *_ = page.evaluate("() => getComputedStyle(document.body).color.match(/\\d+/g).map(Number)")
    assert red < 80
