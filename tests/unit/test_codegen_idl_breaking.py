from __future__ import annotations

from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.idl import ast
from codegen.idl.breaking import Break, BreakingChange, BreakingRule, breaking_changes
from codegen.idl.loading import load_definitions
from codegen.idl.schema import canonical_definition

BASE = """\
module m {
  const int most = 5;
  enum Color { Red, Green = 5, Blue };
  sequence<int> Ints;
  sequence<int> MoreInts;
  dictionary<string, Color> Colors;
  struct Point { int x; double y; };
  class Node { int id; optional(1) string label; };
  class Leaf extends Node { Point at; };
  exception Bad { string why; };
  exception Worse extends Bad {};
  interface Base { void ping(); };
  interface Other { void pong(); };
  interface Motor { ["stop"] idempotent void halt(); idempotent void pause(); };
  interface Device extends Base {
    ["stream"] idempotent Point where(int axis, Ints more, out Color color) throws Bad;
    ["amd"] void move(Point to, double speed);
  };
};
"""


def definitions(directory: Path, text: str) -> dict[str, ast.Definition]:
    found, diagnostics = compiled(directory, text)
    assert not diagnostics.has_errors, diagnostics.render()
    return found


def compiled(directory: Path, text: str) -> tuple[dict[str, ast.Definition], Diagnostics]:
    path = directory / "main.idl"
    path.write_text(text)
    diagnostics = Diagnostics()
    return load_definitions([path], [], diagnostics), diagnostics


def changes(directory: Path, before: str, after: str) -> list[BreakingChange]:
    return breaking_changes(definitions(directory, before), definitions(directory, after))


CASES = [
    ("interface Other { void pong(); };", "", ["B101"]),
    ("sequence<int> MoreInts;", "", ["B102"]),
    ("struct Point {", "exception Gone {}; struct Point {", []),
    ("struct Point { int x; double y; };", "class Point { int x; double y; };", ["B103"]),
    ('    ["amd"] void move(Point to, double speed);\n', "", ["B201"]),
    ("void ping();", "void ping(); void again();", ["B202"]),
    ("void ping();", "int ping();", ["B203"]),
    ("void ping();", "optional(2) int ping();", ["B203"]),
    ("Point to, double speed", "Point to", ["B204"]),
    ("void pong();", "void pong(int a);", ["B205"]),
    ("double speed", "float speed", ["B206"]),
    ("int axis,", "optional(1) int axis,", ["B206"]),
    ("double speed", "double velocity", ["B207"]),
    ("Point to, double speed", "double speed, Point to", ["B208"]),
    ("throws Bad;", "throws Bad, Worse;", ["B209"]),
    (" throws Bad;", ";", ["B210"]),
    ("idempotent Point", "Point", ["B211"]),
    ('["stream"] ', "", ["B212"]),
    ('["amd"] ', "", ["B217"]),
    ("void pong();", '["stream"] int pong();', ["B203", "B213"]),
    ('["stop"] ', "", ["B218"]),
    ('["stop"] idempotent void halt(); idempotent', 'idempotent void halt(); ["stop"] idempotent', []),
    (
        'interface Motor { ["stop"] idempotent void halt();',
        'interface Brake { ["stop"] idempotent void halt(); }; interface Motor extends Brake {',
        ["B215", "B201"],
    ),
    ("Device extends Base", "Device", ["B214"]),
    ("Device extends Base", "Device extends Base, Other", ["B215"]),
    ("Other { void", "Other extends Base { void", ["B215"]),
    ("int x; double y;", "int x;", ["B301"]),
    ("int x; double y;", "int x; double y; int z;", ["B302"]),
    ("string label;", "string label; optional(2) int more;", ["B303"]),
    ("double y;", "long y;", ["B304"]),
    ("double y;", "double z;", ["B305"]),
    ("int x; double y;", "double y; int x;", ["B306"]),
    ("class Node { int id;", "class Node { optional(7) int id;", ["B307"]),
    ("optional(1) string", "string", ["B308"]),
    ("class Leaf extends Node", "class Leaf", ["B310"]),
    ("Green = 5, Blue", "Green = 5", ["B401"]),
    ("Blue }", "Blue, Pink }", ["B402"]),
    ("Green = 5", "Green = 7", ["B403", "B403"]),
    ("sequence<int> Ints", "sequence<long> Ints", ["B501"]),
    ("dictionary<string, Color>", "dictionary<int, Color>", ["B501"]),
    ("most = 5", "most = 6", ["B502"]),
    # Another name for the same sequence is the same type on the wire and in Python.
    ("Ints more", "MoreInts more", []),
    ("module m {", "/** Nothing. */ module m { struct New { int a; };", []),
    ("optional(1) string", "optional(9) string", []),
]


@pytest.mark.parametrize(("old", "new", "codes"), CASES)
def test_a_change_is_reported_with_its_code(tmp_path: Path, old: str, new: str, codes: list[str]) -> None:
    assert old in BASE
    found = changes(tmp_path, BASE, BASE.replace(old, new))
    assert [change.rule.code for change in found] == codes


def test_a_default_value_that_goes_breaks_the_source(tmp_path: Path) -> None:
    before = BASE.replace("int x; double y;", "int x = 1; double y;")
    (change,) = changes(tmp_path, before, BASE)
    assert change.rule is BreakingRule.DEFAULT_REMOVED
    assert change.rule.breaks == (Break.SOURCE,)


def test_bases_by_another_way_break_the_wire(tmp_path: Path) -> None:
    before = BASE.replace("Other { void", "Other extends Base { void").replace(
        "Device extends Base", "Device extends Base, Other"
    )
    after = before.replace("Device extends Base, Other", "Device extends Other")
    (change,) = changes(tmp_path, before, after)
    assert change.rule is BreakingRule.BASES_REARRANGED


def test_every_rule_has_a_case() -> None:
    tested = {code for _, _, codes in CASES for code in codes} | {"B216", "B309"}
    assert tested == {rule.code for rule in BreakingRule}


@settings(max_examples=80, deadline=None)
@given(seed=st.integers(0, 1 << 32))
def test_the_wire_breaks_exactly_when_a_fingerprint_changes(
    tmp_path_factory: pytest.TempPathFactory, seed: int
) -> None:
    random = Random(seed)
    directory = tmp_path_factory.getbasetemp()
    text = BASE
    # What is removed has no fingerprint to compare.
    kept = [case for case in CASES if case[2] not in (["B101"], ["B102"])]
    for old, new, _ in random.sample(kept, random.randint(0, 4)):
        changed_text = text.replace(old, new) if text.count(old) == 1 else text
        if not compiled(directory, changed_text)[1].has_errors:  # some pairs of changes exclude each other
            text = changed_text
    before, after = definitions(directory, BASE), definitions(directory, text)
    common = before.keys() & after.keys()
    changed = any(
        canonical_definition(before[name]) != canonical_definition(after[name])
        for name in common
        if not isinstance(before[name], ast.Constant)
    )
    wire = [each for each in breaking_changes(before, after) if Break.WIRE in each.rule.breaks]
    assert bool(wire) == changed
