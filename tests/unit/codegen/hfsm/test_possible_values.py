"""What a name may be, and which of its values are plain."""

from __future__ import annotations

import ast

import pytest

from codegen.hfsm._possible_values import (
    MOST_TEXTS,
    NOTHING,
    NUMBER,
    PLAIN,
    READER,
    SELF,
    SENDER,
    UNSURE,
    WHOLE,
    Names,
    Value,
    Values,
    add_values,
    are_plain,
    as_values,
    combined,
    defaults_of,
    texts_of,
)

HEAD = Value("proxy", "Head")


@pytest.mark.parametrize(
    ("given", "known"),
    [
        ([as_values(["a"]), NUMBER, as_values(["b"])], ["a", "b"]),
        ([as_values(["a"]), NOTHING], ["a"]),
        ([as_values(["a"]), PLAIN], []),
        ([UNSURE, as_values(["a"])], []),
        ([as_values(map(str, range(MOST_TEXTS + 1)))], []),
    ],
)
def test_texts_are_known_unless_a_value_is_not(given: list[Values], known: list[str]) -> None:
    names: Names = {}
    for values in given:
        add_values(names, "name", values)
    assert texts_of(names["name"]) == known


def test_many_texts_are_still_plain() -> None:
    names: Names = {}
    add_values(names, "name", as_values(map(str, range(MOST_TEXTS + 1))))
    assert are_plain(names["name"])


@pytest.mark.parametrize(
    ("operands", "result"),
    [
        ([NUMBER, NUMBER], NUMBER),
        ([NUMBER, as_values(["a"])], PLAIN),
        ([NUMBER, UNSURE], UNSURE),
        ([NUMBER, frozenset({HEAD})], UNSURE),
        ([NUMBER, NOTHING], NOTHING),
    ],
)
def test_operations_on_plain_values_are_plain(operands: list[Values], result: Values) -> None:
    assert combined(*operands) == result


@pytest.mark.parametrize(
    ("value", "attribute", "leads"),
    [
        (HEAD, "stop", False),
        (HEAD, "ice_invocationTimeout", False),
        (HEAD, "ice_getCommunicator", True),
        (HEAD, "uncheckedCast", True),
        (HEAD, "__copy__", True),
        (SENDER, "__call__", False),
        (SENDER, "__reduce__", True),
        (SELF, "speed", False),
        (SELF, "__class__", True),
        (SELF, "_hfsm_clock", True),
        (READER, "__reduce__", True),
        (Value("text", "a"), "__reduce__", False),
    ],
)
def test_special_attributes_lead_back_to_a_value(value: Value, attribute: str, leads: bool) -> None:
    assert value.leaks_by(attribute) is leads


def test_a_parameter_without_an_argument_has_its_default() -> None:
    text = "def f(self, a, b=3, /, c='x', *rest, d, e=None, f=[], **more): pass"
    (function,) = ast.parse(text).body
    assert isinstance(function, ast.FunctionDef)
    known = {name: values for name, values in defaults_of(function).items() if values != UNSURE}
    assert known == {"b": WHOLE, "c": as_values(["x"]), "e": NUMBER}
