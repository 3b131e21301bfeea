"""Find the states in which automata begin.

In SCXML whoever enters a state may say where inside it. Here an automaton that is entered begins in its first
state, or where it was.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from codegen.diagnostics import did_you_mean

from ..formats.xml_tree import XmlElement
from .chart import Chart, ChartAutomaton, ChartState
from .problems import Problems

__all__ = ["Entries", "Goal"]


@dataclass(frozen=True, slots=True)
class Goal:
    """Where a transition leads; by its history a state goes on where it was."""

    state: ChartState
    history: XmlElement | None = None
    region: ChartAutomaton | None = None


class Entries:
    """What the elements of a file want of the automata that they enter."""

    def __init__(self, chart: Chart, problems: Problems) -> None:
        self._chart = chart
        self._problems = problems
        self._wanted: dict[ChartAutomaton, list[tuple[ChartState, XmlElement]]] = {}
        """The states in which an automaton is to begin, with who wants it."""
        self._entered: set[ChartAutomaton] = set()

    def goal(self, name: str, element: XmlElement) -> Goal | None:
        """Return what an id stands for, or None after an error was reported."""
        state = self._chart.ids.get(name)
        if state is None:
            message = f"no state has the id `{name[:60]}`"
            self._problems.invalid(element, message, did_you_mean(name, self._chart.ids))
            return None
        return Goal(state, self._chart.histories.get(name), self._chart.regions.get(name))

    def enter(self, automaton: ChartAutomaton) -> None:
        """Note that an automaton begins where it says itself."""
        if automaton in self._entered or not automaton.states:
            return
        self._entered.add(automaton)
        goals = [] if automaton.holds_its_state else list(self._initial(automaton))
        for goal, element in goals:
            state = next((each for each in goal.state.way_up() if each.automaton is automaton), None)
            if state is None:
                message = f"`{goal.state.name[:60]}` is not inside what begins there"
                self._problems.invalid(element, message)
            else:
                self._want(automaton, state, element)
                self.demand(state, goal, element)
        if not goals:
            self._want(automaton, automaton.states[0], automaton.element)
            self.demand(automaton.states[0], Goal(automaton.states[0]), automaton.element)

    def _initial(self, automaton: ChartAutomaton) -> Iterator[tuple[Goal, XmlElement]]:
        element = automaton.element
        names = element.attributes.get("initial", "").split()
        for initial in self._chart.tree.inside(element, "initial"):
            for transition in self._chart.tree.inside(initial, "transition"):
                names += transition.attributes.get("target", "").split()
                if any(True for _ in self._chart.tree.inside(transition)):
                    self._problems.lost(transition, "code of a first transition is not carried")
        for name in names:
            goal = self.goal(name, element)
            if goal is not None:
                yield goal, element

    def demand(self, top: ChartState, goal: Goal, element: XmlElement) -> None:
        """Note where the automata inside a state begin when a transition leads to a goal in or below it."""
        way = [state for state in goal.state.way_up() if top in state.way_up()]
        for state in way:
            if state is not top:
                self._want(state.automaton, state, element)
        if goal.history is not None:
            for transition in self._chart.tree.inside(goal.history, "transition"):
                for name in transition.attributes.get("target", "").split():
                    default = self.goal(name, transition)
                    if default is None or default.history is goal.history:
                        continue
                    if goal.state in default.state.way_up():
                        self.demand(goal.state, default, transition)
        passed = {state.automaton for state in way}
        for state in way:
            for automaton in state.automata:
                if automaton not in passed and (goal.history is None or state is not goal.state):
                    self.enter(automaton)

    def _want(self, automaton: ChartAutomaton, state: ChartState, element: XmlElement) -> None:
        self._wanted.setdefault(automaton, []).append((state, element))

    def choose_first(self, automaton: ChartAutomaton) -> None:
        """Let an automaton begin where all want it, else where it says itself; tell who wants otherwise."""
        wanted = self._wanted.get(automaton, [])
        states = list(dict.fromkeys(state for state, _ in wanted))
        if len(states) > 1:
            own = list(self._initial(automaton)) if not automaton.holds_its_state else []
            preferred = [
                state for goal, _ in own for state in goal.state.way_up() if state.automaton is automaton
            ]
            states = [*preferred, automaton.states[0]]
        automaton.first = next(iter(states), next(iter(automaton.states), None))
        for state, element in wanted:
            if state is not automaton.first and automaton.first is not None:
                message = (
                    f"it enters `{state.name[:60]}`: here what is around that begins in "
                    f"`{automaton.first.name[:60]}`, whoever enters it"
                )
                self._problems.approximate(element, message)
