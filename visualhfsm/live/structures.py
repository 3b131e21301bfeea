"""Make of a document, or of what a recording tells, the structure that a monitor would tell."""

from __future__ import annotations

from typing import Final

from codegen.hfsm.document import Automaton, Document, Transition
from interfaces.hfsm import (
    AutomatonStructure,
    ComponentStructure,
    ParameterStructure,
    StateStructure,
    TransitionKind,
    TransitionStructure,
)

__all__ = ["add_state", "structure_of"]

_KINDS: Final = {
    "time": TransitionKind.OnTime,
    "event": TransitionKind.OnEvent,
    "finished": TransitionKind.OnFinished,
}


def structure_of(document: Document, name: str, file: str) -> ComponentStructure:
    """Return the structure of the component of a document."""
    return ComponentStructure(
        name=name,
        document=file,
        generation=0,
        parameters=[
            ParameterStructure(each.name, each.type.text.strip(), each.description.text)
            for each in document.parameters
        ],
        automata=[_automaton(document, automaton, name) for automaton in document.automata],
    )


def add_state(structure: ComponentStructure, automaton: int, title: str, state: int, name: str) -> None:
    """Add a state that a recording tells of and its document does not, as of what it imports."""
    found = next((each for each in structure.automata if each.id == automaton), None)
    if found is None:
        found = AutomatonStructure(
            id=automaton, name=title, parent=0, owner=0, period=0.0, source="", states=[], transitions=[]
        )
        structure.automata.append(found)
    if all(each.id != state for each in found.states):
        found.states.append(
            StateStructure(id=state, name=name, initial=False, final=False, children=[], restart=False)
        )


def _automaton(document: Document, automaton: Automaton, name: str) -> AutomatonStructure:
    owner = document.owner(automaton)
    return AutomatonStructure(
        id=automaton.id,
        name=owner.name if owner else name,
        parent=automaton.father,
        owner=owner.id if owner else 0,
        period=_number(automaton.iteration_time.text) / 1000,
        source="",
        states=[
            StateStructure(
                id=state.id,
                name=state.name,
                initial=state.initial,
                final=state.final,
                children=list(state.children),
                restart=state.history.text.strip() == "restart",
            )
            for state in automaton.states
        ],
        transitions=[_transition(automaton, transition) for transition in automaton.transitions],
    )


def _transition(automaton: Automaton, transition: Transition) -> TransitionStructure:
    kind = _KINDS.get(transition.type, TransitionKind.OnCondition)
    trigger = transition.trigger.text.strip()
    return TransitionStructure(
        id=transition.id,
        name=transition.name,
        origin=transition.origin,
        destination=transition.destination,
        kind=kind,
        seconds=_number(trigger) / 1000 if kind == TransitionKind.OnTime else 0.0,
        event=trigger if kind == TransitionKind.OnEvent else "",
        condition=trigger if kind == TransitionKind.OnCondition else transition.guard.text.strip(),
        order=automaton.outgoing(transition.origin).index(transition) + 1,
    )


def _number(text: str) -> float:
    try:
        return max(0.0, float(text))
    except ValueError:
        return 0.0
