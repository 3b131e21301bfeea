"""The pages that are written as files are accessible, too: runs, trials, and marks of a class."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Browser, Page

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Annotation, Text
from codegen.messages import Message
from tests.support.browser import AXE, new_context
from tests.support.component import dance_and_follow
from tests.support.places import ROOT
from tests.support.targets import small_targets
from tests.support.watching import recorded
from visualhfsm._drawing_page import drawing_page
from visualhfsm._editing.serialization import parse
from visualhfsm._run_page import Run, write_run_page
from visualhfsm.grading._exercise import read_exercise
from visualhfsm.grading._marks import Earned, Marks
from visualhfsm.grading._page import write_index, write_page
from visualhfsm.grading._submissions import Submission
from visualhfsm.trials import Outcome, Plan, Spread
from visualhfsm.trials._outcomes import Change, Header, Record
from visualhfsm.trials._page import trials_page
from visualhfsm.trials._summary import summarize
from visualhfsm.trials._view import view_of

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
        page.evaluate(AXE.read_text("utf-8"))
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


def test_the_page_of_trials_is_accessible(page: Page, tmp_path: Path) -> None:
    file = tmp_path / "walk.outcomes.jsonl"
    with Record(file, Header("walk.xml", "", {})) as record:
        for number in range(40):
            record.add(
                Outcome(
                    number=number,
                    values={"robot.x": number / 40},
                    success=number < 30,
                    reason="" if number < 30 else "not in goal after 9 s",
                    time=3.0,
                    states="goal",
                    changes=(Change(0.0, "search"),),
                )
            )
    plan = Plan(document="walk.xml", runs=40, scene={"robot.x": Spread(lowest=0, highest=1)})
    path = tmp_path / "trials.html"
    path.write_text(
        trials_page(view_of(plan, summarize(file, ("robot.x",), 40), file, {35: "walk/35.html"})), "utf-8"
    )
    check(page, path)


def test_the_pages_of_marks_are_accessible(page: Page, tmp_path: Path) -> None:
    exercise = read_exercise(ROOT / "exercises" / "ball")
    earned = (
        Earned("It sees the `ball`", 2, 3, "It saw it in 4 of 6 trials"),
        Earned("It waits", 0, 1, "Never"),
    )
    marks = Marks(name="Ana", language="en", earned=earned, error="division by zero in look")
    path = tmp_path / "ana.html"
    write_page(path, exercise, marks)
    check(page, path)
    index = tmp_path / "index.html"
    write_index(index, exercise, "en", [(Submission("Ana", tmp_path / "ana.xml", "ana"), marks)])
    check(page, index)
