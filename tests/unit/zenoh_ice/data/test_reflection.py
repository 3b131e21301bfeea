"""Interfaces, their bases, and the differences between two versions."""

from __future__ import annotations

import json
from typing import Any

import pytest

from zenoh_ice.data.interface import Interface, Operation
from zenoh_ice.data.reflection import Schema, first_difference, parse_schema
from zenoh_ice.data.values import Struct


class Nothing(Struct):
    pass


def operation(name: str) -> Operation[[], None]:
    return Operation(name, arguments=Nothing, result=Nothing)


def test_lineage_has_each_interface_once_and_itself_first() -> None:
    root = Interface("::t::Root", operations=(operation("a"),))
    left = Interface("::t::Left", bases=(root,), operations=(operation("b"),))
    right = Interface("::t::Right", bases=(root,), operations=(operation("c"),))
    bottom = Interface("::t::Bottom", bases=(left, right))
    assert bottom.lineage == (bottom, left, root, right)
    assert bottom.type_ids == ("::Ice::Object", "::t::Bottom", "::t::Left", "::t::Right", "::t::Root")
    assert set(bottom.all_operations) == {"a", "b", "c"}


def schema(**definitions: dict[str, Any]) -> Schema:
    """Return the schema of an interface L that is described as JSON, with its types."""
    text = json.dumps(
        {
            "interface": "::m::L",
            "definitions": {
                f"::m::{name}": {"module": "", "name": "", "fingerprint": "", **entry}
                for name, entry in ({"L": {"kind": "interface"}} | definitions).items()
            },
        }
    )
    return parse_schema(text)


def struct(**members: str) -> dict[str, Any]:
    return {"kind": "struct", "members": [{"name": name, "type": kind} for name, kind in members.items()]}


def interface(*operations: dict[str, Any]) -> dict[str, Any]:
    return {"kind": "interface", "operations": operations}


GET: dict[str, Any] = {"name": "get", "results": [{"name": "returnValue", "type": "int"}]}
GET_OF: dict[str, Any] = {**GET, "parameters": [{"name": "a", "type": "int"}]}


@pytest.mark.parametrize(
    ("ours", "theirs", "difference"),
    [
        (
            {"S": struct(a="int", b="int", c="int")},
            {"S": struct(a="int", b="long", c="int")},
            "the proxy has `::m::S::b: int` where the servant has `::m::S::b: long`",
        ),
        ({"S": struct(a="int", b="int")}, {"S": struct(a="int")}, "the servant lacks `::m::S::b: int`"),
        ({"S": struct(a="int")}, {"S": struct(a="int", b="int")}, "the proxy lacks `::m::S::b: int`"),
        ({"S": struct(a="int", b="int")}, {"S": struct(b="int", a="int")}, "they are described alike"),
        (
            {"L": interface(GET, {"name": "off"})},
            {"L": interface({"name": "aaa"}, GET_OF)},
            "the proxy lacks `::m::L::aaa(): void`",
        ),
        (
            {"L": interface(GET)},
            {"L": interface(GET_OF)},
            "the proxy has `::m::L::get(): int` where the servant has `::m::L::get(int a): int`",
        ),
        (
            {"L": interface(GET)},
            {"L": interface({**GET, "streamed": True})},
            "the proxy has `::m::L::get(): int` where the servant has `::m::L::get(): int stream`",
        ),
        (
            {"A": {"kind": "class", "bases": ["::m::B"]}, "B": {"kind": "class"}},
            {"A": {"kind": "class"}, "B": {"kind": "class"}},
            "the proxy has `class ::m::A extends ::m::B` where the servant has `class ::m::A`",
        ),
        (
            {"C": {"kind": "enumeration", "enumerators": [{"name": "red", "value": 0}]}},
            {"C": {"kind": "enumeration", "enumerators": [{"name": "red", "value": 1}]}},
            "the proxy has `::m::C::red = 0` where the servant has `::m::C::red = 1`",
        ),
        (
            {"S": struct(a="::m::Q"), "Q": {"kind": "sequence", "element": "int"}},
            {"S": struct(a="::m::Q"), "Q": {"kind": "sequence", "element": "byte"}},
            "the proxy has `::m::S::a: sequence<int>` where the servant has `::m::S::a: sequence<byte>`",
        ),
    ],
)
def test_difference_names_the_first_member_and_what_each_side_has(
    ours: dict[str, Any], theirs: dict[str, Any], difference: str
) -> None:
    assert first_difference(schema(**ours), schema(**theirs)) == difference
