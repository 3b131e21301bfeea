"""Automata that are only interrupted by those above them are decided alone, however deep they are."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from codegen.diagnostics import Diagnostic, Diagnostics
from codegen.hfsm.document import Document, Text
from codegen.hfsm.model_checker import Reachability, Verdict, check_model, report_model
from codegen.hfsm.model_checker._exploration import Budget
from codegen.hfsm.model_checker._fireability import fireability_of
from codegen.hfsm.model_checker._solitary import Alone, Obstacle, Solitary
from codegen.hfsm.model_checker.model import read_model
from tests.support.model_documents import PATH, after, automaton, document, finished, state, stated, when

DEPTH = 30


def deep(guard: str = "", dead: int = 0) -> Document:
    """Return a chain of automata, each below the first state of the one above, with two timers each.

    In the automaton `dead`, a third state is left out by an earlier timer.
    """
    automata = []
    for level in range(1, DEPTH + 1):
        states = [state(1, children=[level + 1] if level < DEPTH else []), state(2)]
        ways = [
            after(100 * (1 + level * 7 % 11), 1, 2, guard, id=1),
            after(100 * (1 + level * 5 % 7), 2, 1, id=2),
        ]
        if level == dead:
            states.append(state(3))
            ways.append(after(100 * (3 + level * 7 % 11), 1, 3, id=3))
        automata.append(automaton(level, states, ways, father=level - 1))
    return document(*automata)


@pytest.mark.parametrize("guard", ["", "a"])
def test_timers_on_each_of_30_levels_are_decided(guard: str) -> None:
    report = check_model(deep(guard), PATH)
    assert report.complete
    assert {each.reachability for each in report.states} == {Reachability.POSSIBLE}
    assert {each.reachability for each in report.transitions} == {Reachability.POSSIBLE}
    assert report.work < 2000


def test_what_cannot_happen_deep_below_is_impossible() -> None:
    report = check_model(deep(dead=20), PATH)
    found = [(each.automaton, each.state) for each in report.states if each.reachability != "possible"]
    assert found == [(20, 3)]
    assert report.complete


def with_periods(*periods: float) -> Document:
    """Return such a chain, whose automata have these periods in turn."""
    made = deep()
    automata = (
        replace(each, iteration_time=Text(f"{periods[level % len(periods)]:g}"))
        for level, each in enumerate(made.automata)
    )
    return replace(made, automata=tuple(automata))


def undecided(made: Document) -> list[Diagnostic]:
    """Return what is reported of searches that ended at their limit."""
    report, diagnostics = check_model(made, PATH), Diagnostics()
    report_model(report, diagnostics)
    found = [each for each in diagnostics if each.code == "N607"]
    assert bool(found) != report.complete
    return found


def test_timers_of_different_periods_on_30_levels_say_what_would_decide_them() -> None:
    (found,) = undecided(with_periods(100, 40))
    assert re.fullmatch(
        r"the search ended at its limit: it is undecided whether \d+ states and \d+ transitions can happen",
        found.message,
    )
    assert found.notes[0].message == (
        "automaton 2 would be decided if its period of 40 ms divided that of automaton 1 above it, 100 ms"
    )
    assert found.notes[1].message == (
        "automaton 3 would be decided if its period of 100 ms divided that of automaton 2 above it, 40 ms"
    )
    assert found.notes[-1].message == "so it is with 26 more automata"


@pytest.mark.slow
@pytest.mark.parametrize("periods", [(100, 40), (20, 50, 100, 200), (7, 11, 13, 17)])
def test_what_would_decide_them_does(periods: tuple[float, ...]) -> None:
    made = with_periods(*periods)
    obstacles = dict(check_model(made, PATH).obstacles)
    assert set(obstacles.values()) == {Obstacle.PERIOD}
    equal = tuple(replace(each, iteration_time=made.automata[0].iteration_time) for each in made.automata)
    assert undecided(replace(made, automata=equal)) == []


def test_a_property_that_needs_too_long_a_search_says_what_may_decide_it() -> None:
    asked = replace(deep(), properties=(stated("never", "#30/s2 and #29/s1 and #28/s1"),))
    report = check_model(asked, PATH, limit=1000)
    assert [each.verdict for each in report.properties] == [Verdict.UNDECIDED]
    diagnostics = Diagnostics()
    report_model(report, diagnostics)
    (found,) = [each for each in diagnostics if each.code == "W611"]
    assert "a higher `limit`" in found.notes[0].message


def alone(made: Document, index: int) -> Alone | None:
    """Return what an automaton of a document does alone, by its index."""
    return Solitary(fireability_of(read_model(made, PATH), frozenset())).reached(index, Budget(10_000))


def below(*ways: object, period: float = 100, history: str = "", inner: float = 100) -> Document:
    """Return an automaton below the first state of another one with these transitions."""
    states = [state(1, children=[2], history=history), state(2), state(3, final=True)]
    lower = automaton(2, [state(1), state(2)], [after(300, 1, 2, id=1)], father=1, period=inner)
    return document(automaton(1, states, ways, period=period), lower)  # type: ignore[arg-type]


def test_it_is_decided_alone_where_it_may_be_active_for_any_time() -> None:
    everything = Alone(frozenset({0, 1}), frozenset({0}), frozenset({1}))
    again = [after(200, 1, 2), after(100, 2, 1)]
    assert alone(below(), 1) == everything
    assert alone(below(*again), 1) == everything
    assert alone(below(when("a", 1, 2)), 1) == everything
    assert alone(below(*again, inner=50), 1) == everything


@pytest.mark.parametrize(
    "made",
    [
        below(after(200, 1, 2)),
        below(after(200, 1, 2), after(100, 2, 1), history="restart"),
        below(after(200, 1, 2), after(100, 2, 1), inner=130),
        below(after(200, 1, 2), after(100, 2, 1), period=50),
    ],
    ids=["left for good", "restarts", "no common multiple", "interrupted between its cycles"],
)
def test_it_is_not_decided_alone_otherwise(made: Document) -> None:
    assert alone(made, 1) is None


def test_an_automaton_that_waits_for_those_below_it_is_not_decided_alone() -> None:
    lower = automaton(2, [state(1), state(2, final=True)], [after(300, 1, 2)], father=1)
    upper = automaton(1, [state(1, children=[2]), state(2)], [finished(1, 2), after(400, 2, 1)])
    made = document(upper, lower)
    fireability = fireability_of(read_model(made, PATH), frozenset())
    assert Solitary(fireability).reached(0, Budget(10_000)) is None
    assert {each.reachability for each in check_model(made, PATH).states} == {Reachability.POSSIBLE}


def test_the_lowest_is_not_decided_alone_if_one_in_between_is_not_aligned() -> None:
    lowest = automaton(3, [state(1), state(2)], [after(300, 1, 2)], father=2, period=50)
    middle = automaton(2, [state(1, children=[3]), state(2)], [after(300, 1, 2)], father=1, period=100)
    ways = [after(150, 1, 2), after(150, 2, 1)]
    highest = automaton(1, [state(1, children=[2]), state(2)], ways, period=150)
    assert alone(document(highest, middle, lowest), 2) is None
