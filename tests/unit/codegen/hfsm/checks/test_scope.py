"""Checks of variables of the automata above."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document
from tests.support.documents import document, state, sub


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "walk.xml"


def found(path: Path, *automata: str) -> list[tuple[str, list[str]]]:
    """Return the messages of W535 and W542, each with its notes."""
    path.write_text(document(*automata))
    diagnostics = Diagnostics()
    compile_document(path, None, diagnostics)
    codes = [each.code for each in diagnostics]
    assert "W522" not in codes
    assert "W520" not in codes
    return [
        (each.message, [note.message for note in each.notes])
        for each in diagnostics
        if each.code in ("W535", "W542")
    ]


def nested(code: str, root: str = "print(hits)", variables: str = "hits = 0") -> tuple[str, str, str]:
    return (
        sub(1, 0, state(1, "play", root, initial=True, child=2), variables=variables),
        sub(2, 1, state(1, "look", initial=True, child=3)),
        sub(3, 2, state(1, "hit", code, initial=True)),
    )


OF_ROOT = "`hits` is a variable of the root automaton, and each automaton has its own"
GETS = "it gets its value here"


@pytest.mark.parametrize("code", ["hits += 1", "hits = 1"])
def test_one_that_is_assigned_may_be_an_output(path: Path, code: str) -> None:
    advice = "make it an output of the automaton of the state `look`, or write `self.hits` in both"
    assert found(path, *nested(code)) == [(OF_ROOT, [GETS, advice])]


def test_one_that_is_only_read_may_be_passed_at_each_place(path: Path) -> None:
    advice = "pass it to the automaton of the state `look` as an input, or write `self.hits` in both"
    assert found(path, *nested("print(hits)\nprint(hits)")) == 2 * [(OF_ROOT, [GETS, advice])]


def test_one_that_code_of_the_automaton_above_keeps_is_its_variable_too(path: Path) -> None:
    (message, _), *_ = found(path, *nested("print(hits)", root="hits = 1", variables=""))
    assert message == OF_ROOT


@pytest.mark.parametrize("code", ["hits = 0\nprint(hits)", "self.hits = 1", "print('hits')"])
def test_own_ones_are_no_problem(path: Path, code: str) -> None:
    assert found(path, *nested(code)) == []


def test_the_nearest_automaton_above_is_the_owner(path: Path) -> None:
    root, middle, deepest = nested("hits += 1")
    middle = sub(2, 1, state(1, "look", "print(hits)", initial=True, child=3), variables="hits = 1")
    ((message, _),) = found(path, root, middle, deepest)
    assert (
        message == "`hits` is a variable of the automaton of the state `play`, and each automaton has its own"
    )
