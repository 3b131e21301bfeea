"""Faults of the tree of automata, of its states and of its transitions."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.checked_documents import A, B, errors, one
from tests.support.documents import document, problems, state, sub, transition


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        ((), "1:1: E511: there is no automaton"),
        ((sub(1, 0, A), sub(2, 0, A)), "8:1: E511: automaton 2 is a second root"),
        ((sub(1, 0, A), sub(1, 0, A)), "E517: a second automaton has the id 1"),
        ((sub(1, 0, A), sub(2, 1, A)), "8:1: E512: no state owns automaton 2"),
        ((sub(1, 0, state(1, "a", initial=True, child=7)),), "3:1: W512: `a` owns automaton 7, which"),
        (
            (sub(1, 0, state(1, "a", initial=True, child=2), state(2, "b", child=2)), sub(2, 1, A)),
            "4:1: E512: automaton 2 already has an owner",
        ),
        (
            (sub(1, 0, state(1, "a", initial=True, child=2)), sub(2, 3, A)),
            "8:1: E512: automaton 2 says that its father is 3",
        ),
        (
            (
                sub(1, 0, A),
                sub(2, 3, state(1, "a", initial=True, child=3)),
                sub(3, 2, state(1, "a", initial=True, child=2)),
            ),
            "E512: automaton 2 is its own ancestor",
        ),
        (
            tuple(sub(n, n - 1, state(1, "a", initial=True, child=n % 66 and n + 1)) for n in range(1, 67)),
            "E512: automaton 65 is nested deeper than 64",
        ),
        ((sub(1, 0),), "2:1: E513: automaton 1 has no state"),
        ((sub(1, 0, B),), "2:1: W513: automaton 1 has no initial state"),
        ((sub(1, 0, A, state(2, "b", initial=True)),), "4:1: W513: `b` is a second initial state"),
        ((sub(1, 0, A, state(1, "b")),), "4:1: E517: a second state has the id 1"),
        ((sub(1, 0, A, state(0, "b")),), "4:1: E517: the id of a state is at least 1"),
        ((sub(1, 0, A, B, transition(1, 1, 9, "True")),), "5:1: E514: transition 1 enters state 9, which"),
        ((sub(1, 0, A, B, transition(1, 8, 2, "True")),), "5:1: E514: transition 1 leaves state 8, which"),
        ((sub(1, 0, A, B, transition(1, 1, 2, "1", type="never")),), "E515: transition 1 has the type `never`"),
        ((sub(1, 0, A, period="soon"),), "E516: `iteration_time` must be a positive number of milliseconds, not `soon`"),
        ((sub(1, 0, A, period="0"),), "E516: `iteration_time`"),
        ((sub(1, 0, A, period="nan"),), "E516: `iteration_time`"),
    ],
)  # fmt: skip
def test_faults_of_the_structure(path: Path, parts: tuple[str, ...], expected: str) -> None:
    found = problems(path, document(*parts))
    assert any(expected in problem for problem in found), found


@pytest.mark.parametrize("time", ["", "soon", "-5", "inf", "nan", "1_000", "1e300", "-1e-300"])
def test_a_time_that_is_no_positive_number(path: Path, time: str) -> None:
    text = document(sub(1, 0, A, B, transition(1, 1, 2, time, type="time", name="tired")))
    assert "E515: the time of transition `tired` must be a positive number of milliseconds" in one(
        errors(path, text)
    )


def test_names_that_are_empty_or_repeated_are_warned_of(path: Path) -> None:
    there_and_back = [
        transition(number, *ends, "100", type="time")
        for number, ends in enumerate(((1, 2), (2, 3), (3, 1)), 1)
    ]
    found = problems(path, document(sub(1, 0, A, state(2, "a"), state(3, " "), *there_and_back)))
    assert [problem.split(": ")[1] for problem in found] == ["W511", "W510"]


def test_automata_that_own_one_another_are_reported_and_end_the_checks(path: Path) -> None:
    def restarting(id: int, father: int, child: int) -> str:
        timed = transition(id, 1, 1, "100", type="time")
        owner = state(1, "a", initial=True, child=child)
        return sub(id, father, owner.replace("<code>", "<history>restart</history><code>"), timed)

    text = document(sub(1, 0, state(1, "a", initial=True)), restarting(2, 3, 3), restarting(3, 2, 2))
    assert any("is its own ancestor" in problem for problem in problems(path, text))
