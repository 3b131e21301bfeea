"""Random trees of automata against a simple interpreter of one loop.

Guards are scripts: each says at which of its evaluations it holds. `TEST_EXAMPLES=10` tries ten times
as many trees.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count, groupby

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hfsm_runtime import Automaton, Component, Event, Input, State, Transition, VirtualRun
from hfsm_runtime._actor import CAPACITY
from hfsm_runtime._cycle import Supervisor, run_cycle
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor, ChangeKind, DropReason, Tree
from tests.support.automata import component
from tests.support.examples import examples
from zenoh_ice import ConnectionLostException

STEP = 10  # ms, which divides every period
END = 2500  # ms
EVENTS = ("ping", "pong")

Piece = str | None
"""A piece of code: None for none, otherwise the event that it sends, which may be empty, or how it fails."""
FAILS, ENDS_CYCLE = "fails", "ends the cycle"
Answer = bool | str
"""What a guard answers, or how it fails."""
Line = tuple[int, str, str]
"""What happened: at a time in ms, in an automaton."""


@dataclass(frozen=True)
class PlannedState:
    entry: Piece
    code: Piece
    exit: Piece
    final: bool
    restart: bool
    arguments: Piece


@dataclass(frozen=True)
class PlannedTransition:
    origin: int
    destination: int
    delay: int | None  # ms
    event: str
    finished: bool
    script: tuple[Answer, ...]  # none for a transition without a guard
    priority: int | None
    code: Piece


@dataclass(frozen=True)
class Plan:
    period: int  # ms
    states: tuple[PlannedState, ...]
    transitions: tuple[PlannedTransition, ...]
    children: tuple[tuple[int, Plan], ...] = field(default=())


# A strategy takes as long to make as to draw from: none is made while a plan is drawn.
PIECES = st.sampled_from([None, None, "", *EVENTS, FAILS, ENDS_CYCLE])
ANSWERS: list[Answer] = [True, True, False, False, FAILS, ENDS_CYCLE]
SCRIPTS = st.lists(st.sampled_from(ANSWERS), min_size=1, max_size=5).map(tuple)
PAUSES = st.lists(st.booleans(), min_size=1, max_size=5).map(tuple)
NO_SCRIPT_OR_SCRIPTS = st.just(()) | SCRIPTS
KINDS = st.sampled_from(["time", "time", "condition", "event", "event", "finished", "finished"])
DELAYS = st.integers(1, 700)
EVENT_NAMES = st.sampled_from(EVENTS)
PRIORITIES = st.none() | st.integers(1, 3)
PERIODS = st.sampled_from([20, 50, 100, 100, 130])
COUNTS = st.integers(1, 3)
PLACES = {count: st.integers(0, count - 1) for count in (1, 2, 3)}
OWNERS = {(count, most): st.lists(PLACES[count], max_size=most) for count in PLACES for most in (1, 3)}


def planned_states(finals: list[bool]) -> st.SearchStrategy[PlannedState]:
    return st.builds(
        PlannedState,
        entry=PIECES,
        code=PIECES,
        exit=PIECES,
        final=st.sampled_from(finals),
        restart=st.booleans(),
        arguments=st.sampled_from([None, "", "", FAILS, ENDS_CYCLE]),
    )


FIRST_STATES = planned_states([False] * 9 + [True])
STATES_OF_ROOT = planned_states([False] * 5 + [True])
STATES_BELOW = planned_states([False, False, True])


@st.composite
def transitions(draw: st.DrawFn, places: st.SearchStrategy[int]) -> PlannedTransition:
    kind = draw(KINDS)
    return PlannedTransition(
        origin=draw(places),
        destination=draw(places),
        delay=draw(DELAYS) if kind == "time" else None,
        event=draw(EVENT_NAMES) if kind == "event" else "",
        finished=kind == "finished",
        script=draw(SCRIPTS if kind == "condition" else NO_SCRIPT_OR_SCRIPTS),
        priority=draw(PRIORITIES),
        code=draw(PIECES),
    )


TRANSITIONS = {
    count: st.lists(transitions(places), min_size=1, max_size=6) for count, places in PLACES.items()
}


@st.composite
def plans(draw: st.DrawFn, depth: int = 0) -> Plan:
    others = STATES_BELOW if depth else STATES_OF_ROOT
    states = tuple(draw(others if place else FIRST_STATES) for place in range(draw(COUNTS)))
    children: list[tuple[int, Plan]] = []
    if depth < 3:
        owners = draw(OWNERS[len(states), 3 if depth < 2 else 1])
        children = [(owner, draw(plans(depth + 1))) for owner in owners]
    return Plan(
        period=draw(PERIODS),
        states=states,
        transitions=tuple(draw(TRANSITIONS[len(states)])),
        children=tuple(children),
    )


OUTSIDE = st.dictionaries(
    st.integers(0, END // STEP).map(lambda slot: slot * STEP),
    st.lists(st.sampled_from(EVENTS), min_size=1, max_size=4),
    max_size=6,
)
"""Events from outside, by time in ms; those of one time are sent one after the other."""
Outside = Mapping[int, Sequence[str]]


@dataclass
class Node:
    """An automaton of the reference."""

    name: str
    plan: Plan
    parent: Node | None
    owner: int
    children: list[Node] = field(default_factory=list)
    state: int = 0
    begun: bool = False
    settled: bool = False  # whether the entry into its state is complete
    owes_entry: bool = False
    owes_arguments: bool = False
    tries: Counter[str] = field(default_factory=Counter)  # of code that fails each other time
    finished: bool = False
    active_time: int = 0  # ms in the current state
    queue: list[tuple[str, int]] = field(default_factory=list)  # names and numbers
    due: int = 0  # how many of them the running cycle may handle
    asked: Counter[int] = field(default_factory=Counter)
    value: int = 0  # of its input
    was_awake: bool = False

    @property
    def now_in(self) -> PlannedState:
        return self.plan.states[self.state]


def grow(plan: Plan, ids: count[int], parent: Node | None = None, owner: int = 0) -> Iterator[Node]:
    node = Node(str(next(ids)), plan, parent, owner)
    yield node
    for place, child in plan.children:
        below = list(grow(child, ids, node, place))
        node.children.append(below[0])
        yield from below


class CycleEnds(Exception):
    """Code meets what ends its cycle, such as a lost server."""


def reference(plan: Plan, outside: Outside) -> list[Line]:
    nodes = list(grow(plan, count(1)))
    trace: list[Line] = []
    sent, handed = count(), count(1)
    now = 0

    def awake(node: Node) -> bool:
        above = node.parent
        if above is None:
            return True
        owned = above.settled and above.state == node.owner and not above.now_in.final
        return owned and awake(above)

    def note(node: Node, what: str) -> None:
        trace.append((now, node.name, what))

    def send(name: str) -> None:
        data = next(sent)
        for node in nodes:
            waits = any(transition.event == name for transition in node.plan.transitions)
            if awake(node) and not node.finished and waits:
                if len(node.queue) == CAPACITY:
                    drop(node, DropReason.OVERFLOW)
                node.queue.append((name, data))

    def drop(node: Node, reason: DropReason) -> None:
        _, data = node.queue.pop(0)
        node.due = max(0, node.due - 1)
        note(node, f"drops {data}: {reason}")

    def drop_all(node: Node, reason: DropReason) -> None:
        while node.queue:
            drop(node, reason)

    def piece(node: Node, what: str, code: Piece) -> None:
        if code is not None:
            note(node, f"{what} {node.value}")
            if code in EVENTS:
                send(code)
            if code == ENDS_CYCLE:
                node.tries[what] += 1
                if node.tries[what] % 2:
                    raise CycleEnds

    def look() -> None:
        """Record which automata become ghosts, and which become active."""
        for node in nodes:
            if awake(node) != node.was_awake:
                node.was_awake = not node.was_awake
                note(node, "awake" if node.was_awake else "ghost")
                drop_all(node, DropReason.GHOST)

    def enter(node: Node, state: int) -> None:
        node.state, node.settled = state, False
        node.owes_entry = node.now_in.entry is not None
        node.owes_arguments = node.now_in.arguments is not None and not node.now_in.final
        note(node, f"enters {state}")

    def begin(node: Node) -> None:
        """Let a state begin that owes nothing."""
        if not (node.settled or node.owes_entry or node.owes_arguments):
            settle(node)

    def settle(node: Node) -> None:
        node.settled, node.active_time = True, 0
        for child in node.children:
            restarts = not child.begun or child.finished or node.now_in.restart
            if child.owner == node.state and restarts and not node.now_in.final:
                child.begun, child.finished = True, False
                enter(child, 0)
                begin(child)

    def complete(node: Node) -> None:
        """Complete the entry into the current state."""
        state = node.now_in
        if node.owes_entry:
            piece(node, f"entry {node.state}", state.entry)
            node.owes_entry = False
        if node.owes_arguments:
            piece(node, f"arguments {node.state}", state.arguments)
            value = None if state.arguments == FAILS else next(handed)
            for child in node.children:
                if child.owner == node.state and value is not None:
                    child.value = value
            node.owes_arguments = False
        begin(node)
        look()

    def choose(node: Node) -> int | None:
        """Return the transition that fires, if any; one by an event fires by the first of the queue."""
        if node.now_in.final:
            return None
        leaving = [pair for pair in enumerate(node.plan.transitions) if pair[1].origin == node.state]
        leaving.sort(key=lambda pair: pair[1].priority or math.inf)
        is_first_time = True
        while True:
            while node.due and all(node.queue[0][0] != transition.event for _, transition in leaving):
                drop(node, DropReason.UNHANDLED)
            for index, transition in leaving:
                if transition.event:
                    may_hold = node.due > 0 and node.queue[0][0] == transition.event
                else:
                    may_hold = is_first_time and passes(node, transition)
                if may_hold and answers(node, index):
                    return index
            if not node.due:
                return None
            drop(node, DropReason.UNHANDLED)
            is_first_time = False

    def passes(node: Node, transition: PlannedTransition) -> bool:
        """Return whether one that waits for no event may fire but for its guard."""
        if transition.finished:
            below = [child for child in node.children if child.owner == node.state]
            return below != [] and all(child.finished for child in below)
        return transition.delay is None or node.active_time >= transition.delay

    def answers(node: Node, index: int) -> bool:
        """Return what the guard of a transition answers, if there is one."""
        transition = node.plan.transitions[index]
        if not transition.script:
            return True
        note(node, f"guard {index}" + (f" {node.queue[0][1]}" if transition.event else ""))
        node.asked[index] += 1
        answer = transition.script[(node.asked[index] - 1) % len(transition.script)]
        if answer == ENDS_CYCLE:
            raise CycleEnds
        return answer is True

    def leave_for_good(node: Node) -> bool:
        """Run the exit code of all that is left; return whether any of it ends the cycle."""
        ends = False
        if node.now_in.restart:
            for child in node.children:
                is_left = child.begun and child.settled and not child.now_in.final
                if child.owner == node.state and is_left:
                    ends |= leave_for_good(child)
        try:
            piece(node, f"exit {node.state}", node.now_in.exit)
        except CycleEnds:
            ends = True
        return ends

    def run_cycle_of(node: Node) -> None:
        node.due = len(node.queue)
        if not node.settled:
            complete(node)
        index = choose(node)
        if index is not None:
            transition, data = node.plan.transitions[index], ""
            if transition.event:
                data = f" {node.queue.pop(0)[1]}"
                node.due -= 1
            node.settled = False
            look()
            ends = leave_for_good(node)
            enter(node, transition.destination)
            if ends:
                raise CycleEnds
            piece(node, f"fired {index}{data}", transition.code)
            complete(node)
        if node.now_in.final:
            node.finished = True
            note(node, "finished")
            drop_all(node, DropReason.FINISHED)
        else:
            piece(node, f"code {node.state}", node.now_in.code)

    enter(nodes[0], 0)
    begin(nodes[0])
    look()
    for now in range(0, END + 1, STEP):
        for node in nodes:
            if now and awake(node) and node.settled:
                node.active_time += STEP
        for node in nodes:
            if now % node.plan.period or node.finished or not awake(node):
                continue
            try:
                run_cycle_of(node)
            except CycleEnds:
                begin(node)
                look()
            if nodes[0].finished:
                return trace
        for name in outside.get(now, ()):
            send(name)
    return trace


class Recorder(Observer):
    """Makes the automata of a plan, whose code writes down that it runs, and runs them."""

    def __init__(self, plan: Plan) -> None:
        self.trace: list[Line] = []
        self._sent, self._handed = count(), count(1)
        self._ids = count(1)
        self._plan = plan
        self._awake: set[str] = set()
        self.virtual: VirtualRun | None = None

    def run(self, outside: Outside) -> list[Line]:
        self.virtual = virtual = VirtualRun(component(self._root, on_error="continue"))
        for change in virtual.trace:
            self._note_change(change.automaton, change.state, change.kind)
        virtual.tree.observers.append(self)
        for time in sorted(outside):
            virtual.advance(time / 1000 - virtual.time)
            for name in outside[time]:
                self._send(virtual.component, name)
        virtual.advance(END / 1000 - virtual.time)
        return self.trace

    def _root(self, component: Component) -> Automaton:
        return self._build(component, self._plan)

    def _note(self, name: str, what: str) -> None:
        now = 0.0 if self.virtual is None else self.virtual.time
        self.trace.append((round(now * 1000), name, what))

    def changed(self, now: int, run: Actor, kind: ChangeKind) -> None:
        self._note_change(run.automaton.name, run.current.name, kind)

    def event_dropped(self, run: Actor, event: Event, reason: DropReason) -> None:
        self._note(run.automaton.name, f"drops {event.data}: {reason}")

    def _note_change(self, name: str, state: str, kind: ChangeKind) -> None:
        if kind is ChangeKind.FINISHED:
            self._note(name, "finished")
        elif kind is ChangeKind.GHOST:
            self._awake.discard(name)
            self._note(name, "ghost")
        else:
            if name not in self._awake:
                self._awake.add(name)
                self._note(name, "awake")
            if kind is ChangeKind.ENTERED:
                self._note(name, f"enters {state}")

    def _send(self, component: Component, event: str) -> None:
        component.send(event, next(self._sent))

    def _build(self, component: Component, plan: Plan) -> Automaton:
        number = next(self._ids)
        name = str(number)
        value = 0
        below = [(owner, self._build(component, child)) for owner, child in plan.children]

        def set_inputs(values: Mapping[str, object]) -> None:
            nonlocal value
            value = int(str(values["n"]))

        tries: Counter[str] = Counter()

        def fail(answer: Answer) -> None:
            if answer == FAILS:
                raise ValueError("a mistake")
            if answer == ENDS_CYCLE:
                raise ConnectionLostException("gone")

        def piece(what: str, code: Piece) -> Callable[..., None] | None:
            def run(event: Event | None = None) -> None:
                data = "" if event is None else f" {event.data}"
                self._note(name, f"{what}{data} {value}")
                tries[what + data] += 1
                if code in EVENTS:
                    self._send(component, code)
                elif code and (code == FAILS or tries[what + data] % 2):
                    fail(code)

            return None if code is None else run

        def guard(index: int, script: tuple[Answer, ...]) -> Callable[..., bool] | None:
            asked = count()

            def run(event: Event | None = None) -> bool:
                data = "" if event is None else f" {event.data}"
                self._note(name, f"guard {index}{data}")
                answer = script[next(asked) % len(script)]
                fail(answer)
                return answer is True

            return run if script else None

        def arguments(owner: int, code: Piece) -> Callable[[], Mapping[int, Mapping[str, object]]] | None:
            begin = piece(f"arguments {owner}", code)
            if begin is None:
                return None

            def run() -> Mapping[int, Mapping[str, object]]:
                begin()
                value = next(self._handed)
                return {child.id: {"n": value} for place, child in below if place == owner}

            return run

        return Automaton(
            id=number,
            name=name,
            period=plan.period / 1000,
            inputs=(Input(name="n", type=int, default=0),),
            set_inputs=set_inputs,
            states=tuple(
                State(
                    id=place,
                    name=str(place),
                    initial=place == 0,
                    final=state.final,
                    entry=piece(f"entry {place}", state.entry),
                    code=piece(f"code {place}", state.code),
                    exit=piece(f"exit {place}", state.exit),
                    restart=state.restart,
                    arguments=arguments(place, state.arguments),
                    children=tuple(child for owner, child in below if owner == place),
                )
                for place, state in enumerate(plan.states)
            ),
            transitions=tuple(
                Transition(
                    "",
                    transition.origin,
                    transition.destination,
                    id=index,
                    seconds=None if transition.delay is None else transition.delay / 1000,
                    event=transition.event,
                    finished=transition.finished,
                    guard=guard(index, transition.script),
                    priority=transition.priority,
                    code=piece(f"fired {index}", transition.code),
                )
                for index, transition in enumerate(plan.transitions)
            ),
        )


_CHANGES = ("awake", "ghost", "enters", "drops")


def in_order(trace: list[Line]) -> list[Line]:
    """Return a trace with changes that follow each other without code in between sorted."""
    ordered: list[Line] = []
    for is_change, lines in groupby(trace, lambda line: line[2].startswith(_CHANGES)):
        group = list(lines)
        ordered += sorted(group) if is_change else group
    return ordered


@pytest.mark.slow
@settings(max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(plans(), OUTSIDE)
def test_the_runtime_does_what_the_reference_does(plan: Plan, outside: Outside) -> None:
    assert in_order(Recorder(plan).run(outside)) == in_order(reference(plan, outside))


@pytest.mark.slow
@settings(max_examples=examples(20), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(plans(), OUTSIDE, PAUSES)
def test_cycles_that_pause_at_an_entry_and_go_on_do_the_same(
    plan: Plan, outside: Outside, pauses: tuple[bool, ...]
) -> None:
    entries, paused = count(), False

    def entered(run: Actor, transition: Transition | None) -> bool:
        nonlocal paused
        paused = pauses[next(entries) % len(pauses)]
        return paused

    def run_to_its_end(tree: Tree, run: Actor, now: int, supervisor: Supervisor) -> None:
        nonlocal paused
        run_cycle(tree, run, now, supervisor)
        while paused:
            paused = False
            run_cycle(tree, run, now, supervisor)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Recorder, "entered", lambda self, run, transition: entered(run, transition))
        patch.setattr("hfsm_runtime.virtual._run.run_cycle", run_to_its_end)
        trace = Recorder(plan).run(outside)
    assert in_order(trace) == in_order(reference(plan, outside))
