"""Code that sleeps: on threads and in virtual time automata enter the same states at the same times."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from itertools import product
from typing import Any

import pytest

from hfsm_runtime import Automaton, Component, State
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor, ChangeKind
from hfsm_runtime.virtual import Execution
from tests.support.automata import after, automaton, component
from zenoh_ice.threads.clock import WALL

SECONDS = 2.5
LATE = 0.02
"""Seconds by which threads may be late; on a machine on which they are later it is tried again."""
ATTEMPTS = 20
SLEEPS: dict[str, Callable[[Component], None]] = {
    "short": lambda self: self.sleep(0.12),
    "long": lambda self: self.sleep(2.02),
    "that nothing cuts": lambda self: self.clock.sleep(0.22),
}
"""They end, and timers that begin then expire, soon after the beginning of a cycle: the next one is far."""
PLACES = ("entry", "code", "exit", "guard", "transition")
Entered = dict[str, list[tuple[float, str]]]


def made(place: str, sleep: str, above: bool) -> Component:
    """Return a component in which one automaton sleeps, and one above or below it does not."""

    def root(self: Component) -> Automaton:
        def nap() -> bool:
            SLEEPS[sleep](self)
            return True

        def sleeper(id: int, *children: Automaton) -> Automaton:
            pieces: dict[str, Any] = {place: nap} if place in ("entry", "code", "exit") else {}
            states = [State(id=1, name="a", children=children, **pieces), State(id=2, name="b")]
            goes = after(
                0.3, 1, 2, nap if place == "transition" else None, guard=nap if place == "guard" else None
            )
            return automaton(id, "sleeper", states, [goes, after(0.2, 2, 1)])

        def calm(id: int, first: float, second: float, *children: Automaton) -> Automaton:
            states = [State(id=1, name="c", children=children), State(id=2, name="d")]
            return automaton(id, "calm", states, [after(first, 1, 2), after(second, 2, 1)], 0.05)

        return sleeper(1, calm(2, 0.15, 0.2)) if above else calm(1, 0.93, 0.42, sleeper(2))

    return component(root)


class Watch(Observer):
    """The states that automata enter on threads."""

    def __init__(self) -> None:
        self.states: Entered = defaultdict(list)

    def changed(self, now: int, run: Actor, kind: ChangeKind) -> None:
        if kind is ChangeKind.ENTERED:
            self.states[run.automaton.name].append((now / 1e9, run.current.name))


def on_threads(place: str, sleep: str, above: bool) -> Entered:
    """Return what happens on threads of a machine that is not late."""
    for _ in range(ATTEMPTS):
        runtime, watch = Runtime(made(place, sleep, above), WALL), Watch()
        runtime.tree.observers.append(watch)
        longest, looked = 0.0, WALL.now()
        runtime.start()
        try:
            while runtime.component_time.now() < (SECONDS + 2 * LATE) * 1e9:
                WALL.sleep(0.002)
                longest, looked = max(longest, WALL.now() - looked), WALL.now()
        finally:
            runtime.stop()
        if longest < LATE:
            return watch.states
    pytest.skip(f"this machine is {longest:.3f} s late again and again")


def in_virtual_time(place: str, sleep: str, above: bool) -> Entered:
    entered: Entered = defaultdict(list)
    with Execution(made(place, sleep, above)) as run:
        run.advance(SECONDS)
        for change in run.trace:
            if change.kind is ChangeKind.ENTERED:
                entered[change.automaton].append((change.time, change.state))
    return entered


@pytest.mark.soak(
    "tests/unit/hfsm_runtime/virtual/test_run_sleeps.py::test_a_child_that_sleeps_does_not_keep_its_parent_from_leaving"
)
@pytest.mark.parametrize(("place", "sleep", "above"), [*product(PLACES, SLEEPS, (True, False))])
def test_the_same_states_are_entered_at_the_same_times(place: str, sleep: str, above: bool) -> None:
    expected = in_virtual_time(place, sleep, above)
    found = on_threads(place, sleep, above)
    for name, moments in expected.items():
        assert len(found[name]) >= len(moments)
        # Where a sleep ends, and no cycle begins, threads are a little late.
        kept = found[name][: len(moments)]
        assert [state for _, state in kept] == [state for _, state in moments]
        assert [at for at, _ in kept] == pytest.approx([at for at, _ in moments], abs=LATE)
