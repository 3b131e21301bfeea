"""The states of an SCXML file as automata, joined by transitions.

In SCXML a transition leads from any state into any other, and says where inside it. Here it joins two states
of one automaton, and an automaton that is entered begins in its first state, or where it was.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from codegen.diagnostics import did_you_mean

from ..codes import Code
from ..document import Comment, Text
from ..formats.xml_tree import XmlElement
from .content import CodeReader, Findings, everywhere, inside
from .vocabulary import milliseconds_text

__all__ = ["STATES", "Chart", "ChartAutomaton", "ChartState"]

STATES: Final = ("state", "parallel", "final")
"""The elements that are states."""

_DONE: Final = "done.state."
_RETURN: Final = "200"
"""Milliseconds in a state that waits before it returns: two cycles, in which the one above has left."""
_QUOTED: Final = re.compile(r"""\s*(['"])([^'"\\]*)\1\s*""")


@dataclass(slots=True, eq=False)
class _Edge:
    """A transition between two states of one automaton; `source` is the transition of SCXML."""

    source: XmlElement
    destination: ChartState
    type: str
    trigger: str
    guard: str = ""
    code: Text = field(default_factory=Text)
    comments: tuple[Comment, ...] = ()


@dataclass(slots=True, eq=False)
class ChartState:
    """A state; `name` is its id in SCXML."""

    element: XmlElement
    automaton: ChartAutomaton
    name: str
    is_final: bool = False
    comments: tuple[Comment, ...] = ()
    automata: list[ChartAutomaton] = field(default_factory=list)
    history: XmlElement | None = None
    edges: list[_Edge] = field(default_factory=list)
    number: int = 0

    def way_up(self) -> Iterator[ChartState]:
        """Yield the state and all around it, from the inside."""
        state: ChartState | None = self
        while state is not None:
            yield state
            state = state.automaton.owner


@dataclass(slots=True, eq=False)
class ChartAutomaton:
    """States side by side, and the element of SCXML that holds them.

    `is_region` says that the element is that of its one state: a region with transitions or code.
    """

    element: XmlElement
    owner: ChartState | None = None
    comments: tuple[Comment, ...] = ()
    states: list[ChartState] = field(default_factory=list)
    is_region: bool = False
    first: ChartState | None = None
    number: int = 0


@dataclass(frozen=True, slots=True)
class _Goal:
    """Where a transition leads; by its history a state goes on where it was."""

    state: ChartState
    history: XmlElement | None = None


@dataclass(frozen=True, slots=True)
class _Trigger:
    type: str
    text: str
    guard: str


class Chart:
    """All automata of a file, the root first, each before those below it.

    `timer_elements` send and cancel the events that became transitions by time; `events` are those for which
    transitions wait.
    """

    def __init__(self, root: XmlElement, code: CodeReader, findings: Findings) -> None:
        self._root = root
        self._code = code
        self._findings = findings
        self.automata: list[ChartAutomaton] = []
        self.timer_elements: set[XmlElement] = set()
        self.events: list[str] = []
        self._ids: dict[str, ChartState] = {}
        """The states by their ids; histories and regions stand for the states that have them."""
        self._histories: dict[str, XmlElement] = {}
        self._delays: dict[tuple[ChartState, str], str] = {}
        """The milliseconds after which a state gets an event of its own."""
        self._wanted: dict[ChartAutomaton, list[tuple[ChartState, XmlElement]]] = defaultdict(list)
        """The states in which an automaton is to begin, with the elements that want it."""
        self._entered: set[ChartAutomaton] = set()
        self._leaving: dict[tuple[ChartAutomaton, ChartState, str], dict[ChartState | None, ChartState]] = {}
        """States in which an automaton waits for one above to leave, by the state to which they return."""
        self._late: list[tuple[ChartState, _Edge]] = []
        """Edges that come behind all others of their states."""
        top = ChartAutomaton(root)
        self._fill(top)
        self._find_timers()
        self._join_states(top)

    def states(self) -> Iterator[ChartState]:
        """Yield all states."""
        return (state for automaton in self.automata for state in automaton.states)

    # The states as a tree, in which automata are the states inside another.

    def _fill(self, automaton: ChartAutomaton) -> None:
        """Read the states inside the element of an automaton."""
        self.automata.append(automaton)
        for comments, element in _with_comments(automaton.element, *STATES):
            automaton.states.append(self._state(element, automaton, comments))
        for state in automaton.states:
            self._fill_state(state)

    def _fill_state(self, state: ChartState) -> None:
        if state.element.tag == "parallel":
            for comments, region in _with_comments(state.element, *STATES):
                self._region(state, region, comments)
        elif not state.is_final and any(True for _ in inside(state.element, *STATES)):
            inner = ChartAutomaton(state.element, state)
            state.automata.append(inner)
            self._fill(inner)

    def _region(self, owner: ChartState, region: XmlElement, comments: tuple[Comment, ...]) -> None:
        inner = ChartAutomaton(region, owner, comments)
        owner.automata.append(inner)
        tags = {child.tag for child in inside(region)}
        is_plain = bool(tags & set(STATES)) and tags <= {*STATES, "initial", "datamodel"}
        if region.tag == "state" and is_plain:
            self._fill(inner)
            name = region.attributes.get("id", "")
            if name and "--" not in name:
                inner.comments = (*comments, Comment(f" {name} "))  # automata have no names
            self._add_id(name, owner, region)
            return
        inner.is_region = True
        self.automata.append(inner)
        state = self._state(region, inner, comments)
        inner.states.append(state)
        inner.comments = ()
        self._fill_state(state)

    def _state(
        self, element: XmlElement, automaton: ChartAutomaton, comments: tuple[Comment, ...]
    ) -> ChartState:
        name = element.attributes.get("id", "")
        state = ChartState(element, automaton, name, element.tag == "final", comments)
        self._add_id(name, state, element)
        for history in inside(element, "history"):
            self._add_id(history.attributes.get("id", ""), state, history)
            if state.history is None:
                state.history = history
                self._histories[history.attributes.get("id", "")] = history
            else:
                message = "a second history of a state: its automata have one, the first"
                self._findings.approximate(history, message)
        return state

    def _add_id(self, id: str, state: ChartState, element: XmlElement) -> None:
        if id and id in self._ids:
            self._findings.invalid(element, f"a second element has the id `{id[:60]}`")
        elif id:
            self._ids[id] = state

    # Timers: in SCXML events that a state sends to itself on entry, delayed.

    def _find_timers(self) -> None:
        """Find the events with which nothing has to do but the states that send them to themselves."""
        sends: dict[str, list[tuple[ChartState, XmlElement, str]]] = defaultdict(list)
        waiting: dict[str, set[ChartState]] = defaultdict(set)
        for state in self.states():
            for holder in inside(state.element, "onentry"):
                for send in inside(holder, "send"):
                    delay = milliseconds_text(_delay(send))
                    if delay is not None and send.attributes.get("target", "") in ("", "#_internal"):
                        sends[send.attributes.get("event", "")].append((state, send, delay[0]))
            for transition in inside(state.element, "transition"):
                for event in transition.attributes.get("event", "").split():
                    waiting[event].add(state)
        timed = {send for found in sends.values() for _, send, _ in found}
        others = [each for each in everywhere(self._root, "raise", "send") if each not in timed]
        otherwise = {each.attributes.get("event", "") for each in others}
        for event, found in sends.items():
            senders = {state for state, _, _ in found}
            if event and event not in otherwise and waiting[event] and waiting[event] <= senders:
                for state, send, milliseconds in found:
                    if state in waiting[event] and (state, event) not in self._delays:
                        self._delays[state, event] = milliseconds
                        self._take_timer(state, send)

    def _take_timer(self, state: ChartState, send: XmlElement) -> None:
        self.timer_elements.add(send)
        delay = milliseconds_text(_delay(send))
        if delay is not None and not delay[1]:
            self._findings.approximate(send, "a delay without a unit is taken for milliseconds")
        name = send.attributes.get("id", "")
        cancels = [
            cancel
            for holder in inside(state.element, "onexit")
            for cancel in inside(holder, "cancel")
            if name and cancel.attributes.get("sendid", "") == name
        ]
        self.timer_elements.update(cancels)
        if not cancels:
            message = "the timer ends here when the state is left; in SCXML, without `cancel`, it goes on"
            self._findings.note(Code.SCXML_OTHER_SHAPE, send, message)

    # Transitions.

    def _join_states(self, top: ChartAutomaton) -> None:
        """Give the states their transitions, and the automata their first states."""
        self._enter(top)
        for state in list(self.states()):
            for comments, element in _with_comments(state.element, "transition"):
                self._follow(state, element, comments)
        for state, edge in self._late:
            state.edges.append(edge)
        for automaton in self.automata:
            self._choose_first(automaton)
        for state in self.states():
            history = state.history
            is_deep = history is None or history.attributes.get("type") == "deep"
            if not is_deep and any(each.automata for inner in state.automata for each in inner.states):
                message = "a shallow history: here what is further inside goes on where it was, too"
                self._findings.approximate(history or state.element, message)

    def _follow(self, state: ChartState, element: XmlElement, comments: tuple[Comment, ...]) -> None:
        """Add the edges of a transition out of a state."""
        names = element.attributes.get("target", "").split()
        if state.is_final:
            self._findings.lost(element, "a final state has no transitions")
            return
        if not names:
            self._findings.lost(
                element, "a transition without a target is not carried: here each enters a state"
            )
            return
        goals = [goal for name in names if (goal := self._goal(name, element)) is not None]
        triggers = list(self._triggers(state, element)) if len(goals) == len(names) else []
        if not triggers:
            return
        is_internal = element.attributes.get("type") == "internal" and state.element.tag != "parallel"
        if is_internal and goals[0].state is not state and state in goals[0].state.way_up():
            self._follow_inside(state, element, goals[0], triggers)
            return
        origin, destination = _side_by_side(state, goals[0].state)
        for goal in goals:
            if _side_by_side(state, goal.state) == (origin, destination):
                self._demand(destination, goal, element)
            else:
                message = f"a second target elsewhere is not carried: `{goal.state.name[:60]}`"
                self._findings.lost(element, message)
        self._check_histories(element, goals, destination)
        for trigger in triggers:
            code = self._code.code([element])
            edge = _Edge(element, destination, trigger.type, trigger.text, trigger.guard, code)
            if origin is not state:
                self._leave(state, origin, names[0], edge)
            edge.comments = comments
            state.edges.append(edge)
            comments = ()

    def _triggers(self, state: ChartState, element: XmlElement) -> Iterator[_Trigger]:
        text = element.attributes.get("cond", "")
        condition = self._code.expression(element, text) if text.strip() else text
        events = element.attributes.get("event", "").split()
        if not events:
            yield _Trigger("condition", condition or "True", "")
        for event in events:
            delay = self._delays.get((state, event))
            name = event.removesuffix("*").rstrip(".")
            if delay is not None:
                yield _Trigger("time", delay, condition)
            elif event == _DONE + state.element.attributes.get("id", ""):
                yield _Trigger("finished", "", condition)
            elif event.startswith(_DONE):
                message = f"`{event[:60]}` is not carried: here only the state itself learns of its end"
                self._findings.lost(element, message)
            elif event == "*" or event.startswith(("error.", "done.")) or event == "error":
                message = f"`{event[:60]}` is not carried: here a transition waits for one event that is sent"
                self._findings.lost(element, message)
            else:
                if name != event:
                    message = f"`{event[:60]}` is taken for `{name[:60]}` alone: here events have one name"
                    self._findings.approximate(element, message)
                if name:
                    self.events.append(self._code.event(name))
                    yield _Trigger("event", self._code.event(name), condition)

    def _follow_inside(
        self, state: ChartState, element: XmlElement, goal: _Goal, triggers: Sequence[_Trigger]
    ) -> None:
        """Give a transition that leads inside a state without leaving it to all states inside."""
        inner = next(each.automaton for each in goal.state.way_up() if each.automaton.owner is state)
        _, destination = _side_by_side(inner.states[0], goal.state)
        self._demand(destination, goal, element)
        code = self._code.code([element])
        for trigger in triggers:
            edge = _Edge(element, destination, trigger.type, trigger.text, trigger.guard, code)
            self._late += [(each, replace(edge)) for each in inner.states if not each.is_final]
        message = f"it leads inside `{state.name[:60]}` without leaving it: here every state inside has it"
        self._findings.note(Code.SCXML_OTHER_SHAPE, element, message)

    def _leave(self, state: ChartState, origin: ChartState, name: str, edge: _Edge) -> None:
        """Lead an edge into a state that waits while an event makes the one around leave."""
        inner = state.automaton
        assert inner.owner is not None, "what is not the root has an owner"
        element, destination = edge.source, edge.destination
        around = list(inner.owner.way_up())
        resumes = any(each.history is not None for each in around[: around.index(origin) + 1])
        event = f"leave {inner.owner.name} for {name}"
        if (inner, destination, name) not in self._leaving:
            # First, since in SCXML what is inside comes first.
            origin.edges.insert(0, _Edge(element, destination, "event", event))
            message = f"it leaves `{origin.name[:60]}` from inside: here through the state `{event[:60]}`"
            takes = "which takes a cycle: events that come before it meet the state that is left"
            self._findings.note(Code.SCXML_OTHER_SHAPE, element, f"{message} and an event, {takes}")
        waiting = self._leaving.setdefault((inner, destination, name), {})
        left = state if resumes else None
        if left not in waiting:
            end = _DONE + inner.owner.element.attributes.get("id", "")
            transitions = everywhere(self._root, "transition")
            awaits_end = any(end in each.attributes.get("event", "").split() for each in transitions)
            waits = ChartState(element, inner, event, is_final=not awaits_end and not resumes)
            if resumes:
                # Where the state around goes on later, this one does so where it was left.
                waits.name += f" from {state.name}"
                waits.edges.append(_Edge(element, state, "time", _RETURN))
            inner.states.append(waits)
            waiting[left] = waits
        edge.destination = waiting[left]
        code = "\n".join(filter(None, (edge.code.text, f"self.send({event!r})")))
        edge.code = replace(edge.code, text=code)

    def _check_histories(self, element: XmlElement, goals: Sequence[_Goal], destination: ChartState) -> None:
        for goal in goals:
            for state in goal.state.way_up():
                if state.history is not None and not (state is goal.state and goal.history is not None):
                    message = f"it enters `{state.name[:60]}` anew: here what is inside goes on where it was"
                    self._findings.approximate(element, message)
                if state is destination:
                    break

    # Where automata begin.

    def _goal(self, name: str, element: XmlElement) -> _Goal | None:
        """Return what an id stands for, or None after an error was reported."""
        state = self._ids.get(name)
        if state is None:
            message = f"no state has the id `{name[:60]}`"
            self._findings.invalid(element, message, did_you_mean(name, self._ids))
            return None
        return _Goal(state, self._histories.get(name))

    def _enter(self, automaton: ChartAutomaton) -> None:
        """Note that an automaton begins where it says itself."""
        if automaton in self._entered or not automaton.states:
            return
        self._entered.add(automaton)
        goals = [] if automaton.is_region else list(self._initial(automaton))
        for goal in goals:
            element = automaton.element
            state = next((each for each in goal.state.way_up() if each.automaton is automaton), None)
            if state is None:
                message = f"`{goal.state.name[:60]}` is not inside what begins there"
                self._findings.invalid(element, message)
            else:
                self._wanted[automaton].append((state, element))
                self._demand(state, goal, element)
        if not goals:
            self._wanted[automaton].append((automaton.states[0], automaton.element))
            self._demand(automaton.states[0], _Goal(automaton.states[0]), automaton.element)

    def _initial(self, automaton: ChartAutomaton) -> Iterator[_Goal]:
        element = automaton.element
        names = element.attributes.get("initial", "").split()
        for initial in inside(element, "initial"):
            for transition in inside(initial, "transition"):
                names += transition.attributes.get("target", "").split()
                if any(True for _ in inside(transition)):
                    self._findings.lost(transition, "code of a first transition is not carried")
        for name in names:
            goal = self._goal(name, element)
            if goal is not None and goal.history is not None and goal.state is automaton.owner:
                yield from self._defaults(goal)  # its own history: at first there is none
            elif goal is not None:
                yield goal

    def _defaults(self, goal: _Goal) -> Iterator[_Goal]:
        """Yield where a history leads when there is nothing to go on with."""
        for transition in inside(goal.history, "transition") if goal.history is not None else ():
            for name in transition.attributes.get("target", "").split():
                default = self._goal(name, transition)
                if default is not None and default.history is not goal.history:
                    yield default

    def _demand(self, top: ChartState, goal: _Goal, element: XmlElement) -> None:
        """Note where the automata inside a state begin when a transition leads to a goal in or below it."""
        way = [state for state in goal.state.way_up() if top in state.way_up()]
        for state in way:
            if state is not top:
                self._wanted[state.automaton].append((state, element))
        for default in self._defaults(goal):
            if goal.state in default.state.way_up():
                self._demand(goal.state, default, goal.history or element)
        passed = {state.automaton for state in way}
        for state in way:
            for automaton in state.automata:
                if automaton not in passed and (goal.history is None or state is not goal.state):
                    self._enter(automaton)

    def _choose_first(self, automaton: ChartAutomaton) -> None:
        """Let an automaton begin where all want it, else where it says itself, which is reported."""
        wanted = self._wanted[automaton]
        states = list(dict.fromkeys(state for state, _ in wanted))
        if len(states) > 1:
            own = list(self._initial(automaton)) if not automaton.is_region else []
            preferred = [
                state for goal in own for state in goal.state.way_up() if state.automaton is automaton
            ]
            states = [*preferred, automaton.states[0]]
        automaton.first = next(iter(states), next(iter(automaton.states), None))
        for state, element in wanted:
            if state is not automaton.first and automaton.first is not None:
                message = (
                    f"it enters `{state.name[:60]}`: here what is around that begins in "
                    f"`{automaton.first.name[:60]}`, whoever enters it"
                )
                self._findings.approximate(element, message)


def _side_by_side(source: ChartState, goal: ChartState) -> tuple[ChartState, ChartState]:
    """Return the states of one automaton that are two others or around them, as far inside as there are."""
    around = {state.automaton: state for state in source.way_up()}
    return next((around[state.automaton], state) for state in goal.way_up() if state.automaton in around)


def _with_comments(parent: XmlElement, *tags: str) -> Iterator[tuple[tuple[Comment, ...], XmlElement]]:
    """Yield the elements with these tags inside one, each with the comments directly before it."""
    for comments, child in parent.commented():
        if child is not None and child.tag in tags:
            yield tuple(comments), child


def _delay(send: XmlElement) -> str:
    """Return the delay of an event, also of one that is computed from a text alone."""
    quoted = _QUOTED.fullmatch(send.attributes.get("delayexpr", ""))
    return send.attributes.get("delay", quoted[2] if quoted else "")
