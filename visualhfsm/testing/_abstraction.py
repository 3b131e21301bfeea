"""Automata of a document without its code: a test sets their guards, and the robot plays no part.

This is the model checker's view, run by the runtime itself: states, timers, events and hierarchy.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from codegen.hfsm.document import Document
from codegen.hfsm.model_checker.model import AutomatonModel, Model, StateModel, TransitionModel, read_model
from hfsm_runtime import Automaton, Component, State, Transition

_SECOND: Final = 1e9


def abstract_component(document: Document, path: Path) -> type[Component]:
    """Return a component with the automata of a document, without code and with all guards false."""
    model = read_model(document, path)

    class Abstract(Component, document=path.name):
        def automaton(self) -> Automaton:
            return _automaton(model, model.automata[0], path.stem)

    return Abstract


def _automaton(model: Model, automaton: AutomatonModel, name: str) -> Automaton:
    return Automaton(
        id=automaton.source.id,
        name=name,
        period=automaton.interval / _SECOND,
        states=tuple(
            _state(model, state, initial=state.index == automaton.initial) for state in automaton.states
        ),
        transitions=tuple(_transition(automaton, each) for each in automaton.transitions),
    )


def _state(model: Model, state: StateModel, *, initial: bool) -> State:
    return State(
        id=state.source.id,
        name=state.source.name,
        initial=initial,
        final=state.final,
        entry=(lambda: None) if state.owes else None,  # it takes the first cycle, as the real one does
        children=tuple(
            _automaton(model, model.automata[child], state.source.name) for child in state.children
        ),
        restart=state.restart,
    )


def _transition(automaton: AutomatonModel, transition: TransitionModel) -> Transition:
    timed = transition.source.type == "time" and transition.delay > 0
    guarded = transition.guarded or not (timed or transition.event or transition.finished)
    return Transition(
        id=transition.source.id,
        name=transition.source.name,
        origin=automaton.states[transition.origin].source.id,
        destination=automaton.states[transition.target].source.id,
        seconds=transition.delay / _SECOND if timed else None,
        event=transition.event,
        finished=transition.finished,
        guard=(lambda *_: False) if guarded else None,
        condition=(transition.source.guard.text or transition.source.trigger.text) if guarded else "",
        priority=1 + automaton.states[transition.origin].outgoing.index(transition),  # they are in order
    )
