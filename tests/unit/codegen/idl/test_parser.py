from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from codegen._idl import ast, compile_interfaces
from codegen._idl.parser import parse
from codegen._idl.preprocessor import Preprocessor
from codegen.diagnostics import Diagnostics
from tests.support.examples import examples
from tests.support.places import ROOT
from tests.support.slice_compiler import compile_text, findings, write_sources
from tests.support.slice_texts import slice_like_texts


def parsed(directory: Path, text: str) -> tuple[ast.Module, Diagnostics]:
    (path,) = write_sources(directory, {"main.idl": text})
    diagnostics = Diagnostics()
    preprocessor = Preprocessor([], diagnostics)
    source = preprocessor.load(path)
    assert source is not None
    return parse(preprocessor.preprocess(source, diagnostics).tokens, diagnostics), diagnostics


def test_an_operation_has_all_its_parts(tmp_path: Path) -> None:
    root, diagnostics = parsed(
        tmp_path,
        """
        module m {
          interface I extends J, ::n::K {
            /** Do it. */
            ["stream", "x:y"] idempotent a::B f(int a, out ["z"] string b) throws E, F;
          };
        };
        """,
    )
    assert not len(diagnostics)
    (module,) = root.definitions
    assert isinstance(module, ast.Module)
    (interface,) = module.definitions
    assert isinstance(interface, ast.Interface)
    assert [base.name for base in interface.bases] == ["J", "::n::K"]
    (operation,) = interface.operations
    assert operation.doc == " Do it. "
    assert operation.streamed
    assert operation.idempotent
    assert isinstance(operation.returns, ast.NamedType)
    assert operation.returns.name == "a::B"
    assert [(each.name, each.out) for each in operation.parameters] == [("a", False), ("b", True)]
    assert [named.name for named in operation.throws] == ["E", "F"]


def test_a_doc_comment_behind_a_member_or_enumerator_is_its_own(tmp_path: Path) -> None:
    text = "module m { struct S { int a; /**< A */ int b; };\n enum E { x, /**< X */ y /**< Y */ }; };"
    root, diagnostics = parsed(tmp_path, text)
    assert not len(diagnostics)
    (module,) = root.definitions
    assert isinstance(module, ast.Module)
    struct, enumeration = module.definitions
    assert isinstance(struct, ast.Struct)
    assert isinstance(enumeration, ast.Enumeration)
    assert [member.doc for member in struct.members] == [" A ", None]
    assert [each.doc for each in enumeration.enumerators] == [" X ", " Y "]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "module m {}",
        "module m { struct S { int a; } enum E { ,a,,b, } }",
        'module m { ["a" "b"] struct \\struct { int \\int; }; };',
        '[["one", "two:three"]] module m { class A(3); class A { A a; } };'.replace("A(3);", "A;"),
    ],
)
def test_what_the_reference_compiler_accepts_is_accepted(tmp_path: Path, text: str) -> None:
    _, diagnostics = compile_text(tmp_path, text)
    assert not diagnostics.has_errors, diagnostics.render()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("module m { struct S { int a } }", [("E010", 1, 29)]),
        ("module m {\nsequence<int> A\n}", [("E010", 3, 1)]),
        ("module m { struct S { int a; };; }", [("E010", 1, 32)]),
        ("module m { struct S { int a, b; }; }", [("E010", 1, 28)]),
        ("module m { sruct S { int a; }; }", [("E010", 1, 12)]),
        ("module m { struct { int a; }; }", [("E010", 1, 19)]),
        ("module m { struct S { int class; }; }", [("E011", 1, 27)]),
        ("module m { interface I { void f(int a,); }; }", [("E010", 1, 39)]),
        ("module m { interface I { void f(int a int b); }; }", [("E010", 1, 39)]),
        ("module m { interface I { int a; }; }", [("E010", 1, 30)]),
        ("module m { struct S { void f(); }; }", [("E010", 1, 23)]),
        ("module m { enum E { a b }; struct S { int a; }; }", [("E010", 1, 23)]),
        ("module m { enum E { a, 5, b", [("E010", 1, 24), ("E010", 2, 1)]),
        ("module m { enum E { }; struct S { }; }", [("E033", 1, 21), ("E033", 1, 35)]),
        ("module m { const int a; }", [("E010", 1, 23)]),
        ("module m { dictionary<int> D; }", [("E010", 1, 26)]),
        ("module m { exception E; }", [("E010", 1, 23)]),
        ("module m {", [("E010", 2, 1)]),
        ("module m { module n {\n struct S { int a;", [("E010", 3, 1)]),
        ("module m { } }", [("E010", 1, 14)]),
        ('module m { } [["late"]] module n { }', [("E010", 1, 14)]),
    ],
)
def test_an_error_of_syntax_is_reported_once_where_it_is(
    tmp_path: Path, text: str, expected: list[tuple[str, int, int]]
) -> None:
    _, diagnostics = compile_text(tmp_path, text)
    assert findings(diagnostics) == expected, diagnostics.render()


def test_all_errors_are_reported_in_one_run(tmp_path: Path) -> None:
    text = """module m {
  struct A { int a }
  struct B { in b; int c; };
  interface I {
    void f(int);
    strng g();
    void h(out int a, int b)
    void j() throws Bad;
  };
  sequence<flot> Floats;
};
"""
    _, diagnostics = compile_text(tmp_path, text)
    assert findings(diagnostics) == [
        ("E010", 2, 20),
        ("E012", 3, 14),
        ("E010", 5, 15),
        ("E012", 6, 5),
        ("E017", 7, 27),
        ("E010", 8, 5),
        ("E012", 8, 21),
        ("E012", 10, 12),
    ], diagnostics.render()
    assert "did you mean `float`?" in diagnostics.render()


def test_modules_nested_without_end_are_refused(tmp_path: Path) -> None:
    _, diagnostics = compile_text(tmp_path, "module m { " * 5000)
    assert diagnostics.has_errors


def test_what_ice_3_8_added_is_read(tmp_path: Path) -> None:
    text = 'module m::n { enum E { /** X */ ["deprecated"] x, ["a:b", "c"] y }; };'
    root, diagnostics = parsed(tmp_path, text)
    assert not len(diagnostics)
    assert [(around.name, each.name) for around, each in root.walk()][1:] == [("m", "n"), ("n", "E")]
    (*_, (_, enumeration)) = root.walk()
    assert isinstance(enumeration, ast.Enumeration)
    assert [(each.name, each.doc) for each in enumeration.enumerators] == [("x", " X "), ("y", None)]


def test_names_of_modules_without_end_are_refused(tmp_path: Path) -> None:
    _, diagnostics = compile_text(tmp_path, f"module {'m::' * 5000}m {{ }};")
    assert diagnostics.has_errors


@settings(max_examples=examples(40), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(main=slice_like_texts(), other=slice_like_texts())
def test_any_text_compiles_or_has_an_error_with_a_place(tmp_path: Path, main: str, other: str) -> None:
    compilation, diagnostics = compile_text(tmp_path, main, a=other)
    for found in diagnostics.errors:
        assert found.location.line > 0
        assert found.message
    assert diagnostics.render() or not diagnostics.has_errors
    for file in compilation.files:
        compile(file.text, str(file.path), "exec")


INTERFACES = sorted(ROOT.joinpath("interfaces").glob("*.idl"))


@settings(max_examples=examples(25), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_file_has_an_error_or_compiles(tmp_path: Path, data: st.DataObject) -> None:
    content = data.draw(st.sampled_from(INTERFACES)).read_bytes()
    begin = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(begin, min(len(content), begin + 30)))
    damaged = content[:begin] + data.draw(st.binary(max_size=4)) + content[end:]
    if data.draw(st.booleans()):
        damaged = damaged[: data.draw(st.integers(0, len(damaged)))]
    path = tmp_path / "damaged.idl"
    path.write_bytes(damaged)
    diagnostics = Diagnostics()
    compilation = compile_interfaces([path], [INTERFACES[0].parent], tmp_path / "out", diagnostics)
    for file in compilation.files:
        compile(file.text, str(file.path), "exec")
