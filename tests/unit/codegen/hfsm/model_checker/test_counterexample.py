"""Counterexamples are steps that the runtime takes, too."""

from __future__ import annotations

import json
from dataclasses import asdict, replace

import pytest

from codegen.hfsm.model_checker import StepKind
from tests.support.model_documents import blink, chain, document, play, stated, verdicts, when


def test_a_counterexample_is_the_steps_that_lead_there() -> None:
    (result,) = verdicts(blink(when("smoke", 2, 3, id=3, name="smoke")), stated("never", "broken"))
    assert result.counterexample is not None
    steps = [(s.time_ms, s.kind, s.origin, s.state, s.transition) for s in result.counterexample.steps]
    assert steps == [
        (0.0, StepKind.ENTERS, None, 1, None),
        (300.0, StepKind.FIRES, 1, 2, 1),
        (400.0, StepKind.GUARD, 2, 2, 3),
        (400.0, StepKind.FIRES, 2, 3, 3),
    ]
    assert result.counterexample.ends_ms == 400.0
    assert json.loads(json.dumps(asdict(result.counterexample)))["steps"][3]["kind"] == "fires"


def test_what_may_never_come_is_a_loop_that_the_runtime_goes_round() -> None:
    doc = blink(when("smoke", 2, 3, id=3))
    (result,) = verdicts(doc, stated("eventually", "broken"))
    assert result.counterexample is not None
    assert result.counterexample.repeats is not None
    player = play(doc, result.counterexample, rounds=5)
    assert not player.times("broken")
    assert len(player.fired_) > 5


@pytest.mark.slow
def test_a_way_through_many_automata_is_found() -> None:
    doc = chain(6)
    (result,) = verdicts(doc, stated("never", "#6/s9"))
    assert result.counterexample is not None
    assert (6, 9) in play(doc, result.counterexample).visited


def test_a_way_found_without_time_fits_periods_of_any_kind() -> None:
    doc = chain(3)
    automata = [
        replace(a, iteration_time=replace(a.iteration_time, text=t))
        for a, t in zip(doc.automata, ("97", "131", "53"), strict=True)
    ]
    doc = document(*automata)
    (result,) = verdicts(doc, stated("never", "#3/s9"))
    assert result.counterexample is not None
    assert round(result.counterexample.ends_ms * 1e6) in play(doc, result.counterexample).times("#3/s9")


def test_a_guard_that_begins_like_an_event_is_none() -> None:
    (result,) = verdicts(blink(when("event is None", 2, 3, id=3)), stated("never", "broken"))
    assert result.counterexample is not None
    assert StepKind.EVENT not in [step.kind for step in result.counterexample.steps]
