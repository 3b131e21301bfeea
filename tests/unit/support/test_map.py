"""tests/support/README.md: a newcomer finds each module there, in one group."""

from __future__ import annotations

import re

from tests.support.places import ROOT

SUPPORT = ROOT / "tests" / "support"


def test_the_map_has_each_module_once() -> None:
    named = re.findall(r"`(\w+)`", (SUPPORT / "README.md").read_text("utf-8"))
    assert sorted(named) == sorted({path.stem for path in SUPPORT.glob("*.py")} - {"__init__"})
