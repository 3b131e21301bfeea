"""Names are found where they are defined, included and used; errors help with those that are not."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.slice_compiler import compile_text, findings, in_module


def test_a_note_points_to_the_first_definition(tmp_path: Path) -> None:
    text = '#include "a.idl"\nmodule m { struct S { int b; }; };'
    _, diagnostics = compile_text(tmp_path, text, a="module m {\n  struct S { int a; };\n};")
    assert findings(diagnostics) == [("E013", 2, 19)]
    assert f"{tmp_path / 'a.idl'}:2:10: note: first defined here" in diagnostics.render()


@pytest.mark.parametrize(
    ("text", "note"),
    [
        ("struct S { flot a; };", "did you mean `float`?"),
        ("struct Pose { int a; }; struct S { Pos a; };", "did you mean `Pose`?"),
        ("module n { struct Pose { int a; }; }; struct S { Pose a; };", "did you mean `n::Pose`?"),
        ("exception Bad { }; interface I { void f() throws Bed; };", "did you mean `Bad`?"),
        ("interface Head { }; interface I extends Hed { };", "did you mean `Head`?"),
        ("const int size = 5; struct S { int a = sise; };", "did you mean `size`?"),
        ("enum E { red }; const E k = redd;", "did you mean `red`?"),
        ("struct S { Pose a; }; struct Pose { int a; };", "must be defined before it is used"),
    ],
)
def test_a_note_helps_with_a_name_that_is_not_defined(tmp_path: Path, text: str, note: str) -> None:
    _, diagnostics = compile_text(tmp_path, in_module(text))
    (found,) = diagnostics
    assert note in found.notes[0].message, diagnostics.render()


def test_a_thrown_type_is_not_proposed_for_an_exception(tmp_path: Path) -> None:
    text = "struct Bad { int a; }; interface I { void f() throws Bed; };"
    _, diagnostics = compile_text(tmp_path, in_module(text))
    (found,) = diagnostics
    assert not found.notes


def test_a_name_must_be_included_where_it_is_used(tmp_path: Path) -> None:
    _, diagnostics = compile_text(
        tmp_path, "module m { struct T { S s; }; };", a="module m { struct S { int a; }; };"
    )
    assert findings(diagnostics) == [("E012", 1, 23)]
