"""Code that is not Python: the document names its language, and its first code is reported."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostic, Diagnostics
from codegen.hfsm import compile_document, read_document, write_document
from tests.support.documents import document, state, sub, transition
from visualhfsm._document.conversion import convert_document


def errors_of(directory: Path, *parts: str, head: str = "") -> list[Diagnostic]:
    path = directory / "main.xml"
    path.write_text(document(*parts, head=head))
    diagnostics = Diagnostics()
    assert (compile_document(path, None, diagnostics) is None) == bool(diagnostics.errors)
    return diagnostics.errors


IN_CPP = "<language>C++</language>"
CPP = sub(
    1,
    0,
    state(1, "go", "motors->setV(0.2);", initial=True),
    state(2, "stop", "if (x) {\n  stop();\n}"),
    transition(1, 1, 2, "x && y", code="int n = 3;"),
    functions="void stop() {}",
)


def test_a_document_in_cpp_is_one_error(tmp_path: Path) -> None:
    (error,) = errors_of(tmp_path, CPP, head=IN_CPP)
    assert error.code == "E525"
    assert error.message == "C++ in a function of automaton 1: it is kept, but only Python can run"


@pytest.mark.parametrize(
    ("parts", "what"),
    [
        ((state(1, "go", "x = 1", initial=True), state(2, "b", "y->z();")), "C++ in the code of state `b`"),
        (
            (state(1, "go", "y->z();", initial=True), state(2, "b", "y->z();")),
            "C++ in the code of state `go`",
        ),
        (
            (state(1, "go", "x = 1", initial=True), transition(3, 1, 1, "x && y")),
            "C++ in the condition of transition 3",
        ),
    ],
)
def test_the_first_piece_is_named(tmp_path: Path, parts: tuple[str, ...], what: str) -> None:
    (error,) = errors_of(tmp_path, sub(1, 0, *parts), head=IN_CPP)
    assert error.code == "E525"
    assert error.message.startswith(what)


def test_semicolons_do_not_make_a_document_cpp(tmp_path: Path) -> None:
    code = sub(1, 0, state(1, "go", "x = x + 1;\nprint(x);\nself.stop();", initial=True), variables="x = 0;")
    assert errors_of(tmp_path, code) == []


@pytest.mark.parametrize(
    "code", ["x = x + 1;\ny = = x;", "def f() -> int:\n  x = = 1", "motors->setV(0.2);", "int x = 3;\nx = 2;"]
)
def test_a_document_that_does_not_say_so_is_python_whatever_its_code(tmp_path: Path, code: str) -> None:
    path = tmp_path / "main.xml"
    path.write_text(document(sub(1, 0, state(1, "go", code, initial=True), state(2, "b", "z = = 1"))))
    diagnostics = Diagnostics()
    assert compile_document(path, None, diagnostics) is None
    assert [error.code for error in diagnostics.errors] == ["E520", "E520"]
    read = read_document(path, diagnostics)
    assert read is not None
    assert "language" not in write_document(read)


def test_code_that_looks_like_cpp_gets_a_hint(tmp_path: Path) -> None:
    (error,) = errors_of(tmp_path, sub(1, 0, state(1, "go", "motors->setV(0.2);", initial=True)))
    hints = ["if the document is in C++, declare it: `<language>C++</language>`"]
    assert [note.message for note in error.notes] == hints


def test_a_document_that_is_cpp_throughout_is_one_error_and_stays_as_it_is(tmp_path: Path) -> None:
    (error,) = errors_of(tmp_path, CPP)
    assert error.code == "E525"
    assert error.message == "most of the code looks like C++: it is kept, but only Python can run"
    hints = [note.message for note in error.notes]
    assert hints[0].startswith("as Python it is wrong here: ")
    assert hints[1:] == ["if the document is in C++, declare it: `<language>C++</language>`"]
    diagnostics = Diagnostics()
    assert "<language>" not in convert_document(tmp_path / "main.xml", diagnostics, fixes_python2=True)
    assert [found.code for found in diagnostics] == ["N502"]


def test_a_document_may_say_its_language(tmp_path: Path) -> None:
    code = sub(1, 0, state(1, "go", "x = 1", initial=True))
    (error,) = errors_of(tmp_path, code, head="<language>Java</language>")
    assert (error.code, error.message) == (
        "E525",
        "Java in the code of state `go`: it is kept, but only Python can run",
    )
    assert errors_of(tmp_path, code, head="<language>Python</language>") == []


def test_a_document_without_code_runs_whatever_its_language(tmp_path: Path) -> None:
    code = sub(1, 0, state(1, "go", initial=True))
    assert errors_of(tmp_path, code, head="<language>C++</language>") == []


def test_faults_of_python_are_reported_one_by_one(tmp_path: Path) -> None:
    errors = errors_of(tmp_path, sub(1, 0, state(1, "a", "x = = 1", initial=True), state(2, "b", "y = = 1")))
    assert [error.code for error in errors] == ["E520", "E520"]


def test_code_that_was_escaped_twice_is_no_cpp(tmp_path: Path) -> None:
    code = "if x &lt; 3:  # a new Word\n    y = 1"
    (error,) = errors_of(tmp_path, sub(1, 0, state(1, "a", code, initial=True)))
    assert (error.code, error.location.line) == ("E520", 3)
    assert "escaped twice" in error.message
