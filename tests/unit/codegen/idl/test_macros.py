from __future__ import annotations

from pathlib import Path

import pytest

from codegen._idl.macros import MacroError, Macros
from tests.support.slice_compiler import compile_text, findings
from tests.unit.codegen.idl.test_preprocessor import preprocess


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('#define URL "http://a" // where\nURL', '"http://a"'),
        ("#define NEGATIVE -1\nNEGATIVE", "-1"),
        ("#define F(a, b) b a\nF(x, F(y, z))", "z y x"),
        ("#define F(a) [a]\nF((x, y)) F F()", "[ ( x , y ) ] F [ ]"),
        ("#define A B\n#define B A\nA \\A", "A A"),
        ("#define A x\n#undef A\nA", "A"),
        ("#define A x\n#define A y\nA", "y"),
    ],
)
def test_uses_of_macros_are_replaced(tmp_path: Path, text: str, expected: str) -> None:
    words, diagnostics = preprocess(tmp_path, text)
    assert not len(diagnostics)
    assert words == expected


def test_an_error_in_a_macro_is_reported_where_it_is_used(tmp_path: Path) -> None:
    text = "#define KIND strng\n#define SIZE 09\nmodule m { struct S { KIND a; }; const int b = SIZE; };"
    _, diagnostics = compile_text(tmp_path, text)
    assert findings(diagnostics) == [("E012", 3, 23), ("E004", 3, 48)]


def test_conditions_know_which_macros_are_defined() -> None:
    macros = Macros()
    macros.define("SIZE 2")
    macros.define("TWICE(x) (x * 2)")
    assert macros.holds("defined SIZE && defined(TWICE) && !defined( undefined ) && TWICE(SIZE) == 4")
    macros.undefine("SIZE")
    assert not macros.holds("defined SIZE || SIZE")


@pytest.mark.parametrize(
    ("definition", "message"),
    [
        ("", "#define needs a name"),
        ("5", "#define needs a name"),
        ("defined", "`defined` cannot be the name of a macro"),
        ("F(x", "the parameters of `F` are not names in parentheses"),
        ("F(x,)", "`` is not the name of a parameter"),
        ("F(x, x) x", "two parameters have the name `x`"),
        ("F(x) #x", "`#` and `##` are not supported in the body of a macro"),
    ],
)
def test_what_is_no_macro_is_refused_with_a_reason(definition: str, message: str) -> None:
    with pytest.raises(MacroError) as refused:
        Macros().define(definition)
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("count", "body", "message"),
    [
        (60, "A{0} A{0}", "the file is too large after its macros are replaced"),
        (200, "A{0}", "macros are nested too deeply"),
    ],
)
def test_macros_that_grow_without_end_are_one_error(
    tmp_path: Path, count: int, body: str, message: str
) -> None:
    macros = "".join(f"#define A{number} {body.format(number + 1)}\n" for number in range(count))
    _, diagnostics = preprocess(tmp_path, f"{macros}A0\nA0\nA0")
    assert [(found.location.line, found.message) for found in diagnostics] == [(count + 1, message)]
