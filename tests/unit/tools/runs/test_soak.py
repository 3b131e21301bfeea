"""A soak in parts: what is kept, what is left, and what came of each."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Final

import pytest

from tests.support.places import ROOT
from tools.runs.soak import Soak, all_parts

PYTEST: Final = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir=."]
CODE: Final = "import os\ndef test_soaks(): assert os.environ['TEST_SOAK'] == '1'\n"


@pytest.fixture
def parts(tmp_path: Path) -> dict[str, list[str]]:
    codes = {"right": CODE, "wrong": "def test_fails(): assert False\n"}
    for name, code in codes.items():
        (tmp_path / f"test_{name}.py").write_text(code)
    return {name: [*PYTEST, str(tmp_path / f"test_{name}.py")] for name in codes}


@pytest.mark.slow
def test_it_goes_on_with_what_is_left_and_shows_all(tmp_path: Path, parts: dict[str, list[str]]) -> None:
    page = tmp_path / "soak.md"

    def soak(commit: str = "c0ffee") -> Soak:
        return Soak(parts, tmp_path / "kept results", page, commit)

    first = soak()
    assert first.left() == ["right", "wrong"]
    first.run(["right"])
    second = soak()
    assert second.left() == ["wrong"]
    second.run(second.left())
    assert {part: (result.tests, result.failed) for part, result in soak().results.items()} == {
        "right": (1, 0),
        "wrong": (1, 1),
    }
    assert soak("decaf").left() == ["right", "wrong"]
    rows = [line.split(" | ")[:3] for line in page.read_text().splitlines()[6:]]
    assert rows == [["| right", "1", "0"], ["| wrong", "0", "1"]]


@pytest.mark.slow
def test_a_part_that_takes_too_long_or_has_no_report_has_failed(tmp_path: Path) -> None:
    hangs = [sys.executable, "-c", "import time; time.sleep(600)"]
    soak = Soak({"hangs": hangs}, tmp_path / "kept", tmp_path / "soak.md", "c0ffee", limit=0.1)
    soak.run(["hangs"])
    assert (soak.results["hangs"].tests, soak.results["hangs"].failed) == (0, 1)


@pytest.mark.slow
def test_every_test_is_in_one_part() -> None:
    files = [each for command in all_parts().values() for each in command if re.fullmatch("tests/.*py", each)]
    assert sorted(files) == sorted(
        path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("test_*.py")
    )
