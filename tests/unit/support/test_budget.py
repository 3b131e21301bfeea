"""The quick tier stays quick: what its files cost is in a table, whose sum has a limit."""

from __future__ import annotations

import re
from typing import Final

from tests.support.deeds import quick_loops
from tests.support.places import ROOT
from tools.runs.full import QUICK, read_durations

UNKNOWN: Final = 32
"""The processor time of a test whose file has no row yet, in loops."""


def test_the_files_of_the_quick_tier_cost_no_more_than_their_budget() -> None:
    rows = read_durations()
    folders = [ROOT / "tests/doors", ROOT / "tests/unit"]
    files = [path for folder in folders for path in folder.rglob("test_*.py")]
    new = [
        path
        for path in files
        if not any((str(path.relative_to(ROOT)), tier) in rows for tier in (QUICK, "full"))
    ]
    tests = sum(len(re.findall(r"^ *def test_", path.read_text("utf-8"), re.MULTILINE)) for path in new)
    sum_of_rows = sum(loops for (_, tier), loops in rows.items() if tier == QUICK)
    assert sum_of_rows + UNKNOWN * tests <= quick_loops(), (
        "the tests of `make test` cost too much: mark some `slow`, make some cheaper, "
        "or change tests/budget.toml where readers see it"
    )
