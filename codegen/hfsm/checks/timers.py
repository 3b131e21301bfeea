"""Find timed transitions that can never fire: a shorter timer, or a parent that leaves first, prevents it.

Timers count active time and are looked at once a period: two that run out in one cycle compete by their
order. What follows from the times alone is told; what depends on conditions is not.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Mapping

from ...diagnostics import Note
from ..document import NO_CHILD, Document, State, Transition
from .constants import delay, milliseconds
from .graph import Graph
from .labels import state_label, transition_label
from .pieces import AutomatonCode
from .report import Report
from .shadows import is_unguarded

__all__ = ["check_timers"]


def check_timers(
    document: Document, graphs: Mapping[int, Graph], codes: Mapping[int, AutomatonCode], report: Report
) -> None:
    """Check every timed transition; `graphs` and `codes` are those of the automata, by id."""
    timers = _Timers(document, graphs, codes, report)
    for graph in graphs.values():
        if graph.sound and graph.initial is not None:
            timers.check(graph)


class _Timers:
    def __init__(
        self,
        document: Document,
        graphs: Mapping[int, Graph],
        codes: Mapping[int, AutomatonCode],
        report: Report,
    ) -> None:
        self._document = document
        self._codes = codes
        self._report = report
        self._owners: dict[int, tuple[Graph, State]] = {}
        for graph in graphs.values():
            for state in graph.automaton.states:
                for child in state.children:
                    self._owners.setdefault(child, (graph, state))

    def period(self, graph: Graph) -> float:
        """Return the period of an automaton in ms; one that is none is told elsewhere."""
        return milliseconds(graph.automaton.iteration_time) or math.inf

    def check(self, graph: Graph) -> None:
        limit, leaving = self._active_time(graph)
        earliest = self._earliest_entries(graph) if leaving is not None else {}
        for state in graph.automaton.states:
            if state.id not in graph.reachable:
                continue
            for transition in graph.outgoing(state):
                time = _delay(transition)
                if time is None or self._check_siblings(graph, state, transition, time):
                    continue
                entered = earliest.get(state.id, 0.0)
                if leaving is not None and entered < limit <= entered + time:
                    self._tell_of_parent(transition, leaving, is_first=state is graph.initial)

    def _check_siblings(self, graph: Graph, state: State, transition: Transition, time: float) -> bool:
        """Report a timer that another transition of its state forestalls; return whether there is one."""
        between = math.inf if self._may_resume(graph) else self.period(graph)
        is_before = True
        for other in graph.outgoing(state):
            if other is transition:
                is_before = False
                continue
            fires_after = self._fires_after(graph, other)
            if fires_after is None or (is_before and other.type == "condition"):
                continue  # what is always true and tried before is told by the check of shadows
            # Of two timers that have run out in one cycle the first counts.
            if time > (fires_after if is_before else fires_after + between):
                what = "leaves the state first" if other.type == "time" else "is always true"
                note = Note(f"{transition_label(other)} {what}", self._report.place(other, other.trigger))
                self._tell(transition, [note])
                return True
        return False

    def _tell_of_parent(
        self, transition: Transition, leaving: tuple[State, Transition], *, is_first: bool
    ) -> None:
        state, other = leaving
        on_the_way = "" if is_first else ", counted with those on the way to it"
        text = (
            f"{transition_label(other)} leaves {state_label(state)}, which owns this automaton, before the "
            f"timer runs out{on_the_way}, and the automaton does not go on from there"
        )
        self._tell(transition, [Note(text, self._report.place(other, other.trigger))])

    def _tell(self, transition: Transition, notes: list[Note]) -> None:
        message = f"the timer of {transition_label(transition)} can never fire"
        place = self._report.place(transition, transition.trigger)
        self._report.warning("W517", message, place, notes)

    def _fires_after(self, graph: Graph, transition: Transition) -> float | None:
        """Return the ms after which a transition fires whatever happens, None for one that need not."""
        if not is_unguarded(transition, self._codes[graph.automaton.id]):
            return None
        return 0.0 if transition.type == "condition" else _delay(transition)

    def _active_time(self, graph: Graph) -> tuple[float, tuple[State, Transition] | None]:
        """Return for how many ms an automaton is active at most before its timers are lost, and why."""
        owner = self._owners.get(graph.automaton.id)
        if graph.automaton.father == NO_CHILD or owner is None or not owner[0].sound:
            return math.inf, None
        above, state = owner
        if state.history.text.strip() != "restart" and self._may_enter_again(above, state):
            return math.inf, None  # it resumes: its timers add up
        times = [
            (after + self.period(above), transition)
            for transition in above.outgoing(state)
            if (after := self._fires_after(above, transition)) is not None
        ]
        if not times:
            return math.inf, None
        limit, transition = min(times, key=lambda item: item[0])
        return limit, (state, transition)

    def _may_resume(self, graph: Graph) -> bool:
        """Return whether an automaton may go on after it was a ghost: its timers add up, its cycles not."""
        below: set[int] = set()
        while (owner := self._owners.get(graph.automaton.id)) and graph.automaton.id not in below:
            above, state = owner
            resumes = state.history.text.strip() != "restart"
            if not above.sound or (resumes and self._may_enter_again(above, state)):
                return True
            below.add(graph.automaton.id)
            graph = above
        return False

    def _may_enter_again(self, graph: Graph, state: State) -> bool:
        """Return whether a state may be entered again: in its automaton, or when that begins anew."""
        above: set[int] = set()
        while not graph.returns_to(state):
            owner = self._owners.get(graph.automaton.id)
            if owner is None or graph.automaton.id in above:  # a ring is told elsewhere
                return False
            above.add(graph.automaton.id)
            if owner[1].history.text.strip() != "restart" and not graph.can_finish:
                return False
            graph, state = owner
        return True

    def _earliest_entries(self, graph: Graph) -> dict[int, float]:
        """Return after how many ms each state can be entered, if conditions and events hold at once."""
        assert graph.initial is not None
        found: dict[int, float] = {}
        pending = [(0.0, graph.initial.id)]
        while pending:
            time, number = heapq.heappop(pending)
            if number in found:
                continue
            found[number] = time
            for transition in graph.outgoing(graph.states[number]):
                heapq.heappush(pending, (time + (_delay(transition) or 0.0), transition.destination))
        return found


def _delay(transition: Transition) -> float | None:
    """Return the ms of a timed transition, None for any other."""
    return delay(transition.trigger) if transition.type == "time" else None
