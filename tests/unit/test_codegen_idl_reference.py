from __future__ import annotations

from pathlib import Path

import pytest

from codegen.idl.dialect import STRICT_3_7
from tests.support.examples import examples
from tests.support.slice_agreement import compare_generated
from tests.support.slice_cases import Case, all_cases
from tests.support.slice_compiler import checked, first_error
from tests.support.slice_reference import AVAILABLE, Verdict, reference_verdicts

CASES = all_cases()
needs_reference = pytest.mark.skipif(not AVAILABLE, reason="slice2py of zeroc-ice is not installed")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.title)
def test_a_case_has_the_verdict_it_is_known_for(tmp_path: Path, case: Case) -> None:
    diagnostics = checked(case.write(tmp_path))
    assert first_error(diagnostics) == case.ours, diagnostics.render()


def test_there_are_cases_for_every_rule_and_few_are_judged_differently() -> None:
    assert len(CASES) >= 300
    assert len({case.title for case in CASES}) == len(CASES)
    assert sum(case.ours != case.reference for case in CASES) <= len(CASES) // 100


@needs_reference
def test_the_reference_compiler_says_what_the_cases_say(tmp_path: Path) -> None:
    paths = [case.write(tmp_path / str(number)) for number, case in enumerate(CASES)]
    verdicts = reference_verdicts(paths, tmp_path / "out")
    wrong = [
        f"{case.title}: {verdict}, not {case.reference}"
        for case, verdict in zip(CASES, verdicts, strict=True)
        if verdict != case.reference
    ]
    assert not wrong


@needs_reference
def test_strict_3_7_is_the_reference_without_its_flags(tmp_path: Path) -> None:
    paths = [case.write(tmp_path / str(number)) for number, case in enumerate(CASES)]
    wanted = reference_verdicts(paths, tmp_path / "out", options=())
    for case, path, verdict in zip(CASES, paths, wanted, strict=True):
        if case.ours == case.reference:
            diagnostics = checked(path, dialect=STRICT_3_7)
            assert first_error(diagnostics) == verdict, (case.title, diagnostics.render())


@pytest.mark.slow
@needs_reference
def test_generated_files_are_judged_as_by_the_reference(tmp_path: Path) -> None:
    agreement = compare_generated(tmp_path, count=examples(300))
    assert agreement.files >= 100
    assert agreement.verdicts >= 0.995, agreement.report()
    assert agreement.first_lines >= 0.95, agreement.report()


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("module m { struct a_b { int c; }; };", 1),
        ("module m { struct A { int c_d; }; };", 1),
        ("module m { struct iceberg { int c; }; };", 1),
        ("module m {\nexception A { };\nexception B : A { };\n};", 3),
        ("module m { struct A { int Value; }; };", 1),
        ('[["underscore"]]\nmodule m { struct a_b { int c; }; };', None),
        ('[["ice-prefix"]]\nmodule m { struct iceberg { int c; }; };', None),
        ('#include "a.idl"\nmodule m { };', None),
    ],
)
def test_strict_3_7_allows_less(tmp_path: Path, text: str, line: int | None) -> None:
    path = tmp_path / "main.idl"
    path.write_text(text)
    (tmp_path / "a.idl").write_text("module m { struct a_b { int c; }; };")
    assert first_error(checked(path)) == Verdict()
    assert first_error(checked(path, dialect=STRICT_3_7)) == Verdict(("main.idl", line) if line else None)
