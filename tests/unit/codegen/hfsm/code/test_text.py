"""The parser of Python code."""

from __future__ import annotations

import ast
import gc

from codegen.hfsm.code.text import parse_python
from tests.support.memory import freeze


class Parses:
    """Garbage that parses when it is collected, as the warnings of some libraries do for their tracebacks."""

    def __init__(self) -> None:
        self.itself = self

    def __del__(self) -> None:
        ast.parse("a + b")


def test_garbage_that_parses_at_its_end_disturbs_no_parser() -> None:
    freeze()  # nothing else is collected
    gc.disable()
    for _ in range(3):
        Parses()
    gc.enable()
    assert len(parse_python("x = [1, 2]\n" * 2000).body) == 2000
