"""Conditions of breakpoints: what they can express, and that they have no effects."""

from __future__ import annotations

import builtins
import contextlib
import subprocess
from enum import IntEnum
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsm_runtime.debugger._expressions import Expression, ExpressionError, Members, values_in
from interfaces.jderobot import Time
from tests.support.any_text import any_text


def value(text: str, **names: object) -> object:
    return Expression(text).evaluate(names)


class Trap:
    """An object that notices every access."""

    touched: ClassVar[list[str]] = []

    def __getattribute__(self, name):
        Trap.touched.append(name)
        return object.__getattribute__(self, name)

    def __eq__(self, other):
        raise AssertionError("compared")

    def __bool__(self):
        raise AssertionError("asked for its truth")

    def __getitem__(self, key):
        raise AssertionError("subscripted")

    def __contains__(self, key):
        raise AssertionError("searched")

    __hash__ = object.__hash__


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("corner > 2", True),
        ("0 < corner <= 3 and not lost", True),
        ("corner > 5 or name == 'red'", True),
        ("(corner + 1) * 2 // 3 - -1", 3),
        ("7 % 4 + 1 / 2", 3.5),
        ("pose['pan'] < path[-1][0]", True),
        ("name[0] == 'r' and 'ed' in name", True),
        ("ball is None", True),
        ("ball == None", True),
        ("corner != None", True),
        ("1 if lost else 2", 2),
        ("corner in (1, 3)", True),
        ("corner not in [1, 3]", False),
        ("stamp.seconds + stamp.useconds", 12),
        ("self.speed > 0.25", True),
        ("path == [[0, 0], (1.5, 2)]", False),
        ("lost or name", "red"),
    ],
)  # fmt: skip
def test_values(text, expected):
    names = {
        "corner": 3, "lost": False, "name": "red", "ball": None, "pose": {"pan": 0.5}, "path": [(0, 0), (1.5, 2)],
        "stamp": Time(seconds=5, useconds=7), "self": Members(speed=0.3),
    }  # fmt: skip
    found = Expression(text).evaluate(names)
    assert found == expected
    assert type(found) is type(expected)


@settings(deadline=None)
@given(st.integers(-100, 100), st.integers(-100, 100), st.booleans())
def test_it_says_what_python_says(a, b, c):
    for text in (
        "a + b * 2 - (a - b)", "a < b or c", "a <= b and not c", "a if c else b", "-a + +b", "a == b != c",
        "[a, b][c]", "a // (b or 1)", "a % (b or 7)", "c and a", "(a, b) < (b, a)",
    ):  # fmt: skip
        assert value(text, a=a, b=b, c=c) == eval(text, {}, {"a": a, "b": b, "c": c})


@pytest.mark.parametrize(
    ("text", "column", "reason"),
    [
        ("open('x')", 1, r"open\('x'\) is not"),
        ("1 + __import__('os')", 5, r"__import__\('os'\) is not"),
        ("__builtins__", 1, "underscore"),
        ("a.__class__", 1, "__class__"),
        ("a._secret", 1, "_secret"),
        ("2 ** 9", 1, r"2 \*\* 9 is not"),
        ("1 << 9", 1, "1 << 9 is not"),
        ("~a", 1, "~a is not"),
        ("lambda: 1", 1, "lambda: 1 is not"),
        ("[x for x in a]", 1, "x for x in a.* is not"),
        ("a[1:2]", 3, "1:2 is not"),
        ("(a := 1)", 2, "a := 1.* is not"),
        ("f'{a}'", 1, "f.* is not"),
        ("{1: 2}", 1, "1: 2.* is not"),
        ("b'x'", 1, "not allowed"),
        ("1j", 1, "not allowed"),
        ("...", 1, "not allowed"),
        ("a = 1", 3, "yntax"),
        ("a +", 4, "yntax"),
        ("", 1, "yntax"),
        ("import os", 1, "yntax"),
    ],
)
def test_what_is_not_for_expressions_is_refused_with_its_column(text, column, reason):
    with pytest.raises(ExpressionError, match=reason) as refused:
        Expression(text)
    assert str(refused.value).startswith(f"column {column}:")


@pytest.mark.parametrize(
    "text",
    ["1" * 400 + "0" * 100, "(" * 240 + "1" + ")" * 240, "not " * 120 + "a", "-" * 490 + "1", "a" * 501, "a\0b",
     "a == '\u202e'", "a\x1b[2J", "[" * 400, "a." * 150 + "b", "\ud800"],
)  # fmt: skip
def test_what_is_too_much_is_refused(text):
    with pytest.raises(ExpressionError):
        value(text, a=1)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("n * n * n * n * n * n * n * n * n", "too large"),
        ("text * 9", "not a number"),
        ("items * 9", "not a number"),
        ("text + text", "not a number"),
        ("text % 3", "not a number"),
        ("1 / 0", "division by zero"),
        ("missing > 1", "missing has no value"),
        ("items[9]", "no element 9"),
        ("table['x']", "no element 'x'"),
        ("items['x']", "indices"),
        ("table[items]", "unhashable|cannot use"),
        ("text < 1", "not supported"),
        ("text.upper", "cannot be read"),
        ("items.append", "cannot be read"),
        ("stamp.minutes", "no member minutes"),
        ("self.missing", "no missing"),
        ("huge == huge", "too large"),
        ("1 in huge", "too large"),
        ("loop == loop", "too large"),
        ("1 in n", "not iterable"),
    ],
)
def test_what_has_no_value_says_why(text, reason):
    loop: list[object] = []
    loop.append(loop)
    names = {
        "n": 2**100, "text": "abc", "items": [1], "table": {"y": 1}, "stamp": Time(0, 0), "self": Members(),
        "huge": list(range(100_000)), "loop": loop,
    }  # fmt: skip
    with pytest.raises(ExpressionError, match=reason):
        Expression(text).evaluate(names)


@pytest.mark.parametrize(
    "text",
    ["trap", "not trap", "trap == 1", "1 == trap", "trap < 1", "trap.x", "trap[0]", "1 in trap", "trap + 1",
     "-trap", "trap in [1, 2]", "1 in [trap]", "items == items", "table[1]", "1 in table", "trap and 1",
     "1 if trap else 2", "items[trap]"],
)  # fmt: skip
def test_no_other_object_is_asked_anything(text):
    trap = Trap()
    names = {"trap": trap, "items": [trap], "table": {trap: 1}}
    Trap.touched.clear()
    with pytest.raises(ExpressionError):
        Expression(text).holds(names)
    assert Trap.touched == []


def test_keys_that_are_other_objects_are_not_compared():
    class Key:
        def __hash__(self):
            return hash(1)

        def __eq__(self, other):
            raise AssertionError("compared")

    with pytest.raises(ExpressionError, match="a Key is not plain data"):
        value("table[1]", table={Key(): 2})


def test_other_objects_can_be_distinguished_from_none():
    assert Expression("trap is not None and trap != None").holds({"trap": Trap()})


def test_numbers_of_numpy_and_enumerations_count_as_numbers():
    class Color(IntEnum):
        RED = 2

    assert value("a + b + c", a=np.float64(1.5), b=np.int32(2), c=Color.RED) == 5.5
    assert Expression("flag and a > 1").holds({"flag": np.bool_(True), "a": np.float32(1.5)})


def test_properties_of_structures_are_not_run():
    class Sly(Time):
        @property  # type: ignore[misc]
        def seconds(self):  # type: ignore[override]
            raise AssertionError("run")

    with pytest.raises(ExpressionError, match="no member seconds"):
        value("t.seconds", t=Sly(1, 2))


def test_numbers_of_other_types_do_not_run_their_own_code():
    class Sly(float):
        def __float__(self):
            raise AssertionError("run")

        def __gt__(self, other):
            raise AssertionError("run")

    assert value("t > 1", t=Sly(2.0)) is True


@settings(deadline=None)
@given(any_text(max_size=60))
def test_no_text_does_any_harm(text):
    with contextlib.suppress(ExpressionError):
        Expression(text).holds({"a": 1, "b": [1, 2], "self": Members(x=1)})


@settings(deadline=None)
@given(
    st.recursive(
        st.sampled_from(["a", "b", "1", "'x'", "None", "open", "print", "exec", "t"]),
        lambda inner: st.one_of(
            st.tuples(
                inner, st.sampled_from(["+", "-", "*", "//", "**", "<", "==", "in", "is", "and", "or"]), inner
            ).map(" ".join),
            st.tuples(inner, inner).map(lambda pair: f"{pair[0]}({pair[1]})"),
            st.tuples(inner, inner).map(lambda pair: f"({pair[0]})[{pair[1]}]"),
            inner.map(lambda text: f"({text}).real"),
            inner.map(lambda text: f"not ({text})"),
        ),
        max_leaves=12,
    )
)
def test_no_expression_calls_anything(text):
    trap = Trap()
    Trap.touched.clear()
    with contextlib.suppress(ExpressionError):
        Expression(text).holds(
            {"a": 3, "b": {"x": [1]}, "t": trap, "open": builtins.open, "exec": subprocess.run}
        )
    assert Trap.touched == []


def test_the_plain_data_of_any_code_is_found_and_nothing_is_executed() -> None:
    Trap.touched.clear()
    names = {"count": 3, "pose": {"pan": 0.5}, "trap": Trap(), "path": [1, 2], "i": 1}
    code = "self.far(count) or trap.go(pose['pan']) > path[i] + missing[0]"
    assert values_in(code, names, 9) == {"count": 3, "pose['pan']": 0.5, "path[i]": 2}
    assert len(values_in(code, names, 1)) == 1
    assert values_in("count >", names, 9) == {}
    assert not Trap.touched
