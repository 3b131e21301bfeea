"""Decide what an automaton does by looking at it alone, where those above it only interrupt it.

An automaton that always resumes, at the times of its cycles, does in its active time what it would do if it
were never interrupted. It does all of that if those above it can let it be active for any length of time.
Exploring a deep tree instead would follow every interruption: with timers on each of 30 levels the lowest
automaton may move for the first time after years.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from .exploration import Budget, Exploration
from .fireability import Fireability
from .transition_system import Node, TransitionSystem

__all__ = ["Alone", "Solitary"]


_MOST_NODES: Final = 2000
"""The most nodes among which loops are searched: the work grows with the square."""


@dataclass(frozen=True)
class Alone:
    """The states and transitions of an automaton that is never interrupted, and the states that last.

    In some run it spends any length of time in a `lasting` state, at once or in several visits.
    """

    states: frozenset[int]
    transitions: frozenset[int]
    lasting: frozenset[int]


class Solitary:
    """Explores automata alone, each once."""

    def __init__(self, fireability: Fireability) -> None:
        self._fireability = fireability
        self._known: dict[int, Alone | None] = {}

    def reached(self, index: int, budget: Budget) -> Alone | None:
        """Return what an automaton can do, or None if looking at it alone does not decide that."""
        if index not in self._known:
            is_decided = self._is_only_interrupted(index, budget) and not self._waits(index)
            self._known[index] = self._explore(index, budget) if is_decided else None
        return self._known[index]

    def _is_only_interrupted(self, index: int, budget: Budget) -> bool:
        """Return whether it always resumes, at the times of its cycles, and may be active for any time."""
        model = self._fireability.model
        automaton = model.automata[index]
        if automaton.parent < 0:
            return True
        parent = model.automata[automaton.parent]
        owner = parent.states[automaton.owner]
        if owner.restart or parent.interval % automaton.interval:
            return False
        above = self.reached(parent.index, budget)
        return above is not None and owner.index in above.lasting

    def _waits(self, index: int) -> bool:
        """Return whether it may wait until automata below it have finished."""
        transitions = self._fireability.model.automata[index].transitions
        return any(each.finished and self._fireability.may_fire(index, each) for each in transitions)

    def _explore(self, index: int, budget: Budget) -> Alone | None:
        system = TransitionSystem([index], self._fireability, alone=True)
        exploration = Exploration(system, budget)
        states = {exploration.start[0][0]}
        transitions: set[int] = set()
        resting: set[int] = set()
        following: dict[Node, set[Node]] = {}
        for move in exploration.moves():
            state = move.configuration[0][0]
            states.add(state)
            if move.choice.transition is not None:
                transitions.add(move.choice.transition.index)
            if move.following.position < 0 or system.may_rest(move.configuration):
                resting.add(state)
            following.setdefault(move.node, set()).add(move.following)
        if exploration.first.position < 0 or system.may_rest(exploration.start):
            resting.add(exploration.start[0][0])
        if not exploration.complete:
            return None
        return Alone(frozenset(states), frozenset(transitions), frozenset(resting | _recurring(following)))


def _recurring(following: dict[Node, set[Node]]) -> set[int]:
    """Return the states to which a run can return again and again: those of nodes on a loop.

    None are found among very many nodes.
    """
    found: set[int] = set()
    if len(following) > _MOST_NODES:
        return found
    for node in following:
        state = node.configuration[0][0]
        if state in found:
            continue
        seen: set[Node] = set()
        new = [node]
        while new and node not in seen:
            for each in following.get(new.pop(), ()):
                if each not in seen:
                    seen.add(each)
                    new.append(each)
        if node in seen:
            found.add(state)
    return found
