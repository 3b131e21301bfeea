"""Random trees of automata against an interpreter that is one loop and nothing else.

Guards are scripts: each says at which of its evaluations it holds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hfsm_runtime import Automaton, State, Transition, VirtualRun
from hfsm_runtime.tree import ChangeKind
from tests.support.automata import component


@dataclass(frozen=True)
class PlannedTransition:
    origin: int
    destination: int
    delay: int | None  # ms
    script: tuple[bool, ...]


@dataclass(frozen=True)
class Plan:
    period: int  # ms
    states: int
    transitions: tuple[PlannedTransition, ...]
    children: tuple[tuple[int, Plan], ...] = field(default=())


@st.composite
def plans(draw: st.DrawFn, depth: int = 0) -> Plan:
    states = draw(st.integers(1, 3))
    places = st.integers(1, states)
    delays = st.none() | st.integers(1, 900)
    scripts = st.lists(st.booleans(), min_size=1, max_size=6).map(tuple)
    transitions = st.builds(PlannedTransition, places, places, delays, scripts)
    children: list[tuple[int, Plan]] = []
    if depth < 3:
        owners = draw(st.lists(places, max_size=2))
        children = [(owner, draw(plans(depth + 1))) for owner in owners]
    return Plan(
        period=draw(st.sampled_from([20, 50, 100, 100, 130])),
        states=states,
        transitions=tuple(draw(st.lists(transitions, max_size=5))),
        children=tuple(children),
    )


@dataclass
class Node:
    """An automaton of the reference."""

    name: str
    plan: Plan
    children: list[tuple[int, Node]]
    state: int = 1
    active_time: int = 0  # ms in the current state
    seen: int = 0  # when active_time was last brought up to date
    asked: dict[int, int] = field(default_factory=dict)


def number(plan: Plan, ids: count[int]) -> Node:
    name = str(next(ids))
    return Node(name, plan, [(owner, number(child, ids)) for owner, child in plan.children])


def reference(plan: Plan, end: int) -> list[tuple[int, str, int]]:
    """Return when each automaton was entered, one millisecond at a time."""
    root = number(plan, count(1))
    trace: list[tuple[int, str, int]] = []

    def visit(node: Node, active: bool, now: int) -> None:
        if active:
            node.active_time += 1 if now else 0
        for owner, child in node.children:
            visit(child, active and node.state == owner, now)

    def cycle(node: Node, active: bool, now: int) -> None:
        if active and now % node.plan.period == 0:
            trace_cycle(node, now)
        for owner, child in node.children:
            cycle(child, active and node.state == owner, now)

    def trace_cycle(node: Node, now: int) -> None:
        for index, transition in enumerate(node.plan.transitions):
            if transition.origin != node.state:
                continue
            if transition.delay is not None:
                holds = node.active_time >= transition.delay
            else:
                asked = node.asked[index] = node.asked.get(index, -1) + 1
                holds = transition.script[asked % len(transition.script)]
            if holds:
                node.state = transition.destination
                node.active_time = 0
                trace.append((now, node.name, node.state))
                return

    for now in range(end + 1):
        visit(root, True, now)
        cycle(root, True, now)
    return trace


def build(plan: Plan, ids: count[int]) -> Automaton:
    number = next(ids)
    below: dict[int, list[Automaton]] = {}
    for owner, child in plan.children:
        below.setdefault(owner, []).append(build(child, ids))

    def guard(script: tuple[bool, ...]) -> Callable[[], bool]:
        asked = count()
        return lambda: script[next(asked) % len(script)]

    return Automaton(
        id=number,
        name=str(number),
        period=plan.period / 1000,
        states=tuple(
            State(id=state, name=str(state), initial=state == 1, children=tuple(below.get(state, ())))
            for state in range(1, plan.states + 1)
        ),
        transitions=tuple(
            Transition(
                id=index + 1,
                origin=transition.origin,
                destination=transition.destination,
                seconds=None if transition.delay is None else transition.delay / 1000,
                guard=guard(transition.script) if transition.delay is None else None,
            )
            for index, transition in enumerate(plan.transitions)
        ),
    )


def entered(plan: Plan, end: int) -> list[tuple[int, str, int]]:
    virtual = VirtualRun(component(build(plan, count(1))))
    virtual.advance(end / 1000)
    first: set[str] = set()
    trace: list[tuple[int, str, int]] = []
    for change in virtual.trace:
        if change.kind is not ChangeKind.ENTERED:
            continue
        if change.automaton in first:
            trace.append((round(change.time * 1000), change.automaton, int(change.state)))
        first.add(change.automaton)  # its initial state
    return trace


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(plans())
def test_the_runtime_does_what_the_reference_does(plan: Plan) -> None:
    assert entered(plan, 2500) == reference(plan, 2500)
