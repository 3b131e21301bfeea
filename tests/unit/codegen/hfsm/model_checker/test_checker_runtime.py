"""The model checker against the runtime: random documents, and every counterexample played in virtual time."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from codegen.hfsm.document import Document
from codegen.hfsm.model_checker import PropertyResult, Reachability, StepKind, Verdict, check_model
from tests.support.examples import examples
from tests.support.model_documents import PATH, Player, Script, documents, impossible, play, stated

LIMIT = 30_000

_settings = settings(
    max_examples=examples(12),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


def roll(document: Document, seed: int, seconds: float = 5.0) -> Player:
    """Run a document with random guards and events."""
    script = Script(document, seed)
    player = Player(document, script.guard, script.events)
    player.virtual.advance(seconds)
    assert not player.virtual.errors  # nothing that proofs rely on is called wrong
    return player


@pytest.mark.slow
@_settings
@given(documents(), st.integers(0, 2**32))
def test_nothing_that_runs_do_is_called_impossible(document: Document, seed: int) -> None:
    states, transitions = impossible(check_model(document, PATH, limit=LIMIT))
    for number in range(2 if states or transitions else 0):
        player = roll(document, seed + number)
        assert not player.visited & states
        assert not {(fired.automaton, fired.transition) for fired in player.fired_} & transitions


@pytest.mark.slow
@_settings
@given(documents())
def test_what_is_called_possible_happens_when_it_is_played(document: Document) -> None:
    states = check_model(document, PATH, limit=LIMIT).states
    never = tuple(stated("never", f"#{state.automaton}/s{state.state}") for state in states)
    asked = Document(automata=document.automata, events=document.events, properties=never)
    results = check_model(asked, PATH, limit=LIMIT * len(never)).properties
    for state, result in zip(states, results, strict=True):
        if state.reachability is Reachability.POSSIBLE:
            assert result.verdict in (Verdict.VIOLATED, Verdict.UNDECIDED)
        elif state.reachability is Reachability.IMPOSSIBLE:
            assert result.verdict in (Verdict.HOLDS, Verdict.UNDECIDED)
        if result.counterexample is not None:
            player = play(asked, result.counterexample)
            assert (state.automaton, state.state) in player.visited
            assert_same_firings(result, player)


@st.composite
def stated_documents(draw: st.DrawFn) -> Document:
    """Draw a document with a property of it."""
    document = draw(documents())
    atoms = [f"#{automaton.id}/{state.name}" for automaton in document.automata for state in automaton.states]
    atoms += [
        f"{function}(#{automaton.id})"
        for automaton in document.automata
        for function in ("active", "ghost", "finished")
    ]
    one = st.sampled_from(atoms)
    pair = st.tuples(one, st.sampled_from(["and", "or", "->", "and not"]), one).map(" ".join)
    kind = draw(st.sampled_from(["always", "eventually", "never", "eventually"]))
    within = draw(st.sampled_from(["", "", "350", "1000", "2500"]))
    return Document(
        automata=document.automata,
        events=document.events,
        properties=(stated(kind, draw(one | pair), within),),
    )


@_settings
@given(stated_documents())
def test_a_counterexample_violates_its_property_on_the_runtime(document: Document) -> None:
    (result,) = check_model(document, PATH, limit=LIMIT).properties
    assume(result.counterexample is not None)
    assert result.counterexample is not None
    player = play(document, result.counterexample)
    assert_same_firings(result, player)
    assert_violated(result, player)


@pytest.mark.slow
@settings(_settings, max_examples=examples(8))
@given(stated_documents(), st.integers(0, 2**32))
def test_a_property_that_holds_is_violated_by_no_run(document: Document, seed: int) -> None:
    (result,) = check_model(document, PATH, limit=LIMIT).properties
    assume(result.verdict is Verdict.HOLDS)
    stated = result.property
    within = float(stated.within.text) * 1e6 if stated.within.text else None
    if within is None and stated.kind == "eventually":
        return  # a run that ends cannot violate it
    for number in range(2):
        player = roll(document, seed + number, 5.0 if within is None else within / 1e9)
        times = player.times(stated.expression.text)
        if stated.kind == "never":
            assert not [time for time in times if within is None or time <= within]
        elif stated.kind == "always":
            expected = [time for time, _ in player.seen]
            assert [t for t in times if within is None or t <= within] == [
                t for t in expected if within is None or t <= within
            ]
        elif within is not None:
            assert times
            assert times[0] <= within


def assert_violated(result: PropertyResult, player: Player) -> None:
    stated, example = result.property, result.counterexample
    assert example is not None
    times = player.times(stated.expression.text)
    end = round(example.ends_ms * 1e6)
    if stated.kind == "never":
        assert end in times
    elif stated.kind == "always":
        assert len([time for time in times if time == end]) < len([t for t, _ in player.seen if t == end])
    else:
        assert not times


def assert_same_firings(result: PropertyResult, player: Player) -> None:
    """Assert that the runtime does what the steps say, and nothing else in these automata."""
    example = result.counterexample
    assert example is not None
    explained = {step.automaton for step in example.steps}
    end = round(example.ends_ms * 1e6)
    expected = [
        (round(step.time_ms * 1e6), step.automaton, step.transition)
        for step in example.steps
        if step.kind is StepKind.FIRES
    ]
    done = [tuple(fired) for fired in player.fired_ if fired.automaton in explained and fired.time <= end]
    assert done[: len(expected)] == expected
    later = done[len(expected) :]
    assert all(time == end for time, _, _ in later), "what is not explained fires only after the end"
