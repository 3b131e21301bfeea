"""Places for the states of documents that have none, so that a picture does not show them as one heap."""

from __future__ import annotations

from dataclasses import replace

from codegen.hfsm.document import Automaton
from codegen.hfsm.positions import on_circle
from visualhfsm._document.geometry import with_default_handles


def spread(automaton: Automaton) -> Automaton:
    """Return an automaton whose states are apart: on a circle, if all of them have the same position."""
    count = len(automaton.states)
    if count < 2 or len({(state.x, state.y) for state in automaton.states}) > 1:
        return automaton
    states = []
    for number, state in enumerate(automaton.states, start=1):
        x, y = on_circle(number, count)
        states.append(replace(state, x=x, y=y))
    apart = replace(automaton, states=tuple(states))
    return with_default_handles(apart, frozenset(each.id for each in apart.transitions))
