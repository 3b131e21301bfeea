"""Variables are shown whatever they are, and while they change."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsm_runtime import Automaton, State
from hfsm_runtime.variables import short_repr, variables_of


def test_the_variables_that_code_uses_are_shown() -> None:
    count, unused, module, function = 3, 4, math, len
    later: int

    def code() -> object:
        nonlocal later
        if count > 5:
            later = 1
        return (count, module, function, later)

    found = variables_of(Automaton(id=1, name="a", states=(State(id=1, name="s", initial=True, code=code),)))
    assert found == {"count": "3"}
    assert unused == 4


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.5, "1.5"),
        ("a" * 200, "'" + "a" * 116 + "..."),
        (list(range(100)), repr(list(range(100)))[:117] + "..."),
        (b"\x00" * 1_000_000, repr(b"\x00" * 120)[:117] + "..."),
        ("\ud800", "'\\ud800'"),
        ({"a": [1, {"b": (2,)}]}, "{'a': [1, {'b': (2,)}]}"),
    ],
)
def test_a_repr_is_that_of_python_cut_to_120_characters(value: object, text: str) -> None:
    assert short_repr(value) == text


@given(
    st.recursive(
        st.integers() | st.text() | st.floats() | st.binary() | st.none(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner) | st.tuples(inner, inner),
        max_leaves=20,
    )
)
def test_short_values_are_shown_as_python_shows_them(value: object) -> None:
    shown, whole = short_repr(value), repr(value)
    assert len(shown) <= 120
    if len(whole) <= 120:
        try:
            whole.encode()
        except UnicodeEncodeError:
            return
        assert shown == whole or "..." in shown


def test_objects_whose_repr_fails_or_is_endless_are_shown() -> None:
    class Bad:
        def __repr__(self) -> str:
            raise RuntimeError("no")

    class Worse:
        def __repr__(self) -> str:
            return 3  # type: ignore[return-value]

    endless: list[object] = []
    endless.append(endless)
    assert short_repr(Bad()).startswith("<Bad instance at")
    assert "Worse" in short_repr(Worse())
    assert len(short_repr(endless)) <= 120
    assert len(short_repr(np.zeros((240, 320, 3), np.uint8))) <= 120


def test_a_variable_may_change_while_it_is_shown() -> None:
    values: dict[int, int] = {}
    stop = threading.Event()

    def change() -> None:
        number = 0
        while not stop.is_set():
            number += 1
            values[number % 50] = number
            values.pop((number * 7) % 50, None)

    def code() -> object:
        return values

    automaton = Automaton(id=1, name="a", states=(State(id=1, name="s", initial=True, code=code),))
    thread = threading.Thread(target=change)
    thread.start()
    try:
        for _ in range(2000):
            assert list(variables_of(automaton)) == ["values"]
    finally:
        stop.set()
        thread.join()
