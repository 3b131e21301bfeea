"""See the states of an automaton and its transitions as a graph."""

from __future__ import annotations

from functools import cached_property

from ...diagnostics import Note
from ..document import Automaton, State, Transition
from .labels import state_label
from .report import Report

__all__ = ["Graph", "check_graph"]


class Graph:
    """The states of an automaton and how they follow one another.

    It is `sound` when ids tell its states apart and its transitions join them; nothing can be said of what
    is reached in one that is not.
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

    @cached_property
    def reachable(self) -> frozenset[int]:
        """The ids of the states that can be reached from the initial one."""
        return frozenset() if self.initial is None else self.reached_from([self.initial.id])

    def reached_from(self, starts: list[int]) -> frozenset[int]:
        """Return some states with all that can be reached from them, as ids."""
        found: set[int] = set()
        pending = list(starts)
        while pending:
            number = pending.pop()
            if number in found or number not in self.states:
                continue
            found.add(number)
            pending += [transition.destination for transition in self.outgoing(self.states[number])]
        return frozenset(found)

    @property
    def can_finish(self) -> bool:
        """Whether a final state can be reached."""
        return any(self.states[number].final for number in self.reachable)

    def returns_to(self, state: State) -> bool:
        """Return whether the automaton can enter a state again after it was left."""
        return state.id in self.reached_from([after.destination for after in self.outgoing(state)])


def check_graph(graph: Graph, report: Report) -> None:
    """Check that every state can be entered, and that only final states are never left."""
    automaton = graph.automaton
    if not graph.sound or graph.initial is None:
        return
    for state in automaton.states:
        if state.id not in graph.reachable:
            message = f"no transitions lead from {state_label(graph.initial)} to {state_label(state)}"
            report.warning("W514", message, report.place(state))
        elif len(graph.reachable) > 1 and not state.final and not _has_way_out(graph, state):
            message = f"no transition leads away from {state_label(state)}: the automaton stays there"
            note = Note("mark the state as final if the automaton has finished there")
            report.note("N515", message, report.place(state), [note])


def _has_way_out(graph: Graph, state: State) -> bool:
    return any(transition.destination != state.id for transition in graph.outgoing(state))
