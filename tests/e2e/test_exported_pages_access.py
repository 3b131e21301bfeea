"""The pages that are written as files are accessible, too: runs and drawings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Annotation, Text
from codegen.messages import Message
from tests.support.browser import new_context
from tests.support.component import dance_and_follow
from tests.support.exported_pages import FOUND, check
from tests.support.places import ROOT
from tests.support.watching import recorded
from visualhfsm._document.serialization import parse
from visualhfsm._drawing.page import drawing_page
from visualhfsm._monitor.run_page import ExportedRun, write_run_page


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
