from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.slice_compiler import compile_text, findings, in_module


@pytest.mark.parametrize(
    "text",
    [
        "struct A { int a; }; struct B { A a; A A2; m::A b; ::m::A c; };",
        "struct Time { int a; }; struct S { Time time; Time b; };",
        "enum A { x, y }; enum B { x, z }; const A c = x; const A d = A::y; const B e = m::B::z; const A f = d;",
        "enum E { a = 3, b, c = 0x7fffffff }; const int k = 4; enum F { g = k };",
        "const int i = 5; const long l = i; const byte b = i; const double d = i; const float f = 1;",
        "const byte b = 255; const short s = -32768; const long l = -9223372036854775808;",
        "class A; sequence<A> As; class A { As children; A next; }; class B extends A { int b; };",
        "interface A; interface A { void f(); }; interface A;",
        "interface A { void f(); }; interface B extends A {}; interface C extends A {}; interface D extends B, C {};",
        "interface A {}; interface B extends A, A { void g(int B); };",
        "enum E { a }; dictionary<E, string> D; dictionary<bool, D> F; dictionary<long, F> G;",
        "exception E { string why; }; exception F : E {}; interface I { void g() throws E, F; };",
        "interface I { void f(int f, out string g); idempotent int h(out int a, out int b); };",
        "module n { struct S { int a; }; struct T { n::S b; S c; }; }; struct S { n::T t; };",
        "struct S { int a; }; module n { struct U { S s; }; struct S { int b; }; };",
        "struct iceS { int a_b; }; struct Pr { int Help; };",
        "struct Int { int Struct; int module_name; int True; };",
    ],
)
def test_what_keeps_the_rules_passes(tmp_path: Path, text: str) -> None:
    _, diagnostics = compile_text(tmp_path, in_module(text))
    assert not len(diagnostics), diagnostics.render()


@pytest.mark.parametrize(
    ("text", "code", "column"),
    [
        ("struct S { Tine t; }; struct Time { int a; };", "E012", 12),
        ("interface I { void f() throws Absent; };", "E012", 31),
        ("const int i = absent;", "E012", 15),
        ("struct S { int a; }; struct S { int b; };", "E013", 29),
        ("struct S { int a; string a; };", "E013", 26),
        ("interface I { void f(); int f(); };", "E013", 29),
        ("interface I { void f(int a, string a); };", "E013", 36),
        ("interface A { void f(); }; interface B extends A { void f(); };", "E013", 57),
        ("interface I { void i(); };", "E013", 20),
        ("struct M { int a; };", "E013", 8),
        ("class A { int a; }; class B extends A { int a; };", "E013", 45),
        ("exception A { int a; }; exception B extends A { int A; };", "E014", 53),
        ("class C(5) {}; class D(5) {};", "E035", 24),
        ("interface A; struct A { int a; };", "E013", 21),
        ("struct S { int a; }; struct s { int b; };", "E014", 29),
        ("struct S { int a; }; struct T { s a; };", "E014", 33),
        ("struct S { int a; int A; };", "E014", 23),
        ("interface I { void f(int a, int A); };", "E014", 33),
        ("enum E { a, A };", "E014", 13),
        ("exception E {}; struct S { E e; };", "E015", 28),
        ("const int k = 1; sequence<k> S;", "E015", 27),
        ("struct S { m a; };", "E015", 12),
        ("interface I {}; class C extends I {};", "E015", 33),
        ("struct S { int a; }; interface I extends S {};", "E015", 42),
        ("interface I { void f(out int a, int b); };", "E017", 37),
        ("dictionary<float, int> D;", "E018", 12),
        ("class C {}; dictionary<C, int> D;", "E018", 24),
        ("struct K { double a; }; dictionary<K, int> D;", "E018", 36),
        ("struct S { int a; }; interface I { void f() throws S; };", "E019", 52),
        ("exception E {}; interface I { void f() throws E, E; };", "E019", 50),
        ("class A extends A {};", "E020", 17),
        ("interface A extends A {};", "E020", 21),
        ("interface A; interface B extends A {};", "E020", 34),
        ("interface A { void f(); }; interface B { void F(); }; interface C extends A, B {};", "E021", 65),
        ("const int i = 1.5;", "E022", 15),
        ("const string s = 5;", "E022", 18),
        ("const bool b = 1;", "E022", 16),
        ("const int i = true;", "E022", 15),
        ("enum E { a }; const E k = 0;", "E022", 27),
        ("enum E { a, b }; const E k = c;", "E022", 30),
        ("enum E { a }; const int k = a;", "E012", 29),
        ("struct S { int a; }; const S k = 5;", "E022", 28),
        ("const byte b = 256;", "E023", 16),
        ("const short s = -32769;", "E023", 17),
        ("const int i = 2147483648;", "E023", 15),
        ("const long l = 9223372036854775808;", "E023", 16),
        ("const int i = 500; const byte b = i;", "E023", 35),
        ("enum E { a = 1, b = 1 };", "E024", 21),
        ("enum E { a = 5, b, c = 6 };", "E024", 24),
        ("enum E { a = -1 };", "E024", 14),
        ("enum E { a = 2147483647, b };", "E024", 26),
        ("enum E { a = 1.5 };", "E024", 14),
        ("struct S { S s; };", "E025", 12),
        ("struct _S { int a; };", "E026", 8),
        ("struct S { int a__b; };", "E026", 16),
        ("struct SPtr { int a; };", "E026", 8),
        ("interface I { int f(out int returnValue); };", "E026", 29),
        ("interface I { void ice_ping(); };", "E026", 20),
        ("struct T { int a; }; interface I { T f(); void t(); };", "E027", 48),
        ('["stream"] struct S { int a; };', "E029", 2),
        ('interface I { ["stream"] int f(); void fPublisher(); };', "E030", 40),
        ('interface A { ["stream"] int f(); }; interface B extends A { void fPublisher(); };', "E030", 67),
        ('interface I { ["stream"] void f(); };', "E029", 31),
        ('["stop"] struct S { int a; };', "E037", 2),
        ('["stop"] interface I { idempotent void f(); };', "E037", 2),
        ('interface I { ["stop"] void f(); };', "E037", 29),
        ('interface I { ["stop"] idempotent int f(); };', "E037", 39),
        ('interface I { ["stop"] idempotent void f(out int a); };', "E037", 40),
        ('interface I { ["stop"] idempotent void f(optional(1) int a, int b); };', "E037", 40),
        ('interface I { ["stop"] idempotent void f(); ["stop"] idempotent void g(); };', "E037", 70),
    ],
)
def test_what_breaks_a_rule_is_reported_once_with_its_place(
    tmp_path: Path, text: str, code: str, column: int
) -> None:
    compilation, diagnostics = compile_text(tmp_path, in_module(text))
    assert findings(diagnostics) == [(code, 2, column)], diagnostics.render()
    assert compilation.files == ()


@pytest.mark.parametrize(
    ("text", "code", "column"),
    [
        ('["strem"] struct S { int a; };', "W001", 2),
        ("struct S { int Value; };", "W002", 16),
        ("class A; struct S { A a; };", "W006", 21),
        ("interface I { }; struct S { I i; };", "W004", 29),
        ("class C { }; struct S { C* c; };", "W004", 25),
        ("class C { void f(); };", "W004", 7),
        ("interface I { }; class C implements I { };", "W004", 24),
        ("sequence<int> K; dictionary<K, int> D;", "W004", 29),
        ("class C; class c { };", "W009", 16),
        ('["amd"] interface I { };', "W010", 2),
        ('interface I { ["amd"] void f(); };', "W010", 16),
        ('const string s = "\\xff";', "W008", 18),
        ('const string s = "\\q";', "W005", 18),
    ],
)
def test_what_is_doubtful_is_a_warning(tmp_path: Path, text: str, code: str, column: int) -> None:
    compilation, diagnostics = compile_text(tmp_path, in_module(text))
    assert findings(diagnostics) == [(code, 2, column)], diagnostics.render()
    assert compilation.files


@pytest.mark.parametrize(
    "text", ["struct S { int a; };", "interface I {};", "const int k = 5;", "enum E { a };"]
)
def test_definitions_stand_in_modules(tmp_path: Path, text: str) -> None:
    _, diagnostics = compile_text(tmp_path, text)
    assert [found.code for found in diagnostics] == ["E016"]


def test_an_error_in_an_included_file_is_reported_there_and_once(tmp_path: Path) -> None:
    text = '#include "a.idl"\n#include "b.idl"\nmodule m { struct T { S s; }; };'
    bad = "#pragma once\nmodule m { struct S { strng s; }; };"
    _, diagnostics = compile_text(tmp_path, text, a=bad, b='#include "a.idl"')
    assert [str(found.location) for found in diagnostics] == [f"{tmp_path / 'a.idl'}:2:23"]


def test_local_definitions_are_skipped_with_a_note(tmp_path: Path) -> None:
    text = """#include "lib.idl"
    module m {
    local interface L { void stop(LocalObject o); }; local enum E { x }; const E usual = x; struct T { int a; }; };"""
    lib = "module m { local interface Lib { void ice_f(); }; local exception Busy { }; exception Lost { }; };"
    compiled, diagnostics = compile_text(tmp_path, text, lib=lib)
    assert findings(diagnostics) == [("N001", 3, 21), ("N001", 3, 65)]
    schemas = [json.loads(each.text) for each in compiled.files if each.path.name == "schema.json"]
    assert [sorted(schema["definitions"]) for schema in schemas] == [["::m::Lost", "::m::T"]]


def test_an_error_before_an_include_hides_nothing_of_it(tmp_path: Path) -> None:
    text = '[["a"\n#include "a.idl"\nmodule m { struct T { S s; }; };'
    _, diagnostics = compile_text(tmp_path, text, a="module m { struct S { int a; }; };")
    assert findings(diagnostics) == [("E010", 1, 1)], diagnostics.render()


@pytest.mark.parametrize(
    ("first", "pattern"),
    [
        ("struct T0 { int a; };", "struct T{} {{ T{} a; }};"),
        ("struct T0 { int a; };", "sequence<T{1}> T{0};"),
        ("class T0 {};", "class T{} extends T{} {{}};"),
        ("interface T0 {};", "interface T{} extends T{} {{}};"),
    ],
)
def test_types_nested_without_end_are_refused(tmp_path: Path, first: str, pattern: str) -> None:
    chain = [first, *(pattern.format(number, number - 1) for number in range(1, 1500))]
    text = in_module(" ".join(chain) + " dictionary<T1499, int> D;")
    _, diagnostics = compile_text(tmp_path, text)
    assert "E034" in {found.code for found in diagnostics}


def test_a_struct_in_itself_as_a_key_is_reported(tmp_path: Path) -> None:
    _, diagnostics = compile_text(tmp_path, in_module("struct S { S s; }; dictionary<S, int> D;"))
    assert diagnostics.errors[0].code == "E025"
