"""The promises of docs/explanation/robot-safety.md are held by tests that exist."""

from __future__ import annotations

import re

from tests.support.places import ROOT

PAGE = ROOT / "docs" / "explanation" / "robot-safety.md"


def test_each_promise_names_tests_that_exist() -> None:
    rows = re.findall(r"^\| (?!promise|-)(.*?) \| (.*) \|$", PAGE.read_text("utf-8"), re.M)
    code = "\n".join(file.read_text("utf-8") for file in (ROOT / "tests").rglob("test_*.py"))
    defined = set(re.findall(r"^\s*(?:def|class) (\w+)", code, re.M))
    assert len(rows) > 20
    for promise, tests in rows:
        named = re.findall(r"`(\w+)`", tests)
        assert named, promise
        assert set(named) <= defined, promise
