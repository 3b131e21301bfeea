from __future__ import annotations

from pathlib import Path

import pytest

from codegen._idl import Compilation, compile_interfaces
from codegen._idl.preprocessor import Preprocessor
from codegen.diagnostics import Diagnostics
from tests.support.slice_compiler import compile_text, findings, write_sources


def preprocess(
    directory: Path, text: str, others: dict[str, str] | None = None, include: list[Path] | None = None
) -> tuple[str, Diagnostics]:
    """Return the tokens that count as one text."""
    (*_, main) = write_sources(directory, {**(others or {}), "main.idl": text})
    diagnostics = Diagnostics()
    preprocessor = Preprocessor(include or [], diagnostics)
    source = preprocessor.load(main)
    assert source is not None
    preprocessed = preprocessor.preprocess(source, diagnostics)
    return " ".join(token.text for token in preprocessed.tokens[:-1]), diagnostics


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("#define A\n#ifdef A\nyes\n#else\nno\n#endif", "yes"),
        ("#ifndef A\nyes\n#else\nno\n#endif // A", "yes"),
        ("#ifdef A\nno\n#else\nyes\n#endif", "yes"),
        ("#ifdef A\n#ifndef A\nno\n#else\nno\n#endif\n#else\nyes\n#endif", "yes"),
        ("#ifdef A\n#if 1\nno\n#elif 2\nno\n#else\nno\n#endif\n#undef B\n#endif\nyes", "yes"),
        ("#ifdef __SLICE2PY__\nyes\n#endif", "yes"),
        ("#ifdef A\n12x 'no end $ \n#endif\nyes", "yes"),
        ("#define A // a name\nB", "B"),
        ("#if 0 && 1 || defined(ICE_VERSION)\nyes\n#endif", "yes"),
        ("#if 1\nyes\n#elif 1 / 0\nno\n#endif", "yes"),
        ("#if defined A\nno\n#elif !defined( A ) && ! ! 1\nyes\n#endif", "yes"),
        ("#if !1 || !!0 || 1 && !defined __SLICE2PY__\nno\n#else\nyes\n#endif", "yes"),
        ("#define A\n#undef A\n#if defined(A)\nno\n#endif\nA", "A"),
        ("#define A 1\n\\A", "A"),
        ("#line 7\nyes", "yes"),
        ("/* #ifdef A */ yes // #ifdef A", "yes"),
        ("#\nyes", "yes"),
    ],
)
def test_conditions(tmp_path: Path, text: str, expected: str) -> None:
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
    assert "`pip install zeroc-ice` installs the directory `slice`" in of_ice.render()


@pytest.mark.parametrize("name", ["../secret", "{}/secret", "link.idl", "secret.idl/../../secret"])
def test_no_line_of_another_file_is_shown(tmp_path: Path, name: str) -> None:
    (tmp_path / "secret").write_text("root:*:20228\n")
    folder = tmp_path / "idl"
    folder.mkdir()
    (folder / "link.idl").symlink_to("../secret")
    (folder / "secret.idl").mkdir()
    _, found = preprocess(folder, f'#include "{name.format(tmp_path)}"')
    assert "error[E001]: `" in found.render()
    assert "is not included: it must end in .idl or .ice" in found.render()
    assert "root:" not in found.render()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('\n#include "none.idl"', [("E005", 2, 1)]),
        ("#include none.idl", [("E007", 1, 1)]),
        ("#ifndef A\n#else\n#else\n#endif", [("E007", 3, 1)]),
        ("#endif\n#else\n#elif 1", [("E007", 1, 1), ("E007", 2, 1), ("E007", 3, 1)]),
        ("#ifndef A\nx\n", [("E007", 2, 1)]),
        ("#ifdef\n#endif", [("E007", 1, 1)]),
        ("#define", [("E007", 1, 1)]),
        ("#define defined", [("E007", 1, 1)]),
        ("#import x", [("E007", 1, 1)]),
        ("#error stop", [("E007", 1, 1)]),
        ("#pragma pack", [("E007", 1, 1)]),
        ("a $ b\n  12x", [("E002", 1, 3), ("E004", 2, 3)]),
        ('"a\n/*', [("E003", 1, 1), ("W007", 2, 1)]),
        ("#define A /* no end\nx", [("E003", 1, 1)]),
        ('#ifdef A\n"no end $ \n#endif\nyes', [("E003", 2, 1)]),
    ],
)
def test_what_is_wrong_is_reported_with_its_place(
    tmp_path: Path, text: str, expected: list[tuple[str, int, int]]
) -> None:
    _, diagnostics = preprocess(tmp_path, text)
    assert findings(diagnostics) == expected


@pytest.mark.parametrize(
    "text",
    [
        "#if\n#endif",
        "#if SIZE $\n#endif",
        "#if 1 1\n#endif",
        "#if 1 & & 1\n#endif",
        "#if definedA\n#endif",
        "#if 1 / 0\n#endif",
        "#if defined\n#endif",
        "#define F(x",
        "#define SIZE 5",
        "#error stop",
        "#warning careful",
    ],
)
def test_what_cannot_be_preprocessed_is_one_error(tmp_path: Path, text: str) -> None:
    compiled, diagnostics = compile_text(tmp_path, f"{text}\nmodule m {{ const int a = SIZE; }};")
    assert not compiled.files
    assert {found.code for found in diagnostics} <= {"E007", "E010"}
    assert diagnostics.errors[0].code == "E007"


@pytest.mark.parametrize(
    ("text", "place", "said"),
    [
        (
            "#define MEMBER(type, name) type name;\nmodule m {};",
            (1, 1),
            "macros with parameters are not supported: write the text of `MEMBER` where it is used",
        ),
        (
            "#define SIZE 5\nmodule m { const int a = SIZE; };",
            (2, 26),
            "macros are not replaced: write the text of `SIZE` here",
        ),
        (
            "#define PASTED(a) a ## b",
            (1, 1),
            "macros with parameters are not supported: write the text of `PASTED` where it is used",
        ),
        (
            "\n#if ICE_VERSION > 3\n#endif\nmodule m {};",
            (2, 1),
            "the condition of #if can have {}, not `ICE_VERSION > 3`; nest #ifdef and #ifndef for others",
        ),
        (
            "#if 0\n#elif (defined(A) || defined(B)) && !defined(C)\n#endif\nmodule m {};",
            (2, 1),
            "the condition of #elif can have {}, not `(defined(A) || defin...`; nest #ifdef and #ifndef for others",
        ),
    ],
)
def test_macros_and_arithmetic_are_refused_with_a_remedy(
    tmp_path: Path, text: str, place: tuple[int, int], said: str
) -> None:
    _, diagnostics = compile_text(tmp_path, text)
    (found,) = diagnostics
    assert (found.code, found.location.line, found.location.column) == ("E007", *place)
    assert found.message == said.format("`defined NAME`, 0, 1, `!`, `&&` and `||`")


@pytest.mark.parametrize(
    ("words", "number"),
    [("!", 50_000), ("! ", 50_000), ("defined ", 20_000), ("1 && ", 30_000), ("(", 50_000)],
)
def test_conditions_without_end_are_read_in_linear_time(tmp_path: Path, words: str, number: int) -> None:
    _, diagnostics = preprocess(tmp_path, f"#if {words * number}\n#endif")
    assert findings(diagnostics) == [("E007", 1, 1)]


def test_a_file_that_is_not_utf8_is_read_with_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "old.idl"
    path.write_bytes(b"\n// a\xf1o\nx")
    diagnostics = Diagnostics()
    source = Preprocessor([], diagnostics).load(path)
    assert source is not None
    assert source.text == "\n// a\xf1o\nx\n"
    assert findings(diagnostics) == [("W003", 2, 5)]


def test_a_directory_and_an_absent_file_are_errors(tmp_path: Path) -> None:
    diagnostics = Diagnostics()
    preprocessor = Preprocessor([], diagnostics)
    assert preprocessor.load(tmp_path) is None
    assert preprocessor.load(tmp_path / "absent.idl") is None
    assert [found.code for found in diagnostics] == ["E001", "E001"]


@pytest.mark.parametrize("name", ["a\nb.idl", "\udcff.idl"])
def test_a_name_that_generated_files_cannot_hold_is_an_error(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("module m { struct S { int a; }; };")
    diagnostics = Diagnostics()
    assert compile_interfaces([tmp_path / name], [], None, diagnostics) == Compilation()
    (error,) = diagnostics
    assert error.code == "E001"
    assert error.message.endswith("its name has unprintable characters")
