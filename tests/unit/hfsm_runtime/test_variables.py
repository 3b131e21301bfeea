"""Variables are shown, whatever their values, also while they change."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsm_runtime import Automaton, State
from hfsm_runtime._variables import assign, short_repr, variables_of
from interfaces.jderobot import ImageData, ImageDescription, Time
from tests.support.any_text import any_text
from tests.support.examples import examples
from zenoh_ice import Sample


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
    ("present", "given", "becomes"),
    [
        ((1, 2), [3, 4], (3, 4)),
        ([1, 2], [3, 4], [3, 4]),
        ([(1, 2)], [[3, 4], [5, 6]], [(3, 4), (5, 6)]),
        ({"a": (1,)}, {"a": [2], "b": [3]}, {"a": (2,), "b": [3]}),
        ((), [1], (1,)),
        (None, [1], [1]),
        ((1, 2), 3, 3),
    ],
)
def test_a_tuple_that_is_set_as_a_list_stays_a_tuple(present: object, given: object, becomes: object) -> None:
    value = present

    def code() -> object:
        return value

    automaton = Automaton(id=1, name="a", states=(State(id=1, name="s", initial=True, code=code),))
    assign(automaton, "value", given)
    assert code() == becomes
    assert repr(code()) == repr(becomes)


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


@settings(max_examples=examples(20))
@given(
    st.recursive(
        st.integers() | any_text() | st.floats() | st.binary() | st.none(),
        lambda inner: st.lists(inner) | st.dictionaries(any_text(), inner) | st.tuples(inner, inner),
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


IMAGE = ImageData(ImageDescription(1, 1, 3, "RGB8"), Time(1, 2), b"\x00" * 3)


@pytest.mark.parametrize("value", [IMAGE, Time(3, 4), {1, 2}, frozenset({1}), set(), frozenset()])
def test_structs_and_sets_are_shown_as_python_shows_them(value: object) -> None:
    shown, whole = short_repr(value), repr(value)
    assert shown == (whole if len(whole) <= 120 else whole[:117] + "...")


def test_of_an_image_no_more_is_written_out_than_is_shown() -> None:
    written_out = False

    class Pixels(bytes):
        def __repr__(self) -> str:
            nonlocal written_out
            written_out = True
            return super().__repr__()

    Pixels.__name__, Pixels.__module__ = "bytes", "builtins"

    image = ImageData(ImageDescription(1, 1, 3, "RGB8"), Time(1, 2), Pixels(300))
    assert short_repr(image).startswith("ImageData(description=ImageDescription(width=1, height=1, size=3")
    assert short_repr(Sample(image, 7, 1.5, 0.0)).startswith("<sample 7 at 1.500 s: ImageData(description=")
    assert not written_out


def test_deeply_nested_values_are_walked_no_further_than_they_are_shown() -> None:
    visited = 0

    class Leaf:
        def __repr__(self) -> str:
            nonlocal visited
            visited += 1
            return "x"

    value: object = Leaf()
    for _ in range(5):
        value = [value] * 40
    assert short_repr(value).startswith("[[[[[x, x, x")
    assert visited <= 120


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
