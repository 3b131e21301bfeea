"""The parser of Python code."""

from __future__ import annotations

from codegen.parsing import parse_python
from tests.support.memory import garbage_that_parses


def test_garbage_that_parses_at_its_end_disturbs_no_parser() -> None:
    with garbage_that_parses():
        assert len(parse_python("x = [1, 2]\n" * 2000).body) == 2000
