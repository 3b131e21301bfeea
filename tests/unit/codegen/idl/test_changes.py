"""The changes between two versions of a definition, one by one."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen._idl import read_definitions
from codegen._idl.ast import Definition
from codegen._idl.changes import changes, refusals
from codegen.diagnostics import Diagnostics


def read(folder: Path, text: str) -> dict[str, Definition]:
    path = folder / "m.idl"
    path.write_text(f"module m {{ {text} }};")
    found = read_definitions([path], [], diagnostics := Diagnostics())
    assert not diagnostics.has_errors, diagnostics.render()
    return found


def found(folder: Path, before: str, after: str) -> list[str]:
    return [str(each) for each in changes(read(folder, before), read(folder, after))]


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("struct S { int a; };", "struct S { int b; };", ["member `a` of `m::S` renamed to `b`"]),
        (
            "struct S { int a; int b; };",
            "struct S { int c; int d; };",
            [f"member `{name}` of `m::S` {what}" for what, names in (("removed", "ab"), ("added", "cd")) for name in names],
        ),
        (
            "struct S { int a; int b; };",
            "struct S { int c; };",
            ["member `a` of `m::S` removed", "member `b` of `m::S` removed", "member `c` of `m::S` added"],
        ),
        ("enum E { A, B };", "enum E { A, C };", ["enumerator `B` of `m::E` renamed to `C`"]),
        ("enum E { A, B };", "enum E { B, A };", [
            "enumerator `A` of `m::E` changed: `0` -> `1`", "enumerator `B` of `m::E` changed: `1` -> `0`"
        ]),
        ("class C { int a; };", "struct C { int a; };", ["struct `m::C` changed: `class ::m::C` -> `struct ::m::C`"]),
        ("sequence<int> A;", "sequence<int> B;", ["sequence `m::A` removed", "sequence `m::B` added"]),
        ("interface I;", "interface I;", []),
    ],
)  # fmt: skip
def test_changes_are_named_by_the_member(
    tmp_path: Path, before: str, after: str, expected: list[str]
) -> None:
    assert found(tmp_path, before, after) == expected


def test_a_type_that_an_interface_uses_changes_the_interface(tmp_path: Path) -> None:
    text = "struct S { int a; }; sequence<S> Ss; interface I { void f(Ss all); }; interface J { void g(); };"
    before, after = read(tmp_path, text), read(tmp_path, text.replace("int a", "long a"))
    assert [each.interface for each in refusals(before, after)] == ["::m::I"]
    assert [each.definition for each in changes(before, after)] == ["::m::S"]


@pytest.mark.parametrize(
    ("after", "expected"),
    [
        ("struct S { /** Other. */ int a; int b; };", "struct `m::S`: its description changed"),
        (
            "struct S { int b; int a; };",
            "struct `m::S`: the order, default values or names of types changed, which are not sent",
        ),
    ],
)
def test_what_is_not_sent_is_named(tmp_path: Path, after: str, expected: str) -> None:
    assert found(tmp_path, "struct S { /** One. */ int a; int b; };", after) == [expected]
