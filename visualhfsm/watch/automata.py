"""The automata of a component as a tree, and what a snapshot says about each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from interfaces.hfsm import (
    AutomatonSnapshot,
    AutomatonStructure,
    ComponentSnapshot,
    ComponentStructure,
    StateStructure,
    TransitionStructure,
)

__all__ = ["Automata", "StateRow", "by_id", "printable"]


_DEEPEST: Final = 64
"""Levels of automata that are shown; codegen makes no more."""


@dataclass(frozen=True, slots=True)
class StateRow:
    """A state in the tree; `last` tells of each owner above and of itself whether it is the last sibling."""

    automaton: AutomatonStructure
    state: StateStructure
    last: tuple[bool, ...]


class Automata:
    """Find automata, states and transitions by id; unknown ids get a name that shows them."""

    def __init__(self, structure: ComponentStructure) -> None:
        _clean(structure)
        self.name = structure.name
        self.generation = structure.generation
        self.all: Sequence[AutomatonStructure] = tuple(structure.automata)
        self._by_id = {automaton.id: automaton for automaton in self.all}
        self._states = {(a.id, state.id): state for a in self.all for state in a.states}
        self._transitions = {
            (a.id, transition.id): transition for a in self.all for transition in a.transitions
        }

    def __contains__(self, automaton: int) -> bool:
        return automaton in self._by_id

    def automaton(self, automaton: int) -> AutomatonStructure | None:
        """Return an automaton, or None when the component has none of this id."""
        return self._by_id.get(automaton)

    def automaton_name(self, automaton: int) -> str:
        """Return the name of the state that owns an automaton, or of the component for the root."""
        found = self._by_id.get(automaton)
        return found.name if found else f"automaton {automaton}"

    def state_name(self, automaton: int, state: int) -> str:
        """Return the name of a state."""
        found = self._states.get((automaton, state))
        return found.name if found else f"state {state}"

    def transition(self, automaton: int, transition: int) -> TransitionStructure | None:
        """Return a transition, or None when the automaton has none of this id."""
        return self._transitions.get((automaton, transition))

    def destination_name(self, automaton: int, transition: int) -> str:
        """Return the name of the state that a transition enters."""
        found = self.transition(automaton, transition)
        return self.state_name(automaton, found.destination) if found else f"transition {transition}"

    def awaited(self, automaton: int, state: int) -> list[str]:
        """Return the names of the events that transitions out of a state wait for."""
        found = self._by_id.get(automaton)
        events = [t.event for t in found.transitions if t.origin == state and t.event] if found else []
        return list(dict.fromkeys(events))

    def depth(self, automaton: int) -> int:
        """Return how many automata are above one."""
        return sum(1 for _ in self.ancestors(automaton))

    def ancestors(self, automaton: int) -> Iterator[int]:
        """Yield the ids of the automata above one, the nearest first."""
        seen = {automaton}
        found = self._by_id.get(automaton)
        while found is not None and found.parent in self._by_id and found.parent not in seen:
            seen.add(found.parent)
            yield found.parent
            found = self._by_id.get(found.parent)

    def rows(self) -> Iterator[StateRow]:
        """Yield every state in document order, each before the states of the automaton that it owns."""
        roots = [automaton for automaton in self.all if automaton.parent not in self._by_id]
        # What is not a tree, which no component of ours sends, still ends: no automaton is visited twice.
        visited: set[int] = set()
        for root in roots[:1]:
            yield from self._rows_below(root, (), visited)

    def _rows_below(
        self, automaton: AutomatonStructure, last: tuple[bool, ...], visited: set[int]
    ) -> Iterator[StateRow]:
        visited.add(automaton.id)
        for position, state in enumerate(automaton.states, 1):
            here = (*last, position == len(automaton.states))
            yield StateRow(automaton, state, here)
            for number in state.children:
                child = self._by_id.get(number)
                if child is not None and child.id not in visited and len(here) < _DEEPEST:
                    yield from self._rows_below(child, here, visited)

    def current_path(self, snapshot: ComponentSnapshot) -> list[str]:
        """Return the names of the current states from the root down to the innermost running automaton.

        Where a state owns several automata it follows the first.
        """
        return next(self.current_paths(snapshot), [])

    def current_paths(self, snapshot: ComponentSnapshot) -> Iterator[list[str]]:
        """Yield such a path for each branch, where states own several automata that run side by side."""
        states = by_id(snapshot)
        root = next((a for a in self.all if a.parent not in self._by_id), None)
        if root is not None:
            yield from self._paths_below(root, states, [], set())

    def _paths_below(
        self,
        automaton: AutomatonStructure,
        states: dict[int, AutomatonSnapshot],
        above: list[str],
        visited: set[int],
    ) -> Iterator[list[str]]:
        visited.add(automaton.id)
        found = states.get(automaton.id)
        if found is None:
            if above:
                yield above
            return
        path = [*above, self.state_name(automaton.id, found.state)]
        state = self._states.get((automaton.id, found.state))
        below = [self._by_id[child] for child in state.children if child in self._by_id] if state else []
        below = [child for child in below if child.id not in visited and len(path) < _DEEPEST]
        if not below or (state is not None and state.final):
            yield path
            return
        for child in below:
            yield from self._paths_below(child, states, path, visited)

    def active_since(self, snapshot: ComponentSnapshot, automaton: int) -> float:
        """Return the component time since which an automaton has run without being a ghost.

        That is when the last of its ancestors entered its current state, or 0 for the root.
        """
        entered = {other.id: other.enteredAt for other in snapshot.automata}
        return max((entered.get(ancestor, 0.0) for ancestor in self.ancestors(automaton)), default=0.0)


def printable(text: str) -> str:
    """Replace what is no visible character: a terminal would obey it, a line break would break the view."""
    return "".join(
        character if character.isprintable() else "\N{REPLACEMENT CHARACTER}" for character in text
    )


def _clean(structure: ComponentStructure) -> None:
    structure.name = printable(structure.name)
    for automaton in structure.automata:
        automaton.name = printable(automaton.name)
        for state in automaton.states:
            state.name = printable(state.name)
        for transition in automaton.transitions:
            transition.name = printable(transition.name)
            transition.event = printable(transition.event)


def by_id(snapshot: ComponentSnapshot) -> dict[int, AutomatonSnapshot]:
    """Return the automata of a snapshot by their ids."""
    return {automaton.id: automaton for automaton in snapshot.automata}
