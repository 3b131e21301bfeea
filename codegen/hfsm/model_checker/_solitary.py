"""Decide what an automaton does by looking at it alone, where those above it only interrupt it.

An automaton that always resumes, at the times of its cycles, does in its active time what it would do if it
were never interrupted. It does all of that if those above it can let it be active for any length of time.
Exploring a deep tree instead would follow every interruption: with timers on each of 30 levels the lowest
automaton may move for the first time after years.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from ...messages import Message
from ._exploration import Budget, Exploration
from ._fireability import Fireability
from .model import AutomatonModel, Model
from .transition_system import Node, TransitionSystem

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


class Obstacle(StrEnum):
    """Why looking at an automaton alone does not decide what it and those below it do."""

    RESTART = "restart"
    """The state above restarts it."""
    PERIOD = "period"
    """Its period does not divide that of the automaton above."""
    LIMITED = "limited"
    """The state above may last for a limited time only."""
    FINISHED = "finished"
    """It waits until automata below it have finished."""
    SEARCH = "search"
    """Its own timers, guards and events allow too much."""


class Solitary:
    """Explores automata alone, each once."""

    def __init__(self, fireability: Fireability) -> None:
        self._fireability = fireability
        self._known: dict[int, Alone | None] = {}
        self.obstacles: dict[int, Obstacle] = {}
        """The obstacle in an automaton itself to deciding it alone."""

    def reached(self, index: int, budget: Budget) -> Alone | None:
        """Return what an automaton can do, or None if looking at it alone does not decide that."""
        if index not in self._known:
            self._known[index] = self._decide(index, budget)
        return self._known[index]

    def _decide(self, index: int, budget: Budget) -> Alone | None:
        model = self._fireability.model
        parent = model.automata[index].parent
        above = None if parent < 0 else self.reached(parent, budget)
        obstacle = self._obstacle(index, above)
        found = None
        if obstacle is None and (parent < 0 or above is not None):
            found = self._explore(index, budget)
            obstacle = Obstacle.SEARCH if found is None else None
        if obstacle is not None:
            self.obstacles[index] = obstacle
        return found

    def _obstacle(self, index: int, above: Alone | None) -> Obstacle | None:
        """Return what may keep it from resuming at the times of its cycles, or from being active."""
        model = self._fireability.model
        automaton = model.automata[index]
        if automaton.parent >= 0:
            parent = model.automata[automaton.parent]
            owner = parent.states[automaton.owner]
            if owner.restart:
                return Obstacle.RESTART
            if parent.interval % automaton.interval:
                return Obstacle.PERIOD
            if above is not None and owner.index not in above.lasting:
                return Obstacle.LIMITED
        return Obstacle.FINISHED if self._waits(index) else None

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


def remedy(model: Model, automaton: AutomatonModel, obstacle: Obstacle) -> Message:
    """Return what would let an automaton be decided alone."""
    match obstacle:
        case Obstacle.PERIOD:
            above = model.automata[automaton.parent]
            change = Message(
                "its period of {period:g} ms divided that of automaton {above} above it, {longer:g} ms",
                period=automaton.interval / 1e6,
                above=above.source.id,
                longer=above.interval / 1e6,
            )
        case Obstacle.RESTART:
            change = Message("the state above it did not restart it")
        case Obstacle.LIMITED:
            change = Message("the automata above it could stay in its state, or come back to it")
        case Obstacle.FINISHED:
            change = Message("it did not wait until automata below it have finished")
        case Obstacle.SEARCH:
            change = Message("it had fewer guards beside long timers, or timers with a longer common step")
    return Message("automaton {id} would be decided if {change}", id=automaton.source.id, change=change)


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
