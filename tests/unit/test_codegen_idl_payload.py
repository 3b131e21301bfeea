"""Reading payloads by the types of a file: what the runtime takes is taken, what it refuses is refused."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import msgpack
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.idl import ast
from codegen.idl.describe import describe
from codegen.idl.example import ExampleTooLargeError, example_of
from codegen.idl.loading import UnknownNameError, find_definition, load_definitions
from codegen.idl.payload_reader import PayloadError, PayloadReader
from codegen.idl.wire_shape import Part, holds_bytes
from tests.support.slice_compiler import imported
from zenoh_ice import MarshalException
from zenoh_ice._codec import Codec
from zenoh_ice._wire import encode_error

TEXT = """\
/** Things that travel. */
module m {
  enum Color { Red, Green = 5 };
  sequence<byte> Bytes;
  sequence<string> Names;
  dictionary<short, double> Table;
  struct Inner {
    /** Whether it is so. */
    bool flag;
    byte small;
  };
  sequence<Inner> Inners;
  struct Everything {
    long number;
    float ratio;
    string name;
    Color color;
    Bytes data;
    Names names;
    Table table;
    Inner inner;
    Inners many;
  };
  class Node { int id; Node next; };
  class Leaf extends Node { string label; };
  exception Bad { string why; };
  exception Worse extends Bad { int much; };
  interface Device {
    /** Do it.
     * @param much how much of it
     */
    idempotent Everything get(int much, out Node node) throws Bad;
    ["stop"] idempotent void halt();
  };
  interface Child extends Device {};
};
"""


class Definitions(dict[str, ast.Definition]):
    """With a representation that a failed property test can print."""

    def __repr__(self) -> str:
        return ", ".join(self)


@pytest.fixture(scope="module")
def definitions(tmp_path_factory: pytest.TempPathFactory) -> Definitions:
    path = tmp_path_factory.mktemp("idl") / "main.idl"
    path.write_text(TEXT)
    diagnostics = Diagnostics()
    found = load_definitions([path], [], diagnostics)
    assert not diagnostics.has_errors, diagnostics.render()
    return Definitions(found)


@pytest.fixture(scope="module")
def api(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    with imported(tmp_path_factory.mktemp("api"), "payload_api", {"main.idl": TEXT}):
        import payload_api.m as api  # type: ignore[import-not-found]

        yield api


def read(definitions: dict[str, ast.Definition], name: str, payload: bytes, part: Part = Part.RESULT) -> Any:
    return PayloadReader(payload, definitions).read(find_definition(name, definitions), part)


EVERYTHING = {
    "number": -(1 << 63),
    "ratio": 0.5,
    "name": "ñ",
    "color": 5,
    "data": b"\x00\xff",
    "names": ["a", ""],
    "table": {-7: 1.5},
    "inner": {"flag": True, "small": 255},
    "many": [{"flag": False, "small": 0}],
}


def test_a_payload_is_read_as_json(definitions: dict[str, ast.Definition]) -> None:
    assert read(definitions, "Everything", msgpack.packb(EVERYTHING)) == {
        **EVERYTHING,
        "color": "Green",
        "data": "AP8=",
        "table": {"-7": 1.5},
    }


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"number": 1 << 63}, "$.number: 9223372036854775808 is out of the range of long"),
        ({"number": True}, "$.number: expected an integer, found a bool"),
        ({"ratio": "0.5"}, "$.ratio: expected a float, found a string"),
        ({"color": 1}, "$.color: 1 is no value of ::m::Color"),
        ({"data": "text"}, "$.data: expected bytes, found a string"),
        ({"names": ["a", 3]}, "$.names[1]: expected a string, found an integer"),
        ({"table": {40000: 1.0}}, "$.table.keys[0]: 40000 is out of the range of short"),
        ({"table": {7: None}}, "$.table[7]: expected a float, found nil"),
        ({"inner": {"flag": True}}, "$.inner: `small` is missing"),
        ({"many": [{"flag": 1, "small": 0}]}, "$.many[0].flag: expected a bool, found an integer"),
    ],
)
def test_what_does_not_fit_is_told_with_its_place(
    definitions: dict[str, ast.Definition], change: dict[str, object], message: str
) -> None:
    with pytest.raises(PayloadError) as caught:
        read(definitions, "Everything", msgpack.packb({**EVERYTHING, **change}))
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("payload", "message"),
    [
        (b"", "the payload ends here"),
        (b"\xdf\xff\xff\xff\xff", "$: the payload ends here"),
        (b"\x81\xdb\xff\xff\xff\xffab", "$: the payload ends inside of this value"),
        (b"\x81\xa1\xff\x01", "$: the text is not UTF-8"),
        (b"\x81\xdd\xff\xff\xff\xff", "$: expected a string, found an array"),
        (b"\x81\xa1x" + b"\x91" * 100_000, "$: nested too deeply"),
        (b"\xc1", "$: expected a map, found an invalid byte"),
        (msgpack.packb({**EVERYTHING}) + b"\x00", "$: 1 bytes follow the value"),
    ],
)
def test_hostile_payloads_are_refused(
    definitions: dict[str, ast.Definition], payload: bytes, message: str
) -> None:
    with pytest.raises(PayloadError, match=message.replace("$", r"\$")):
        read(definitions, "Everything", payload)


def test_values_of_classes_are_what_they_say(definitions: dict[str, ast.Definition]) -> None:
    node = {"@type": "::m::Node", "id": 1, "next": None}
    leaf = {"@type": "::m::Leaf ::m::Node", "id": 2, "next": node, "label": "x"}
    unknown = {"@type": "::m::New ::m::Node", "id": 3, "next": None}
    for value in (None, node, leaf, unknown):
        assert read(definitions, "Node", msgpack.packb(value)) == value
    with pytest.raises(PayloadError, match=r"`::m::Node` is no ::m::Leaf"):
        read(definitions, "Leaf", msgpack.packb(node))
    for _ in range(1000):
        node = {"@type": "::m::Node", "id": 1, "next": node}
    with pytest.raises(PayloadError, match="nested too deeply"):
        read(definitions, "Node", msgpack.packb(node))


def test_members_that_the_type_does_not_have_are_told(definitions: dict[str, ast.Definition]) -> None:
    definition = find_definition("Inner", definitions)
    reader = PayloadReader(msgpack.packb({"flag": True, "new": [{}], "small": 1}), {})
    assert reader.read(definition) == {"flag": True, "small": 1}
    assert reader.ignored == ["$.new"]


def test_arguments_and_results_of_an_operation(definitions: dict[str, ast.Definition]) -> None:
    arguments = msgpack.packb({"much": 3})
    assert read(definitions, "Device::get", arguments, Part.ARGUMENTS) == {"much": 3}
    result = read(definitions, "Child.get", msgpack.packb({"returnValue": EVERYTHING, "node": None}))
    assert list(result) == ["returnValue", "node"]


def test_an_exception_is_read_as_the_runtime_sends_it(
    definitions: dict[str, ast.Definition], api: ModuleType
) -> None:
    bad = {"exception": "::m::Bad", "members": {"why": "so"}}
    worse = {"exception": "::m::Worse", "bases": ["::m::Bad"], "members": {"why": "so", "much": 3}}
    assert read(definitions, "Bad", encode_error(api.Bad(why="so"))) == bad
    for name in ("Bad", "Worse"):
        assert read(definitions, name, encode_error(api.Worse(why="so", much=3))) == worse


def test_an_exception_that_no_file_defines_is_read_as_what_it_extends(
    definitions: dict[str, ast.Definition],
) -> None:
    newer = {"exception": "::m::New", "bases": ["::m::Bad"], "members": {"why": "so", "more": 1}}
    reader = PayloadReader(msgpack.packb(newer), definitions)
    assert reader.read(definitions["::m::Bad"]) == {**newer, "members": {"why": "so"}}
    assert reader.ignored == ["$.members.more"]


@pytest.mark.parametrize(
    ("payload", "message"),
    [
        ({}, "`exception` is missing"),
        ({"why": "so"}, "`exception` must come first"),
        ({"exception": "::m::Bad"}, "`why` is missing"),
        ({"exception": "::m::Bad", "members": {"why": 1}}, "$.members.why: expected a string"),
        ({"exception": "::m::Bad", "bases": [1]}, "$.bases: expected a string"),
        ({"exception": "::zenoh_ice::TimeoutException", "message": ""}, "is no ::m::Bad"),
        ({"exception": "::m::Node", "members": {"why": "so"}}, "`::m::Node` is no ::m::Bad"),
    ],
)
def test_what_is_no_such_exception_is_refused(
    definitions: dict[str, ast.Definition], payload: dict[str, object], message: str
) -> None:
    with pytest.raises(PayloadError, match=re.escape(message)):
        read(definitions, "Bad", msgpack.packb(payload))


def test_the_example_of_an_exception_is_what_the_runtime_sends(
    definitions: dict[str, ast.Definition], api: ModuleType
) -> None:
    worse = definitions["::m::Worse"]
    assert msgpack.packb(example_of(worse)) == encode_error(api.Worse(why="text", much=3))
    text = describe(worse)
    assert '  exception  "::m::Worse" or ' in text
    assert '  bases      array of what that extends, the nearest first: "::m::Bad"\n' in text
    assert "  members    a map\n    why   string\n    much  integer of 32 bits\n" in text


def values() -> st.SearchStrategy[Any]:
    """Values that fit, nearly fit, or do not fit at all."""
    inner = st.fixed_dictionaries({"flag": st.booleans(), "small": st.integers(0, 256)})
    members: dict[str, st.SearchStrategy[Any]] = {
        "number": st.integers(-(1 << 63), (1 << 64) - 1),
        "ratio": st.floats() | st.integers(-9, 9),
        "name": st.text(max_size=3),
        "color": st.integers(-1, 6),
        "data": st.binary(max_size=3) | st.text(max_size=1),
        "names": st.lists(st.text(max_size=2), max_size=2),
        "table": st.dictionaries(st.integers(-40_000, 40_000), st.floats(), max_size=2),
        "inner": inner | st.none(),
        "many": st.lists(inner, max_size=2),
    }
    return st.fixed_dictionaries(members, optional={"other": st.integers(0, 300)})


@settings(max_examples=300, deadline=None)
@given(value=values(), cut=st.integers(0, 40), junk=st.binary(max_size=2))
def test_it_takes_what_the_runtime_takes(
    definitions: dict[str, ast.Definition], api: ModuleType, value: dict[str, Any], cut: int, junk: bytes
) -> None:
    payload = msgpack.packb(value)
    if cut < 10:
        payload = payload[: len(payload) - cut - 1] + junk
    try:
        Codec(api.Everything).unpack(payload, "it")
        taken = True
    except MarshalException:
        taken = False
    try:
        json.dumps(read(definitions, "Everything", payload), allow_nan=False)
        read_it = True
    except PayloadError:
        read_it = False
    assert read_it == taken


@given(payload=st.binary(max_size=60))
def test_any_bytes_are_read_or_refused(definitions: dict[str, ast.Definition], payload: bytes) -> None:
    for name in ("Everything", "Node", "Names", "Device::get", "Worse"):
        with suppress(PayloadError):
            read(definitions, name, payload)


def test_examples_are_of_their_type(definitions: dict[str, ast.Definition]) -> None:
    for definition in definitions.values():
        if isinstance(definition, ast.Interface):
            continue
        read(definitions, definition.scoped, msgpack.packb(example_of(definition)))
    operation = find_definition("Device::get", definitions)
    for part in Part:
        read(definitions, "Device::get", msgpack.packb(example_of(operation, part)), part)


def test_an_example_that_nobody_would_read_is_left_out(tmp_path: Path) -> None:
    lines = ["struct S0 { int a; };"]
    lines += [f"struct S{n} {{ S{n - 1} a; S{n - 1} b; }};" for n in range(1, 40)]
    path = tmp_path / "main.idl"
    path.write_text(f"module m {{ {' '.join(lines)} }};")
    definition = load_definitions([path], [], Diagnostics())["::m::S39"]
    with pytest.raises(ExampleTooLargeError):
        example_of(definition)
    assert "for example" not in describe(definition)


def test_bytes_are_found_wherever_they_stand(definitions: dict[str, ast.Definition]) -> None:
    assert holds_bytes(find_definition("Device::get", definitions))
    assert not holds_bytes(find_definition("Device::get", definitions), Part.ARGUMENTS)
    assert not holds_bytes(find_definition("Node", definitions))


def test_a_description_has_all_that_matters(definitions: dict[str, ast.Definition]) -> None:
    text = describe(find_definition("m::Inner", definitions))
    assert text.startswith("struct ::m::Inner\ndefined in ")
    assert "  flag   bool\n           Whether it is so.\n  small  integer, 0 to 255\n" in text
    assert '{"flag": true, "small": 1}' in text
    assert "in 13 bytes\n  82 a4 66 6c 61 67 c3 a5 73 6d 61 6c 6c 01".replace("13", "14") in text
    assert "\nfingerprint " in text
    text = describe(find_definition("Device::get", definitions))
    assert "how much of it" in text
    assert "key {realm}/{identity}/get: called with a query" in text
    assert "throws ::m::Bad" in text
    text = describe(find_definition("Device::halt", definitions))
    assert '["stop"] idempotent void halt()' in text
    assert "called with a query, stops what its interface commands" in text
    assert '@type  "::m::Leaf ::m::Node"' in describe(find_definition("Leaf", definitions))
    assert "idempotent ::m::Everything get(int much, out ::m::Node node) throws ::m::Bad" in describe(
        find_definition("Device", definitions)
    )


def test_names_are_found_by_their_end_and_wrong_ones_explained(
    definitions: dict[str, ast.Definition],
) -> None:
    assert find_definition("::m::Node", definitions) is find_definition("Node", definitions)
    with pytest.raises(UnknownNameError, match="did you mean `Inner`"):
        find_definition("Iner", definitions)
    with pytest.raises(UnknownNameError, match="no file defines `Device::gut`"):
        find_definition("Device::gut", definitions)
