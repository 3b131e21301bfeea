"""Which automata a question depends on; all others are left out of the search."""

from __future__ import annotations

from collections.abc import Iterable

from .fireability import Fireability
from .model import Model

__all__ = ["cone_of"]


def cone_of(model: Model, automata: Iterable[int], fireability: Fireability) -> frozenset[int]:
    """Return some automata with all that influence them.

    These are the automata above, and those below a state that is left when they have finished.
    """
    cone: set[int] = set()
    new = list(automata)
    while new:
        index = new.pop()
        if index in cone:
            continue
        cone.add(index)
        automaton = model.automata[index]
        if automaton.parent >= 0:
            new.append(automaton.parent)
        for transition in automaton.transitions:
            if transition.finished and fireability.may_fire(index, transition):
                new.extend(automaton.states[transition.origin].children)
    return frozenset(cone)
