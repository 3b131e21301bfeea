"""Interfaces created at run time from schemas, compared with those generated from the same IDL."""

from __future__ import annotations

import base64
import contextlib
import json
import re
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import interfaces.hfsm
import interfaces.jderobot
import interfaces.nao
from nao_tools import NaoError
from nao_tools._dynamic import Types
from nao_tools._values import FromJson, to_json
from tests.support.any_text import any_text
from tests.support.examples import examples
from tests.support.generated_types import interfaces_of
from tests.support.places import DATA
from tests.support.slice_compiler import imported
from tests.support.wire_values import Desk, pack, plain, struct_values
from zenoh_ice import MarshalException
from zenoh_ice.data.codec import encode
from zenoh_ice.data.interface import OBJECT_INTERFACE, Interface
from zenoh_ice.data.reflection import Schema, parse_schema, schema_of
from zenoh_ice.data.values import TYPE_FIELD
from zenoh_ice.data.wire import decode_error

EVERYTHING = DATA / "slice_output" / "everything" / "everything.idl"
DESK: Any = Desk()


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
    schema = parse_schema(schema_of(interface).as_json())
    types = Types(schema)
    operations = {each.name: each for _, each in schema.operations()}
    assert set(operations) == set(interface.all_operations)
    for name, generated in interface.all_operations.items():
        description = operations[name]
        made = types.operation(description)
        assert (made.idempotent, made.streamed) == (generated.idempotent, generated.streamed)
        assert {each.ice_type_id for each in made.exceptions} == {
            each.ice_type_id for each in generated.exceptions
        }
        for members, ours, theirs in (
            (description.parameters, made.arguments, generated.arguments),
            (description.results, made.result, generated.result),
        ):
            struct: type[msgspec.Struct] = theirs.struct
            value = data.draw(struct_values(struct, DESK))
            payload = encode(value, name)
            arrived = ours.unpack(payload, name, DESK)
            if TYPE_FIELD.encode() in payload:
                continue  # of classes, the schema knows only those that it mentions
            text = json.dumps(to_json(arrived, lambda data: base64.b64encode(data).decode()))
            maker = FromJson(schema, types, DESK.stringToProxy)
            again = [maker.member(each, json.loads(text).get(each.name), each.name) for each in members]
            assert plain(theirs.unpack(pack(ours, tuple(again), name), name, DESK)) == plain(value)


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


def text_of(*operations: dict[str, Any], **definitions: dict[str, Any]) -> str:
    """Return the schema of an interface I with its types, as a servant may send it."""
    entries = {"I": {"kind": "interface", "operations": operations}} | definitions
    named = {
        name if "::" in name else f"::m::{name}": {"module": "m", "name": name, "fingerprint": "", **entry}
        for name, entry in entries.items()
    }
    return json.dumps({"interface": "::m::I", "definitions": named})


def taking(*types: str) -> dict[str, Any]:
    """Return an operation f with parameters of these types."""
    return {"name": "f", "parameters": [{"name": f"p{at}", "type": kind} for at, kind in enumerate(types)]}


def struct(*members: tuple[str, str], kind: str = "struct") -> dict[str, Any]:
    return {"kind": kind, "members": [{"name": name, "type": each} for name, each in members]}


def make_all(text: str) -> Schema:
    schema = parse_schema(text)
    types = Types(schema)
    for _, operation in schema.operations():
        types.operation(operation)
    return schema


def test_a_plain_object_is_an_interface_without_operations() -> None:
    schema = make_all(schema_of(OBJECT_INTERFACE).as_json())
    assert schema.interface == "::Ice::Object"
    assert not list(schema.operations())


def test_an_exception_may_have_members_of_any_name() -> None:
    names = ["self", "args", "what", "members"]
    text = text_of(
        {"name": "f", "exceptions": {"::m::X": ""}},
        X=struct(*((name, "int") for name in names), kind="exception"),
    )
    schema = parse_schema(text)
    ((_, description),) = schema.operations()
    operation = Types(schema).operation(description)
    wire = encode({"exception": "::m::X", "members": dict.fromkeys(names, 3)}, "x")
    error = decode_error(wire, operation.exceptions, "x")
    assert error.__dict__ == dict.fromkeys(names, 3)
    assert "self=3" in str(error)


def test_an_enumeration_without_enumerators_cannot_be_called_with() -> None:
    schema = parse_schema(text_of(taking("::m::E"), E={"kind": "enumeration"}))
    ((_, description),) = schema.operations()
    with pytest.raises(MarshalException, match="at least one"):
        Types(schema).operation(description)


def test_values_beyond_all_measure_are_not_made_up() -> None:
    chain = {f"S{at}": struct(("x", f"::m::S{at - 1}"), ("y", f"::m::S{at - 1}")) for at in range(1, 31)}
    schema = make_all(text_of(taking("::m::S30"), S0=struct(("x", "int")), **chain))
    with pytest.raises(NaoError, match="too many members to leave any out"):
        FromJson(schema, Types(schema), DESK.stringToProxy).zero("::m::S30")


SEQUENCES = {f"Q{at}": {"kind": "sequence", "element": f"::m::Q{at - 1}"} for at in range(1, 50)}
DICTIONARIES = {
    f"D{at}": {"kind": "dictionary", "key": f"::m::D{at - 1}", "value": f"::m::D{at - 1}"}
    for at in range(1, 30)
}
STRUCTS = {f"S{at}": struct(("x", f"::m::S{at - 1}")) for at in range(1, 300)}
LONG = "x" * 9000


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "malformed schema of an interface: "),
        ("[]", "Expected `object`, got `array`"),
        ('{"interface": "::m::I"}', "missing required field `definitions`"),
        ('{"interface": "::m::I", "definitions": {}}', "does not describe its interface: '::m::I'"),
        (text_of(I=struct()), "does not describe its interface: '::m::I'"),
        (text_of(taking("int"), S={"kind": "union"}), "Invalid enum value 'union'"),
        (" " * (1 << 18) + text_of(), "characters; at most 262144 are accepted"),
        (
            json.dumps({"interface": LONG, "definitions": {}}),
            "Expected `str` of length <= 256 at $.interface",
        ),
        # Types that it does not describe.
        (text_of(taking("::m::S")), "does not describe a type: '::m::S'"),
        (text_of(taking("text")), "does not describe a type: 'text'"),
        (text_of(taking("::m::X"), X=struct(kind="exception")), "does not describe a type: '::m::X'"),
        (text_of({"name": "f", "exceptions": {"::m::S": ""}}, S=struct()), "describe an exception: '::m::S'"),
        (text_of(C={"kind": "class", "bases": ["::m::B"]}), "what '::m::C' extends: '::m::B'"),
        (text_of(C={"kind": "class", "bases": ["::m::I"]}), "what '::m::C' extends: '::m::I'"),
        # Types that hold or extend themselves, or go too deep.
        (text_of(S=struct(("s", "::m::S"))), "holds or extends itself, or lies more than 32 deep: '::m::S'"),
        (text_of(Q={"kind": "sequence", "element": "::m::Q"}), "holds or extends itself, or lies"),
        (text_of(C={"kind": "class", "bases": ["::m::C"]}), "holds or extends itself, or lies"),
        (
            text_of(taking("::m::Q49"), Q0={"kind": "sequence", "element": "int"}, **SEQUENCES),
            "lies more than 32 deep: ",
        ),
        (
            text_of(D0={"kind": "dictionary", "key": "int", "value": "int"}, **DICTIONARIES),
            "lies more than 32 deep: ",
        ),
        (text_of(taking("::m::S299"), S0=struct(("x", "int")), **STRUCTS), "lies more than 32 deep: "),
        # Names.
        (text_of(taking("::m::x?*")), "Z' at $.definitions[...].operations[0].parameters[0].type"),
        (text_of(taking("text*")), "Z' at $.definitions[...].operations[0].parameters[0].type"),
        (text_of(**{"::m::__init__": struct()}), "Z' - at `key` in `$.definitions`"),
        (
            text_of(**{f"::m::{LONG}": struct()}),
            "Expected `str` of length <= 256 - at `key` in `$.definitions`",
        ),
        (text_of(S=struct(("x", "int"), ("x", "long"))), "'::m::S' has a name twice: 'x'"),
        (text_of({"name": "f"}, {"name": "f"}), "'::m::I' has a name twice: 'f'"),
        *(
            (text_of(S=struct((name, "int"))), " at $.definitions[...].members[0].name")
            for name in ("__init__", "__class__", "_x", "x_", "a__b", "a b", "", LONG, "\x1b[2J")
        ),
        (
            text_of(E={"kind": "enumeration", "enumerators": [{"name": "x", "value": 10**30}]}),
            "Expected `int` <= 2147483647",
        ),
    ],
    ids=lambda text: text[:24],
)
def test_a_schema_that_makes_no_sense_is_refused(text: str, message: str) -> None:
    with pytest.raises(MarshalException) as caught:
        make_all(text)
    assert message in str(caught.value)
    assert len(str(caught.value)) < 600
    assert str(caught.value).isprintable()


@settings(max_examples=examples(50))
@given(data=st.data())
def test_a_damaged_schema_is_a_schema_or_refused(data: st.DataObject) -> None:
    text = schema_of(data.draw(st.sampled_from(OURS))).as_json()
    at, length = data.draw(st.integers(0, len(text))), data.draw(st.integers(0, 20))
    damaged = text[:at] + data.draw(any_text(max_size=3)) + text[at + length :]
    with contextlib.suppress(MarshalException):
        make_all(damaged)


SHAPES = parse_schema(
    text_of(
        Color={
            "kind": "enumeration",
            "enumerators": [{"name": "Red", "value": 0}, {"name": "Green", "value": 1}],
        },
        Colors={"kind": "sequence", "element": "::m::Color"},
        Line=struct(("color", "::m::Color"), ("name", "string"), ("points", "::m::Points")),
        Point=struct(("x", "double"), ("y", "int")),
        Points={"kind": "sequence", "element": "::m::Point"},
    )
)


def made(text: str, kind: str = "::m::Line") -> tuple[Any, list[str]]:
    maker = FromJson(SHAPES, Types(SHAPES), DESK.stringToProxy)
    return maker.make(kind, json.loads(text), "line"), maker.left_out


def test_what_is_left_out_is_zero_and_reported() -> None:
    value, left_out = made('{"points": [{"x": 1}]}')
    assert to_json(value) == {"color": "Red", "name": "", "points": [{"x": 1.0, "y": 0}]}
    assert left_out == ["line.color", "line.name", "line.points[0].y"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"colour": "Red"}', "line: a Line has no member 'colour'; did you mean color?"),
        ('{"color": "Blue"}', 'line.color: "Blue" is not Color: write one of'),
        ('{"color": true}', "line.color: true is not Color"),
        ('{"points": [{"y": 1.5}]}', "line.points[0].y: 1.5 is not int"),
        (
            '{"points": [{"y": 2147483648}]}',
            "line.points[0].y: 2147483648 is not int: Expected `int` <= 2147483647",
        ),
        ('{"points": {}}', "line.points: {} is not sequence<Point>"),
        ('{"name": 3}', "line.name: 3 is not string"),
        ("[]", "line: [] is not Line, a JSON object with its members"),
    ],
)
def test_what_does_not_fit_is_reported_with_its_path(text: str, message: str) -> None:
    with pytest.raises(NaoError, match=re.escape(message)):
        made(text)


def test_enumerators_are_taken_by_name_and_by_number() -> None:
    assert to_json(made('["Green", 0, "::m::Color::Red"]', "::m::Colors")[0]) == [
        "Green",
        "Red",
        "Red",
    ]
