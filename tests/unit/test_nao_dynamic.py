"""Interfaces made at run time from canonical definitions, beside those that codegen made of the same IDL."""

from __future__ import annotations

import base64
import contextlib
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import interfaces.hfsm
import interfaces.jderobot
import interfaces.nao
from deploy.nao.definition_parser import parse_definition
from deploy.nao.definitions import Named, Sequence
from deploy.nao.dynamic import Types
from deploy.nao.errors import UsageError
from deploy.nao.values import FromJson, to_json
from tests.support.generated_types import modules_of
from tests.support.slice_compiler import imported
from tests.support.wire_values import Desk, plain, struct_values
from zenoh_ice import MarshalException
from zenoh_ice.operation import Interface
from zenoh_ice.wire.codec import encode
from zenoh_ice.wire.errors import decode_error
from zenoh_ice.wire.values import TYPE_FIELD

EVERYTHING = Path(__file__).parents[1] / "data" / "slice_output" / "everything" / "everything.idl"
DESK: Any = Desk()


def interfaces_of(package: Any) -> list[Interface]:
    found = (value for module in modules_of(package) for value in vars(module).values())
    return list({each.type_id: each for each in found if isinstance(each, Interface)}.values())


OURS = [
    each
    for package in (interfaces.hfsm, interfaces.jderobot, interfaces.nao)
    for each in interfaces_of(package)
]


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Interface]]:
    sources = {"everything.idl": EVERYTHING.read_text()}
    with imported(tmp_path_factory.mktemp("everything"), "everything_dynamic", sources) as package:
        yield interfaces_of(package)


def hold_alike(interface: Interface, data: st.DataObject) -> None:
    """Check that values of every operation mean the same on both sides, on the wire and in JSON."""
    definitions = parse_definition(interface.definition)
    types = Types(definitions)
    assert set(definitions.operations) == set(interface.all_operations)
    for name, generated in interface.all_operations.items():
        signature = definitions.operations[name]
        made = types.operation(signature)
        assert (made.idempotent, made.streamed) == (generated.idempotent, generated.streamed)
        assert {each.ice_type_id for each in made.exceptions} == {
            each.ice_type_id for each in generated.exceptions
        }
        for members, ours, theirs in (
            (signature.parameters, made.arguments, generated.arguments),
            (signature.results, made.result, generated.result),
        ):
            value = data.draw(struct_values(theirs.struct, DESK))
            payload = encode(value, name)
            arrived = ours.unpack(payload, name, DESK)
            if TYPE_FIELD.encode() in payload:
                continue  # of classes, the definition knows only those that it mentions
            text = json.dumps(to_json(arrived, lambda data: base64.b64encode(data).decode()))
            maker = FromJson(definitions, types, DESK.stringToProxy)
            again = [maker.make(each.type, json.loads(text).get(each.name), each.name) for each in members]
            assert plain(theirs.unpack(ours.pack(tuple(again), name), name, DESK)) == plain(value)


@pytest.mark.parametrize("interface", OURS, ids=lambda each: each.type_id)
@settings(max_examples=2, deadline=None)
@given(data=st.data())
def test_our_interfaces_are_made_as_codegen_makes_them(interface: Interface, data: st.DataObject) -> None:
    hold_alike(interface, data)


@settings(max_examples=1, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_everything_of_slice_is_made_as_codegen_makes_it(
    everything: list[Interface], data: st.DataObject
) -> None:
    for interface in everything:
        hold_alike(interface, data)


def make_all(definition: str) -> None:
    definitions = parse_definition(definition)
    types = Types(definitions)
    for signature in definitions.operations.values():
        types.operation(signature)


def test_an_exception_may_have_members_of_any_name() -> None:
    names = ["self", "args", "what", "members"]
    lines = ["exception ::a::X", "interface ::a::I", "::a::I::f(): void throws ::a::X"]
    definitions = parse_definition("\n".join([*lines, *(f"::a::X::{name}: int" for name in names)]))
    operation = Types(definitions).operation(definitions.operations["f"])
    wire = encode({"exception": "::a::X", "members": dict.fromkeys(names, 3)}, "x")
    error = decode_error(wire, operation.exceptions, "x")
    assert error.__dict__ == dict.fromkeys(names, 3)
    assert "self=3" in str(error)


def test_an_enumeration_without_enumerators_cannot_be_called_with() -> None:
    definitions = parse_definition("enum ::a::E\ninterface ::a::I\n::a::I::f(::a::E e): void")
    operation = Types(definitions).operation(definitions.operations["f"])
    with pytest.raises(MarshalException, match="at least one"):
        operation.arguments.unpack(b"\x81\xa1e\x01", "x")


def test_values_beyond_all_measure_are_not_made_up() -> None:
    lines = ["struct ::a::S0", "::a::S0::x: int", "interface ::a::I", "::a::I::f(::a::S40 s): void"]
    for number in range(1, 41):
        lines.append(f"struct ::a::S{number}")
        lines += [f"::a::S{number}::{name}: ::a::S{number - 1}" for name in "xy"]
    definitions = parse_definition("\n".join(lines))
    types = Types(definitions)
    types.operation(definitions.operations["f"])
    with pytest.raises(UsageError, match="too many members to leave any out"):
        FromJson(definitions, types, DESK.stringToProxy).zero(Named("::a::S40"))


@pytest.mark.parametrize("line", [f"::a::E::x = {'9' * 200}", f"::a::E::x = 1 {'y' * 9000}"])
def test_what_is_too_long_is_refused_with_its_beginning(line: str) -> None:
    with pytest.raises(
        MarshalException, match=r"(a name is too long|' is no number), in '::a::E::x = "
    ) as caught:
        parse_definition(f"enum ::a::E\n{line}")
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize("name", ["__init__", "__class__", "_x", "x_", "a__b"])
def test_a_name_that_means_something_in_python_is_refused(name: str) -> None:
    with pytest.raises(MarshalException, match="neither a name nor a sign of Slice"):
        parse_definition(f"struct ::a::S\n::a::S::{name}: int")


PIECES = [
    "::",
    "a",
    "::a",
    "::a::b",
    "(",
    ")",
    ":",
    ",",
    "<",
    ">",
    "*",
    "=",
    " ",
    "\n",
    "1",
    "sequence",
    "enum",
    "dictionary",
    "optional",
    "struct",
    "class",
    "exception",
    "interface",
    "extends",
    "throws",
    "int",
    "::a::b: ",
]


@given(st.lists(st.sampled_from(PIECES), max_size=40).map("".join) | st.text(max_size=60))
def test_any_text_is_a_definition_or_refused(text: str) -> None:
    with contextlib.suppress(MarshalException):
        make_all(text)


@given(data=st.data())
def test_a_damaged_definition_is_a_definition_or_refused(data: st.DataObject) -> None:
    text = data.draw(st.sampled_from(OURS)).definition
    at, length = data.draw(st.integers(0, len(text))), data.draw(st.integers(0, 20))
    damaged = text[:at] + data.draw(st.text(max_size=3)) + text[at + length :]
    with contextlib.suppress(MarshalException):
        make_all(damaged)


@pytest.mark.parametrize(
    ("definition", "told"),
    [
        (
            "struct ::m::S\n::m::S::s: ::m::S\ninterface ::m::I\n::m::I::f(::m::S s): void",
            "does not tell what ::m::S",
        ),
        ("class ::m::C extends ::m::C\ninterface ::m::I\n::m::I::f(::m::C c): void", "extends ::m::C"),
        (
            "interface ::m::I\n::m::I::f(" + "sequence<" * 50 + "int" + ">" * 50 + " s): void",
            "nested too deeply",
        ),
        ("interface ::m::I\n::m::I::f(text t): void", "'text' is no type"),
        ("::m::I::f(): void", "there is no interface '::m::I'"),
        ("interface ::m::I?", "neither a name nor a sign"),
    ],
)
def test_a_definition_that_makes_no_sense_is_refused(definition: str, told: str) -> None:
    with pytest.raises(MarshalException, match=re.escape(told)):
        make_all(definition)


SHAPES = """\
::m::Color::Green = 1
::m::Color::Red = 0
::m::Line::color: ::m::Color
::m::Line::name: string
::m::Line::points: sequence<::m::Point>
::m::Point::x: double
::m::Point::y: int
enum ::m::Color
struct ::m::Line
struct ::m::Point
"""


def made(text: str, kind: Any = None) -> tuple[Any, list[str]]:
    definitions = parse_definition(SHAPES)
    maker = FromJson(definitions, Types(definitions), DESK.stringToProxy)
    return maker.make(kind or Named("::m::Line"), json.loads(text), "line"), maker.left_out


def test_what_is_left_out_is_zero_and_told() -> None:
    value, left_out = made('{"points": [{"x": 1}]}')
    assert to_json(value) == {"color": "Red", "name": "", "points": [{"x": 1.0, "y": 0}]}
    assert left_out == ["line.color", "line.name", "line.points[0].y"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('{"colour": "Red"}', "line: a Line has no member 'colour'; did you mean color?"),
        ('{"color": "Blue"}', 'line.color: "Blue" is no Color: write one of'),
        ('{"color": true}', "line.color: true is no Color"),
        ('{"points": [{"y": 1.5}]}', "line.points[0].y: 1.5 is no int"),
        ('{"points": [{"y": 2147483648}]}', "line.points[0].y: 2147483648 is not between -2147483648 and"),
        ('{"points": {}}', "line.points: {} is no sequence<Point>"),
        ('{"name": 3}', "line.name: 3 is no string"),
        ("[]", "line: [] is no Line, a JSON object with its members"),
    ],
)
def test_what_does_not_fit_is_told_with_its_path(text: str, told: str) -> None:
    with pytest.raises(UsageError, match=re.escape(told)):
        made(text)


def test_enumerators_are_taken_by_name_and_by_number() -> None:
    assert to_json(made('["Green", 0, "::m::Color::Red"]', Sequence(Named("::m::Color")))[0]) == [
        "Green",
        "Red",
        "Red",
    ]
