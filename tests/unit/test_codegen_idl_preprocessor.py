from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.idl.conditions import ConditionError, evaluate
from codegen.idl.preprocessor import Preprocessor
from codegen.idl.source_files import SourceFiles
from tests.support.slice_compiler import findings, write_sources


def preprocess(
    directory: Path, text: str, others: dict[str, str] | None = None, include: list[Path] | None = None
) -> tuple[str, Diagnostics]:
    """Return the tokens that count as one text."""
    (*_, main) = write_sources(directory, {**(others or {}), "main.idl": text})
    diagnostics = Diagnostics()
    files = SourceFiles(diagnostics)
    source = files.load(main)
    assert source is not None
    unit = Preprocessor(files, include or [], diagnostics).unit(source)
    return " ".join(token.text for token in unit.tokens[:-1]), diagnostics


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("#define A\n#ifdef A\nyes\n#else\nno\n#endif", "yes"),
        ("#ifndef A\nyes\n#elif 1\nno\n#else\nno\n#endif // A", "yes"),
        ("#if 0\nno\n#elif 1\nyes\n#elif 1\nno\n#else\nno\n#endif", "yes"),
        ("#if 0\n#if 1\nno\n#else\nno\n#endif\n#else\nyes\n#endif", "yes"),
        ("#define A\n#undef A\n#ifdef A\nno\n#endif\nyes", "yes"),
        ("#define A 5\na A b", "a 5 b"),
        ("#define A B C\n#define B A\nA", "A C"),
        ("#define F(x) (x)\nF(a) F F((b, c)) F(F(d))", "( a ) F ( ( b , c ) ) ( ( d ) )"),
        ("#define F(x, y) y x\n#define G() g\nF(a b, c) G()", "c a b g"),
        ("#define F(x)\nint a F(= 5);", "int a ;"),
        ("#define A\n#if defined(A) && !defined B\nyes\n#endif", "yes"),
        ("#if ICE_VERSION >= 30700\nyes\n#endif", "yes"),
        ('#if 0\n"no end $ \n#endif\nyes', "yes"),
        ("/* #if 0 */ yes // #if 0", "yes"),
        ("#\n# 5\n#line 7\nyes", "yes"),
    ],
)
def test_conditions_and_macros(tmp_path: Path, text: str, expected: str) -> None:
    words, diagnostics = preprocess(tmp_path, text)
    assert not len(diagnostics)
    assert words == expected


def test_includes_are_searched_beside_the_file_and_in_directories(tmp_path: Path) -> None:
    others = {"deep/a.idl": '#include "b.idl"\na', "deep/b.idl": "b", "lib/jde/c.ice": "c"}
    text = '#include "deep/a.idl"\n#include <jde/c.idl>\nmain'
    words, diagnostics = preprocess(tmp_path, text, others, [tmp_path / "lib"])
    assert not len(diagnostics)
    assert words == "b a c main"


def test_an_angled_include_prefers_the_directories(tmp_path: Path) -> None:
    others = {"a.idl": "own", "lib/a.idl": "library"}
    words, _ = preprocess(tmp_path, '#include "a.idl"\n#include <a.idl>', others, [tmp_path / "lib"])
    assert words == "own library"


@pytest.mark.parametrize("guard", ["#pragma once\nx", "#ifndef G\n#define G\nx\n#endif"])
def test_a_guarded_file_counts_once(tmp_path: Path, guard: str) -> None:
    words, diagnostics = preprocess(tmp_path, '#include "a.idl"\n#include "./a.idl"\ny', {"a.idl": guard})
    assert not len(diagnostics)
    assert words == "x y"


def test_files_that_include_each_other_are_read_once_when_guarded(tmp_path: Path) -> None:
    others = {"a.idl": '#pragma once\n#include "main.idl"\na'}
    words, diagnostics = preprocess(tmp_path, '#pragma once\n#include "a.idl"\nmain', others)
    assert not len(diagnostics)
    assert words == "a main"


def test_files_that_include_each_other_without_guards_are_an_error(tmp_path: Path) -> None:
    others = {"a.idl": '#include "b.idl"\n#include "b.idl"', "b.idl": '#include "a.idl"\n#include "a.idl"'}
    _, diagnostics = preprocess(tmp_path, '#include "a.idl"', others)
    assert {found.code for found in diagnostics} == {"E006"}


def test_a_missing_file_of_ice_comes_with_where_to_get_it(tmp_path: Path) -> None:
    _, own = preprocess(tmp_path, '#include "none.idl"')
    _, of_ice = preprocess(tmp_path, "#include <IceStorm/IceStorm.ice>")
    assert "zeroc-ice" not in own.render()
    assert "`pip install zeroc-ice` brings the directory `slice`" in of_ice.render()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('\n#include "none.idl"', [("E005", 2, 1)]),
        ("#include none.idl", [("E007", 1, 1)]),
        ("#if 1\n#else\n#else\n#endif", [("E007", 3, 1)]),
        ("#endif\n#else\n#elif 1", [("E007", 1, 1), ("E007", 2, 1), ("E007", 3, 1)]),
        ("#if 1\nx\n", [("E007", 2, 1)]),
        ("#if (1\n#endif", [("E007", 1, 1)]),
        ("#ifdef\n#endif", [("E007", 1, 1)]),
        ("#define\n#define F(x x", [("E007", 1, 1), ("E007", 2, 1)]),
        ("#import x", [("E007", 1, 1)]),
        ("#undef", [("E007", 1, 1)]),
        ("#define F(x) x\nF(a, b)\nF(", [("E007", 2, 1), ("E007", 3, 1)]),
        ("#error stop", [("E007", 1, 1)]),
        ("a $ b\n  12x", [("E002", 1, 3), ("E004", 2, 3)]),
        ('"a\n/*', [("E003", 1, 1), ("W007", 2, 1)]),
        ("#define A /* no end\nx", [("E003", 1, 1)]),
    ],
)
def test_what_is_wrong_is_told_with_its_place(
    tmp_path: Path, text: str, expected: list[tuple[str, int, int]]
) -> None:
    _, diagnostics = preprocess(tmp_path, text)
    assert findings(diagnostics) == expected


def test_a_file_that_is_not_utf8_is_read_with_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "old.idl"
    path.write_bytes(b"\n// a\xf1o\nx")
    diagnostics = Diagnostics()
    source = SourceFiles(diagnostics).load(path)
    assert source is not None
    assert source.text == "\n// a\xf1o\nx\n"
    assert findings(diagnostics) == [("W003", 2, 5)]


def test_a_directory_and_an_absent_file_are_errors(tmp_path: Path) -> None:
    diagnostics = Diagnostics()
    files = SourceFiles(diagnostics)
    assert files.load(tmp_path) is None
    assert files.load(tmp_path / "absent.idl") is None
    assert [found.code for found in diagnostics] == ["E001", "E001"]


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        ("1 + 2 * 3 == 7", True),
        ("(1 + 2) * 3 == 7", False),
        ("!A && B >= 010", True),
        ("-1 < 0 || 1 / 0", None),
        ("defined(A) || defined B", True),
        ("unknown", False),
        ("7 % 4 - 3", False),
        ("", None),
        ("1 1", None),
        ("1 ? 0 : 3", False),
        ("1 ? 2", None),
        ("1 << 3 == 8 && ~0 == -1 && (6 & 3 | 8) == 10 && 6 ^ 4", True),
        ("1 << 100", None),
        ("1x", None),
        ("(" * 500, None),
        ("defined(A", None),
    ],
)
def test_conditions(condition: str, expected: bool | None) -> None:
    macros = {"B": "0x9UL"}
    if expected is None:
        with pytest.raises(ConditionError):
            evaluate(condition, macros)
    else:
        assert evaluate(condition, macros) is expected


@given(st.text(st.sampled_from("01AB()!&|<>=+-*/% defined"), max_size=60))
def test_any_condition_has_a_value_or_an_error(condition: str) -> None:
    with suppress(ConditionError):
        evaluate(condition, {"A": "1", "B": "B"})
