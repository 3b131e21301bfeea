"""What the checks call impossible the model checker never finds possible, in random documents."""

from __future__ import annotations

from pathlib import Path

from hypothesis import HealthCheck, given, settings

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, write_document
from codegen.hfsm.checks import check
from codegen.hfsm.document import Automaton, Document, Text
from codegen.hfsm.known_interfaces import KnownInterfaces
from codegen.hfsm.model_checker import Reachability, check_model
from tests.support.examples import examples
from tests.support.model_documents import after, documents, state, when

PATH = Path("random.xml")


def told_lines(document: Document, *codes: str) -> set[int]:
    diagnostics = Diagnostics()
    check(document, PATH, KnownInterfaces({}), diagnostics)
    return {found.location.line for found in diagnostics if found.code in codes}


def with_lines(document: Document) -> Document:
    read = parse_document(write_document(document), PATH, Diagnostics())
    assert read is not None
    return read


@settings(max_examples=examples(20), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(documents())
def test_a_transition_that_never_fires_is_impossible_in_the_model(document: Document) -> None:
    document = with_lines(document)
    told = told_lines(document, "W516", "W517", "W518")
    report = check_model(document, PATH, limit=4000)
    possible = {
        (result.automaton, result.transition)
        for result in report.transitions
        if result.reachability is Reachability.POSSIBLE
    }
    for automaton in document.automata:
        for transition in automaton.transitions:
            if {transition.line, transition.trigger.line, transition.guard.line} & told:
                assert (automaton.id, transition.id) not in possible


@settings(max_examples=examples(20), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(documents())
def test_a_state_without_a_way_in_is_impossible_in_the_model(document: Document) -> None:
    document = with_lines(document)
    told = told_lines(document, "W514")
    report = check_model(document, PATH, limit=4000)
    for result in report.states:
        automaton = document.automaton(result.automaton)
        assert automaton is not None
        state = automaton.state(result.state)
        assert state is not None
        if state.line in told:
            assert result.reachability is not Reachability.POSSIBLE


def test_the_timer_of_one_that_misses_cycles_as_a_ghost_may_forestall_what_is_always_true() -> None:
    root = Automaton(
        id=1,
        states=(state(1, initial=True), state(2, children=[2])),
        transitions=(after(1, 1, 2, id=1), after(1, 2, 1, id=2)),
        iteration_time=Text("50"),
    )
    below = Automaton(
        id=2,
        father=1,
        states=(state(1, initial=True), state(2)),
        transitions=(after(1, 1, 2, id=1), after(150, 2, 1, id=2), when("True", 2, 1, id=3)),
        iteration_time=Text("130"),
    )
    document = with_lines(Document(automata=(root, below)))
    assert told_lines(document, "W517") == set()
    results = {(each.automaton, each.transition): each for each in check_model(document, PATH).transitions}
    assert results[2, 2].reachability is Reachability.POSSIBLE


def test_a_timer_of_one_period_that_is_tried_first_fires_before_what_is_always_true() -> None:
    transitions = (after(100, 1, 1, id=1), when("True", 1, 1, id=2))
    root = Automaton(
        id=1, states=(state(1, initial=True),), transitions=transitions, iteration_time=Text("100")
    )
    document = with_lines(Document(automata=(root,)))
    assert told_lines(document, "W517") == set()
    first, _ = check_model(document, PATH).transitions
    assert first.reachability is Reachability.POSSIBLE
