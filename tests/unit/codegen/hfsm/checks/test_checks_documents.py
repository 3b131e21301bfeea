"""Documents with one planted fault each are reported at the right line; correct documents are not."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm.codes import Code
from codegen.hfsm.loading import check_document
from tests.support.codegen_command import ROOT
from tests.support.plugins import needs

DOCUMENTS = ROOT / "tests" / "data" / "documents"
HFSM = ROOT / "codegen" / "hfsm"
FAULTY = sorted((DOCUMENTS / "faulty").glob("*.xml"))
CLEAN = sorted((DOCUMENTS / "clean").glob("*.xml"))
BEHAVIORS = sorted((ROOT / "behaviors").glob("*.xml"))

_EXPECTED = re.compile(r"Brings (?P<code>[EWN]\d{3}) in line (?P<line>\d+)\.")


def found_in(path: Path) -> Diagnostics:
    diagnostics = Diagnostics()
    check_document(path, diagnostics)
    return diagnostics


def test_there_are_enough_documents_to_trust_the_checks() -> None:
    assert len(FAULTY) >= 60
    assert len(CLEAN) >= 60


@pytest.mark.slow
@needs("visualhfsm_old_documents")
def test_a_planted_fault_is_found_at_its_line_and_nothing_else() -> None:
    wrong = {}
    for path in FAULTY:
        expected = _EXPECTED.search(path.read_text("utf-8"))
        assert expected is not None, f"the comment in {path.name} says what the document brings"
        found = found_in(path)
        if [(one.code, one.location.line) for one in found] != [(expected["code"], int(expected["line"]))]:
            wrong[path.stem] = found.render()
    assert wrong == {}


@pytest.mark.slow
def test_a_clean_document_brings_nothing() -> None:
    found = {path.stem: found_in(path) for path in (*CLEAN, *BEHAVIORS)}
    unclear = found.pop("team_score")  # three of its automata run code that the model checker cannot follow
    assert {each.code for each in unclear} == {Code.UNCLEAR_CODE}
    assert {stem: each.render() for stem, each in found.items() if len(each)} == {}


def test_every_check_has_a_planted_fault() -> None:
    sources = (
        path.read_text("utf-8")
        for path in [*(HFSM / "_checks").glob("*.py"), HFSM / "model_checker" / "_checker.py"]
    )
    codes = {Code[name] for source in sources for name in re.findall(r"\bCode\.([A-Z]\w+)", source)}
    planted = Counter(path.name[:4].upper() for path in FAULTY)
    beside = {Code.HIDDEN_INTERFACES}  # its fault is a file that would hide them from all documents here
    assert {code for code in codes if code[1] == "5"} - beside <= planted.keys()
