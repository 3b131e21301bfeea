"""Descriptions of definitions, and how one is found by its name."""

from __future__ import annotations

import pytest

from codegen.diagnostics import Diagnostics
from codegen.idl import ast
from codegen.idl.describe import UnknownNameError, describe, find_definition
from codegen.idl.loading import load_definitions

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


@pytest.fixture(scope="module")
def definitions(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ast.Definition]:
    path = tmp_path_factory.mktemp("idl") / "main.idl"
    path.write_text(TEXT)
    diagnostics = Diagnostics()
    found = load_definitions([path], [], diagnostics)
    assert not diagnostics.has_errors, diagnostics.render()
    return found


def test_an_exception_is_described_as_the_runtime_sends_it(definitions: dict[str, ast.Definition]) -> None:
    text = describe(definitions["::m::Worse"])
    assert '  exception  "::m::Worse" or ' in text
    assert '  bases      array of what that extends, the nearest first: "::m::Bad"\n' in text
    assert "  members    a map\n    why   string\n    much  integer of 32 bits\n" in text


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("Bytes", "on the wire: bytes"),
        ("Inners", "on the wire: array of ::m::Inner"),
        ("Table", "on the wire: map from short to double"),
        ("Color", "on the wire: an integer\n  0  Red\n  5  Green"),
        ("Everything", "  many    array of ::m::Inner (::m::Inners)"),
        ("Leaf", "  next   map or nil (::m::Node)\n  label  string"),
        ("Child::get", "on the wire, results: a map\n  returnValue  map (::m::Everything)"),
    ],
)
def test_it_says_what_travels(definitions: dict[str, ast.Definition], name: str, line: str) -> None:
    assert f"{line}\n" in describe(find_definition(name, definitions))


def test_a_description_has_all_that_matters(definitions: dict[str, ast.Definition]) -> None:
    text = describe(find_definition("m::Inner", definitions))
    assert text.startswith("struct ::m::Inner\ndefined in ")
    assert "  flag   bool\n           Whether it is so.\n  small  integer, 0 to 255\n" in text
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
