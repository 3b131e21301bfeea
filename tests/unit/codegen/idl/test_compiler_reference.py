from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.examples import examples
from tests.support.slice_agreement import compare_generated
from tests.support.slice_cases import all_cases
from tests.support.slice_compiler import checked, first_error
from tests.support.slice_reference import AVAILABLE, Verdict, reference_verdicts

CASES = all_cases()
needs_reference = pytest.mark.skipif(not AVAILABLE, reason="slice2py of zeroc-ice is not installed")


@pytest.mark.slow
def test_every_case_has_the_verdict_it_is_known_for(tmp_path: Path) -> None:
    wrong = []
    for number, case in enumerate(CASES):
        diagnostics = checked(case.write(tmp_path / str(number)))
        if first_error(diagnostics) != case.ours:
            wrong.append(f"{case.title}: not {case.ours}\n{diagnostics.render()}")
    assert not wrong, "\n".join(wrong)


def test_there_are_cases_for_every_rule_and_few_are_judged_differently() -> None:
    assert len(CASES) >= 300
    assert len({case.title for case in CASES}) == len(CASES)
    assert sum(case.ours != case.reference for case in CASES) <= len(CASES) // 100


@needs_reference
@pytest.mark.slow
def test_the_reference_compiler_says_what_the_cases_say(tmp_path: Path) -> None:
    paths = [case.write(tmp_path / str(number)) for number, case in enumerate(CASES)]
    verdicts = reference_verdicts(paths, tmp_path / "out")
    wrong = [
        f"{case.title}: {verdict}, not {case.reference}"
        for case, verdict in zip(CASES, verdicts, strict=True)
        if verdict != case.reference
    ]
    assert not wrong


@pytest.mark.slow
@needs_reference
def test_generated_files_are_judged_as_by_the_reference(tmp_path: Path) -> None:
    agreement = compare_generated(tmp_path, count=examples(300))
    assert agreement.files >= 100
    assert agreement.verdicts >= 0.995, agreement.report()
    assert agreement.first_lines >= 0.95, agreement.report()


@pytest.mark.parametrize(
    "text",
    [
        "module m { struct a_b { int c; }; };",
        "module m { struct A { int c_d; }; };",
        "module m { struct iceberg { int c; }; };",
        "module m {\nexception A { };\nexception B : A { };\n};",
        "module m { struct A { int Value; }; };",
    ],
)
def test_what_files_in_use_do_is_allowed_beyond_slice_3_7(tmp_path: Path, text: str) -> None:
    path = tmp_path / "main.idl"
    path.write_text(text)
    assert first_error(checked(path)) == Verdict()
