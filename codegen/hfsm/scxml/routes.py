"""Find transitions that join states of one automaton.

In SCXML a transition leads from any state into any other; here it joins two states side by side.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

from ..formats.xml_tree import XmlComment, XmlElement
from .chart import Chart, ChartAutomaton, ChartState, Edge
from .code import CodeReader
from .entries import Entries, Goal
from .own_elements import with_comments
from .problems import Problems
from .timers import Timers

__all__ = ["Routes"]

_DONE: Final = "done.state."


@dataclass(frozen=True, slots=True)
class _Trigger:
    type: str
    text: str
    guard: str


@dataclass(slots=True)
class _Source:
    """A transition of SCXML, with what our namespace says of it."""

    state: ChartState
    element: XmlElement
    comments: list[XmlComment] = field(default_factory=list)
    native: XmlElement | None = None
    index: int | None = None


class Routes:
    """Give the states of a chart their transitions, and the automata their first states."""

    def __init__(self, chart: Chart, code: CodeReader, timers: Timers, problems: Problems) -> None:
        self._chart = chart
        self._code = code
        self._timers = timers
        self._problems = problems
        self._entries = Entries(chart, problems)
        self._leaving: dict[tuple[ChartAutomaton, ChartState, str], tuple[ChartState, str]] = {}
        """States in which an automaton waits for one above to leave, each with the event that tells it."""
        self._late: list[tuple[ChartState, Edge]] = []
        self.events: list[str] = []
        """The events for which transitions wait, but for those that this adds."""
        self._ends = {
            event.removeprefix(_DONE)
            for automaton in chart.automata
            for state in automaton.states
            for transition in chart.tree.inside(state.element, "transition")
            for event in transition.attributes.get("event", "").split()
            if event.startswith(_DONE)
        }

    def trace(self) -> None:
        """Follow all transitions."""
        self._entries.enter(self._chart.root)
        sources = [source for automaton in self._chart.automata for source in self._sources(automaton)]
        for source in sources:
            self._follow(source)
        for state, edge in self._late:
            state.edges.append(edge)
        for automaton in self._chart.automata:
            self._entries.choose_first(automaton)
            for state in automaton.states:
                self._check_depth(state)

    def _sources(self, automaton: ChartAutomaton) -> Iterator[_Source]:
        tree = self._chart.tree
        for state in automaton.states:
            strays = self._chart.stray_comments.setdefault(state.element, [])
            own = _Source(state, state.element)
            for comments, child in with_comments(state.element):
                if tree.own(child) == "transition":
                    own.comments += comments
                    own.native = self._chart.native(child)
                    own.index = self._chart.place_of(own.native)
                elif tree.scxml(child) == "transition":
                    own.element, own.comments = child, own.comments + comments
                    yield own
                    own = _Source(state, state.element)
                elif tree.scxml(child) not in ("state", "parallel", "final") and not tree.own(child):
                    strays += comments

    def _follow(self, source: _Source) -> None:
        names = source.element.attributes.get("target", "").split()
        if source.state.is_final:
            self._problems.lost(source.element, "a final state has no transitions")
            return
        if not names:
            message = "a transition without a target is not carried: here each enters a state"
            self._problems.lost(source.element, message)
            return
        goals = [goal for name in names if (goal := self._entries.goal(name, source.element)) is not None]
        if len(goals) < len(names):
            return
        triggers = list(self._triggers(source))
        if not triggers:
            return
        if source.element.attributes.get("type") == "internal" and self._inside(source, goals, triggers):
            return
        origin, destination = _side_by_side(source.state, goals[0].state)
        for goal in goals:
            if _side_by_side(source.state, goal.state) == (origin, destination):
                self._entries.demand(destination, goal, source.element)
            else:
                message = f"a second target elsewhere is not carried: `{goal.state.name[:60]}`"
                self._problems.lost(source.element, message)
        self._check_histories(source, goals, destination)
        for trigger in triggers:
            if origin is source.state:
                self._add(origin, self._edge(source, destination, trigger))
            else:
                self._leave(source, origin, destination, names[0], trigger)
            source = _Source(source.state, source.element)  # the first has what our namespace says

    # When it fires.

    def _triggers(self, source: _Source) -> Iterator[_Trigger]:
        attributes = source.element.attributes
        text = attributes.get("cond", "")
        condition = self._code.expression(source.element, text) if text.strip() else text
        events = attributes.get("event", "").split()
        if not events:
            yield _Trigger("condition", condition or "True", "")
        for event in events:
            delay = self._timers.delay(source.state, event)
            if delay is not None:
                yield _Trigger("time", delay, condition)
            elif event.startswith(_DONE):
                if event == _DONE + source.state.element.attributes.get("id", ""):
                    yield _Trigger("finished", "", condition)
                else:
                    message = f"`{event[:60]}` is not carried: here only the state itself learns of its end"
                    self._problems.lost(source.element, message)
            elif event == "*" or event.startswith(("error.", "done.")) or event == "error":
                message = f"`{event[:60]}` is not carried: here a transition waits for one event that is sent"
                self._problems.lost(source.element, message)
            else:
                name = event.removesuffix("*").rstrip(".")
                if name != event:
                    message = f"`{event[:60]}` is taken for `{name[:60]}` alone: here events have one name"
                    self._problems.approximate(source.element, message)
                if name:
                    self.events.append(self._code.event(name))
                    yield _Trigger("event", self._code.event(name), condition)

    # Where it leads.

    def _edge(self, source: _Source, destination: ChartState, trigger: _Trigger) -> Edge:
        code, script = self._code.of([source.element])
        edge = Edge(source.element, destination, trigger.type, trigger.text, trigger.guard, code, script)
        edge.native, edge.comments, edge.index = source.native, source.comments, source.index
        return edge

    def _add(self, origin: ChartState, edge: Edge) -> None:
        origin.edges.append(edge)

    def _leave(
        self, source: _Source, origin: ChartState, destination: ChartState, name: str, trigger: _Trigger
    ) -> None:
        """Let a state inside tell the one around it, by an event, that it is to be left."""
        inner = source.state.automaton
        assert inner.owner is not None, "what is not the root has an owner"
        key = (inner, destination, name)
        if key not in self._leaving:
            event = f"leave {inner.owner.name} for {name}"
            waits = ChartState(source.element, inner, event)
            waits.is_final = inner.owner.element.attributes.get("id", "") not in self._ends
            inner.states.append(waits)
            self._leaving[key] = (waits, event)
            # First, since in SCXML what is inside comes first.
            origin.edges.insert(0, Edge(source.element, destination, "event", event))
            message = f"it leaves `{origin.name[:60]}` from inside: here through the state `{event[:60]}`"
            self._problems.reshaped(source.element, f"{message} and an event, which takes a cycle")
        waits, event = self._leaving[key]
        edge = self._edge(source, waits, trigger)
        edge.code = "\n".join(filter(None, (edge.code, f"self.send({event!r})")))
        edge.script = None
        self._add(source.state, edge)
        around = list(inner.owner.way_up())
        if any(state.history is not None for state in around[: around.index(origin) + 1]):
            message = f"what is inside `{inner.owner.name[:60]}` does not go on here where it was left"
            self._problems.approximate(source.element, message)

    def _inside(self, source: _Source, goals: Sequence[Goal], triggers: Sequence[_Trigger]) -> bool:
        """Carry a transition that leads inside a state without leaving it, if it can be carried so.

        Every state inside then has it, as its last.
        """
        state, goal = source.state, goals[0]
        if state.is_parallel or goal.state is state or state not in goal.state.way_up():
            return False
        inner = next(each.automaton for each in goal.state.way_up() if each.automaton.owner is state)
        if len(goals) > 1 or any(trigger.type not in ("event", "condition") for trigger in triggers):
            message = "it leads inside without leaving the state: here the state is left and entered"
            self._problems.approximate(source.element, message)
            return False
        _, destination = _side_by_side(inner.states[0], goal.state)
        self._entries.demand(destination, goal, source.element)
        for each in inner.states:
            if not each.is_final:
                for trigger in triggers:
                    self._late.append((each, self._edge(_Source(each, source.element), destination, trigger)))
        message = f"it leads inside `{state.name[:60]}` without leaving it: here every state inside has it"
        self._problems.reshaped(source.element, message)
        return True

    def _check_depth(self, state: ChartState) -> None:
        """Tell of a history that is shallow where there is anything deeper."""
        history = state.history
        if history is None or history.attributes.get("type") == "deep":
            return
        if any(each.automata for automaton in state.automata for each in automaton.states):
            message = "a shallow history: here what is further inside goes on where it was, too"
            self._problems.approximate(history, message)

    def _check_histories(self, source: _Source, goals: Sequence[Goal], destination: ChartState) -> None:
        for goal in goals:
            for state in goal.state.way_up():
                if state.history is not None and not (state is goal.state and goal.history is not None):
                    message = f"it enters `{state.name[:60]}` anew: here what is inside goes on where it was"
                    self._problems.approximate(source.element, message)
                if state is destination:
                    break


def _side_by_side(source: ChartState, goal: ChartState) -> tuple[ChartState, ChartState]:
    """Return the states of one automaton that are two others or around them, as far inside as there are."""
    around = {state.automaton: state for state in source.way_up()}
    return next((around[state.automaton], state) for state in goal.way_up() if state.automaton in around)
