"""The monitor of a running component, over the wire."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from hfsm_runtime import Automaton, Component, State, Transition
from hfsm_runtime.monitor import Monitor
from hfsm_runtime.runtime import Runtime
from interfaces.hfsm import ComponentSnapshot, ComponentStatus, HfsmMonitorPrx, NoSuchElement, TransitionKind
from tests.conftest import Pair
from tests.support.automata import component
from zenoh_ice import WallClock

LIMIT = 10.0


def eventually(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + LIMIT
    while not condition():
        assert time.monotonic() < deadline, "it did not come true in time"
        time.sleep(0.01)


def until(proxy: HfsmMonitorPrx, condition: Callable[[ComponentSnapshot], bool]) -> ComponentSnapshot:
    """Return the first snapshot of the stream that meets a condition."""
    deadline = time.monotonic() + LIMIT
    for sample in proxy.getSnapshot.samples(timeout=2.0):
        if condition(sample.value):
            return sample.value
        assert time.monotonic() < deadline, sample.value
    raise AssertionError("the stream ended")


@contextmanager
def monitored(
    pair: Pair, root: Automaton, made: Component | None = None
) -> Iterator[tuple[Runtime, HfsmMonitorPrx]]:
    runtime = Runtime(made or component(root), WallClock())
    with Monitor(runtime, pair.server):
        runtime.start()
        try:
            identity = f"Hfsm.{runtime.name}"
            yield runtime, HfsmMonitorPrx.checkedCast(pair.client.stringToProxy(identity))
        finally:
            runtime.stop()


def tree() -> Automaton:
    count = 0

    def red() -> None:
        nonlocal count
        count += 1

    child = Automaton(
        id=2,
        name="follow",
        period=0.05,
        states=(State(id=1, name="red", initial=True, code=red), State(id=2, name="green")),
        transitions=(Transition(id=1, name="later", origin=1, destination=2, seconds=3600.0),),
    )
    return Automaton(
        id=1,
        name="walker",
        period=0.05,
        states=(
            State(id=1, name="follow", initial=True, children=(child,)),
            State(id=2, name="dance"),
        ),
        transitions=(
            Transition(id=1, name="never", origin=1, destination=2, guard=lambda: False, condition="False"),
            Transition(id=2, name="back", origin=2, destination=1, seconds=3600.0),
        ),
    )


def test_the_structure_is_told(pair: Pair) -> None:
    with monitored(pair, tree()) as (_, proxy):
        structure = proxy.getStructure()
    assert structure.name == "walker"
    root, child = structure.automata
    assert (root.id, root.name, root.parent, root.owner, root.period) == (1, "walker", 0, 0, 0.05)
    assert (child.id, child.name, child.parent, child.owner) == (2, "follow", 1, 1)
    assert [(state.name, state.initial, state.children) for state in root.states] == [
        ("follow", True, [2]), ("dance", False, [])
    ]  # fmt: skip
    assert [(t.kind, t.seconds, t.condition, t.order) for t in root.transitions] == [
        (TransitionKind.OnCondition, 0.0, "False", 1), (TransitionKind.OnTime, 3600.0, "", 1)
    ]  # fmt: skip


def test_snapshots_tell_states_timers_guards_variables_and_cycles(pair: Pair) -> None:
    with monitored(pair, tree()) as (_, proxy):
        snapshot = until(proxy, lambda snapshot: snapshot.automata[1].cycles >= 3)
    assert snapshot.status is ComponentStatus.Running
    root, child = snapshot.automata
    assert (root.state, root.ghost, child.state, child.ghost) == (1, False, 1, False)
    assert [(guard.transition, guard.value) for guard in root.guards] == [(1, False)]
    (timer,) = child.timers
    assert 3590 < timer.remaining < 3600
    assert int(child.variables["count"]) >= 3
    assert child.lastCycle <= child.longestCycle < 2
    assert snapshot.errors == []


def test_snapshots_come_each_tenth_of_a_second_and_at_every_change(pair: Pair) -> None:
    with monitored(pair, tree()) as (runtime, proxy):
        times: list[float] = []
        states: list[tuple[int, bool]] = []

        def take(snapshot: ComponentSnapshot) -> None:
            times.append(snapshot.time)
            states.append((snapshot.automata[0].state, snapshot.automata[1].ghost))

        subscription = proxy.getSnapshot.subscribe(lambda sample: take(sample.value))
        eventually(lambda: len(times) >= 5)
        runtime.force(1, 1)
        eventually(lambda: (2, True) in states)
        subscription.close()


def test_a_transition_is_forced_and_the_child_becomes_a_ghost(pair: Pair) -> None:
    with monitored(pair, tree()) as (_, proxy):
        proxy.forceTransition(1, 1)
        snapshot = until(proxy, lambda snapshot: snapshot.automata[0].state == 2)
        assert snapshot.automata[0].lastTransition == 1
        assert snapshot.automata[1].ghost
        with pytest.raises(NoSuchElement, match="no transition 9"):
            proxy.forceTransition(1, 9)
        with pytest.raises(NoSuchElement, match="no automaton 9"):
            proxy.step(9)


def test_pause_step_and_resume(pair: Pair) -> None:
    with monitored(pair, tree()) as (_, proxy):
        proxy.pause()
        paused = until(proxy, lambda snapshot: snapshot.status is ComponentStatus.Paused)
        proxy.step(2)
        stepped = proxy.getSnapshot()
        assert stepped.automata[1].cycles == paused.automata[1].cycles + 1
        assert stepped.time == pytest.approx(paused.time + 0.05)
        proxy.resume()
        until(proxy, lambda snapshot: snapshot.automata[1].cycles > stepped.automata[1].cycles + 1)


def test_stop_ends_the_component(pair: Pair) -> None:
    with monitored(pair, tree()) as (runtime, proxy):
        proxy.stop()
        assert runtime.ended.wait(LIMIT)
        assert until(proxy, lambda snapshot: True).status is ComponentStatus.Halted


def test_errors_of_user_code_are_shown(pair: Pair) -> None:
    def broken() -> None:
        raise ValueError("no ball")

    root = Automaton(id=1, name="walker", states=(State(id=3, name="a", initial=True, code=broken),))
    with monitored(pair, root) as (_, proxy):
        snapshot = until(proxy, lambda snapshot: snapshot.status is ComponentStatus.Halted)
    (error,) = snapshot.errors
    assert (error.automaton, error.state, error.message) == (1, 3, "ValueError: no ball")
    assert error.time >= 0
