"""See the states of an automaton and its transitions as a graph."""

from __future__ import annotations

from functools import cached_property

from ..document import Automaton, State, Transition

__all__ = ["Graph"]


class Graph:
    """The states of an automaton and how they follow one another.

    It is `sound` when ids tell its states apart and its transitions join them; nothing can be said of
    what comes after what in one that is not.
    """

    def __init__(self, automaton: Automaton) -> None:
        self.automaton = automaton
        self.states = {state.id: state for state in automaton.states}
        self.sound = len(self.states) == len(automaton.states) and all(
            {transition.origin, transition.destination} <= self.states.keys()
            for transition in automaton.transitions
        )
        self._outgoing = automaton.all_outgoing()

    @cached_property
    def initial(self) -> State | None:
        """The state in which the automaton begins: the first that says so, or else the first."""
        states = self.automaton.states
        return next((state for state in states if state.initial), states[0] if states else None)

    def outgoing(self, state: State) -> tuple[Transition, ...]:
        """Return what may fire in a state, in the order in which it is tried."""
        return () if state.final else self._outgoing.get(state.id, ())
