"""docs/explanation/model-checker.md: its document is checked, and the results are as described."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from codegen.hfsm.codes import Code
from codegen.hfsm.document import Document, Text
from codegen.hfsm.model_checker import check_model, report_model
from tests.support.model_documents import stated
from tests.support.pages import DOCS, sections_of

PAGE = (DOCS / "explanation/model-checker.md").read_text("utf-8")
SECTIONS = {section.title: section for section in sections_of("explanation/model-checker.md")}
PATH = Path("light.xml")
ROWS = re.findall(
    r"^\| `(always|never|eventually)` \| `([^`]+)` \| (?:`(\d+)`)? ?\| (holds|violated) \|$", PAGE, re.M
)


@pytest.fixture
def light() -> Document:
    block = next(block for block in SECTIONS["Properties"].blocks if block.language == "xml")
    assert block.name == PATH.name
    diagnostics = Diagnostics()
    document = parse_document(block.text, PATH, diagnostics)
    assert document is not None
    assert not list(diagnostics)
    return document


def test_the_document_is_without_fault(light: Document) -> None:
    diagnostics = Diagnostics()
    report_model(check_model(light, PATH), diagnostics)
    assert not list(diagnostics)


def test_the_page_has_verdicts() -> None:
    assert len(ROWS) == 11


@pytest.mark.parametrize(("kind", "expression", "within", "verdict"), ROWS)
def test_the_verdicts_are_right(
    light: Document, kind: str, expression: str, within: str, verdict: str
) -> None:
    (result,) = check_model(replace(light, properties=(stated(kind, expression, within),)), PATH).properties
    assert result.verdict == verdict


def test_an_automaton_that_restarts_may_never_be_full(light: Document) -> None:
    root, *others = light.automata
    day, rush_hour = root.states
    restarting = replace(root, states=(day, replace(rush_hour, history=Text("restart"))))
    properties = (stated("eventually", '"rush hour"/full'),)
    (result,) = check_model(
        replace(light, automata=(restarting, *others), properties=properties), PATH
    ).properties
    assert result.verdict == "violated"


def test_every_code_is_explained() -> None:
    codes = {code for code in Code if code[1] == "6"}
    assert set(re.findall(r"^\| ([EWN]6\d\d) \|", PAGE, re.M)) == codes
