"""Why a transition does not fire, in the language of a page: a real automaton explains itself."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from hfsm_runtime import Automaton, State, Transition, VirtualRun
from hfsm_runtime._timeline import Timeline
from hfsm_runtime.debugger._explanation import explain
from hfsm_runtime.debugger.snapshot import structure_of, take_snapshot
from interfaces.hfsm import Explanation
from tests.support.automata import component
from visualhfsm._base.languages import encoder
from visualhfsm._monitor.realm.explanations import explain_moment, translate_explanation
from visualhfsm._monitor.realm.run_log import LiveSnapshot

STATES = (State(id=1, name="a", initial=True), State(id=2, name="b", final=True))


def in_spanish(value: object) -> dict[str, Any]:
    """Return what a Spanish page gets of a value."""
    found: dict[str, Any] = msgspec.json.decode(encoder("es").encode(value))
    return found


def explained(transition: Transition, *events: str) -> Explanation:
    """Explain an automaton after 0.35 s, half a cycle after the last one; events came before that."""
    run = VirtualRun(component(Automaton(id=1, name="walker", states=STATES, transitions=(transition,))))
    timeline = Timeline(run.clock)
    for event in events:
        run.send(event)
    run.advance(0.35)
    return explain(run.tree, run.tree.root, timeline)


def to_b(id: int, **rest: object) -> Transition:
    return Transition(id=id, name=f"t{id}", origin=1, destination=2, **rest)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("transition", "reason"),
    [
        (
            to_b(1, guard=lambda: False, condition="ready"),
            "su guarda `ready` era falsa al evaluarla hace 0,05 s",
        ),
        (to_b(1, guard=lambda: False), "su guarda era falsa al evaluarla hace 0,05 s"),
        (to_b(1, seconds=1.0), "su momento llega tras 0,65 s más en el estado"),
        (
            to_b(1, seconds=0.1, guard=lambda: False),
            "ha llegado su momento, pero su guarda era falsa al evaluarla hace 0,05 s",
        ),
        (to_b(1, event="lost"), "no ha llegado ningún evento lost desde que se entró en el estado"),
    ],
)
def test_why_a_transition_does_not_fire_is_said_in_spanish(transition: Transition, reason: str) -> None:
    said = in_spanish(translate_explanation(explained(transition)))
    assert said["transitions"][0]["reason"] == reason
    assert said["summary"] == f"walker está en a desde hace 0,35 s. 1. t1: {reason}."


def test_a_guard_that_an_event_asked_is_said_in_spanish() -> None:
    asked = explained(to_b(1, event="lost", guard=lambda _: False, condition="ready"), "lost")
    said = in_spanish(translate_explanation(asked))["transitions"][0]["reason"]
    assert said == "su guarda `ready` era falsa cuando llegó lost hace 0,35 s"


def test_values_of_a_guard_are_code_in_every_language() -> None:
    count = 3
    asked = to_b(1, guard=lambda: count > 5, condition="count > 5")
    (reason,) = translate_explanation(explained(asked)).transitions
    assert reason.reason == explained(asked).transitions[0].reason
    said = in_spanish(reason)["reason"]
    assert said == "su guarda `count > 5` era falsa al evaluarla hace 0,05 s; ahora count = 3"


def test_a_state_without_a_way_out_is_explained_in_spanish() -> None:
    ended = explained(to_b(1, guard=lambda: True))
    assert in_spanish(translate_explanation(ended))["summary"] == "walker ha acabado en b; entró por t1."


def looked_back(*transitions: Transition) -> Explanation:
    """Explain the same automaton at a moment that was kept."""
    run = VirtualRun(component(Automaton(id=1, name="walker", states=STATES, transitions=transitions)))
    run.advance(0.35)
    moment = msgspec.Raw(msgspec.json.encode(LiveSnapshot(0.0, take_snapshot(run, 0.0))))
    found = explain_moment(structure_of(run), moment, 1)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("transition", "reason", "spanish"),
    [
        (
            to_b(1, guard=lambda: False, condition="ready"),
            "its guard `ready` was false when it was evaluated last",
            "su guarda `ready` era falsa al evaluarla por última vez",
        ),
        (
            to_b(1, seconds=1.0),
            "its time comes after 0.65 s more in the state",
            "su momento llega tras 0,65 s más en el estado",
        ),
        (
            to_b(1, event="lost"),
            "no event lost has come since the state was entered",
            "no ha llegado ningún evento lost desde que se entró en el estado",
        ),
        (
            to_b(1, finished=True),
            "not all automata of the state have finished",
            "no han acabado todos los autómatas del estado",
        ),
    ],
)
def test_a_moment_of_the_past_is_explained(transition: Transition, reason: str, spanish: str) -> None:
    found = looked_back(transition)
    assert found.transitions[0].reason == reason
    assert found.summary == f"1. t1: {reason}."
    assert in_spanish(found)["transitions"][0]["reason"] == spanish


def test_a_final_state_of_the_past_tries_no_transition() -> None:
    ended = looked_back(to_b(1, guard=lambda: True))
    assert (ended.state, ended.transitions, ended.enteredBy) == (2, [], 1)
