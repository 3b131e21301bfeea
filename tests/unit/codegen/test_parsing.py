"""The parser of expressions, where collected garbage parses, too."""

from __future__ import annotations

import ast
import gc
from collections.abc import Callable, Iterator

import pytest

from codegen.parsing import parse_python
from hfsm_runtime.debugger._expressions import Expression, values_in
from tests.support.memory import freeze


class Parses:
    """Garbage that parses when it is collected, as the warnings of some libraries do for their tracebacks."""

    def __init__(self) -> None:
        self.itself = self

    def __del__(self) -> None:
        ast.parse("a + b")


@pytest.fixture
def leave_garbage() -> Iterator[Callable[[], None]]:
    """A function that leaves garbage, which is collected while the next tree is made."""
    thresholds = gc.get_threshold()
    freeze()  # nothing else is looked at in the many collections

    def leave() -> None:
        gc.disable()
        Parses()
        gc.set_threshold(10, 1, 1)
        gc.enable()

    yield leave
    gc.set_threshold(*thresholds)
    gc.collect()


@pytest.mark.parametrize("count", [2, 100, 4000])
def test_garbage_that_parses_at_its_end_disturbs_no_parser(
    leave_garbage: Callable[[], None], count: int
) -> None:
    leave_garbage()
    body = parse_python(f"[{'x, ' * count}]", mode="eval").body
    assert isinstance(body, ast.List)
    assert len(body.elts) == count


def test_conditions_and_shown_values_are_parsed_in_spite_of_it(leave_garbage: Callable[[], None]) -> None:
    chain = " and ".join(["a", *["b[0]"] * 50])
    for _ in range(20):
        leave_garbage()
        assert Expression(chain).names == {"a", "b"}
        leave_garbage()
        assert values_in("f(a, b)", {"a": 1, "b": 2}, 2) == {"a": 1, "b": 2}
