"""The order of cycles on threads: by their times, ancestors first, however late a thread is; nobody waits for a hang."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from hfsm_runtime import Automaton, Component, State
from hfsm_runtime._actor import ChangeKind
from hfsm_runtime._limits import RuntimeLimits
from hfsm_runtime._runtime import Runtime
from hfsm_runtime._turns import turn_of
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor, Tree
from tests.support.automata import after, automaton, component, finished, when
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.running import running
from tests.support.soak import repeated
from tests.support.waiting import until
from zenoh_ice import WallClock

MS = 1_000_000
MUCH_LATER = 0.02


class OneIsLate(WallClock):
    """Steady wall time; one automaton's thread wakes `late` s after its time."""

    def __init__(self, automaton: str, late: float) -> None:
        self._thread = f"automaton {automaton}"
        self._late = late
        self.waits = threading.Event()
        self.later = 0.0
        """How much later in s a thread woke at most, because the machine was busy."""

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s, and longer on the thread that is late."""
        if threading.current_thread().name == self._thread:
            self.waits.set()
            timeout += self._late
        began = time.monotonic()
        is_set = super().wait(event, timeout)
        if not is_set:
            self.later = max(self.later, time.monotonic() - began - max(timeout, 0.0))
        return is_set


class Entered(Observer):
    """Counts how often the states are entered, by name."""

    def __init__(self, clock: OneIsLate) -> None:
        self.times: dict[str, int] = {}
        self._clock = clock

    def changed(self, now: int, run: Actor, kind: ChangeKind) -> None:
        if kind is ChangeKind.ENTERED:
            self.times[run.current.name] = self.times.get(run.current.name, 0) + 1

    def never(self, name: str, runtime: Runtime) -> bool:
        """Return whether a state was not entered, as is promised unless the machine stops a thread for long."""
        was_stopped = self._clock.later > MUCH_LATER or any(run.cycle.overruns for run in runtime.tree.actors)
        return name not in self.times or was_stopped

    def often(self, name: str) -> bool:
        """Return whether a state was entered again, in a soak at least four times."""
        return self.times.get(name, 0) > repeated(1, 3)


@contextmanager
def running_late(root: Automaton, late: str, seconds: float) -> Iterator[tuple[Runtime, Entered]]:
    clock = OneIsLate(late, seconds)
    runtime = Runtime(component(root), clock)
    entered = Entered(clock)
    runtime.tree.observers.append(entered)
    runtime.start()
    try:
        yield runtime, entered
    finally:
        runtime.stop()


def child_of(period: float, seconds: float, *, final: bool = False) -> Automaton:
    """Return an automaton that enters `c` after a while."""
    states = [State(id=1, name="a"), State(id=2, name="c", final=final)]
    return automaton(2, "child", states, [after(seconds, 1, 2)], period=period)


def leaves_after(seconds: float, child: Automaton) -> Automaton:
    """Return an automaton that restarts its child again and again."""
    states = [State(id=1, name="A", children=(child,), restart=True), State(id=2, name="B")]
    return automaton(1, "root", states, [after(seconds, 1, 2), after(0.05, 2, 1)], period=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("late", ["root", "child"])
def test_what_the_parent_leaves_at_the_same_time_does_not_happen_below(late: str) -> None:
    with running_late(leaves_after(0.1, child_of(0.05, 0.1)), late, 0.03) as (runtime, entered):
        until(lambda: entered.often("B"))
        assert entered.never("c", runtime)


@pytest.mark.slow
def test_a_parent_that_is_late_by_several_periods_of_its_child_comes_first() -> None:
    with running_late(leaves_after(0.1, child_of(0.01, 0.11)), "root", 0.04) as (runtime, entered):
        until(lambda: entered.often("B"))
        assert entered.never("c", runtime)


@pytest.mark.slow
def test_a_child_that_finishes_late_has_finished_when_a_later_cycle_asks() -> None:
    states = [
        State(id=1, name="A", children=(child_of(0.02, 0.08, final=True),), restart=True),
        State(id=2, name="B"),
        State(id=3, name="too late"),
    ]
    ways = [finished(1, 2), after(0.1, 1, 3), after(0.1, 2, 1), after(0.1, 3, 1)]
    with running_late(automaton(1, "root", states, ways, period=0.1), "child", 0.05) as (runtime, entered):
        until(lambda: entered.often("B"))
        assert entered.never("too late", runtime)


@pytest.mark.slow
def test_grandparents_come_first() -> None:
    middle = automaton(
        3, "middle", [State(id=1, name="m", children=(child_of(0.05, 0.1),), restart=True)], period=0.05
    )
    with running_late(leaves_after(0.1, middle), "root", 0.03) as (runtime, entered):
        until(lambda: entered.often("B"))
        assert entered.never("c", runtime)


@pytest.mark.parametrize("where", ["guard", "code"])
def test_a_parent_that_hangs_does_not_hold_up_its_child(where: str) -> None:
    hangs, release = threading.Event(), threading.Event()

    def hang() -> bool:
        hangs.set()
        release.wait(FOREVER)
        return False

    child = automaton(2, "child", [State(id=1, name="x")], period=0.02)
    states = [
        State(id=1, name="a", code=hang if where == "code" else None, children=(child,)),
        State(id=2, name="b"),
    ]
    ways = [when(hang, 1, 2)] if where == "guard" else []
    with running(automaton(1, "root", states, ways, period=0.02)) as runtime:
        assert hangs.wait(EVENT_LIMIT)
        cycles = runtime.actor(2).cycle.count
        until(lambda: runtime.actor(2).cycle.count > cycles + 3)
        release.set()


def test_a_parent_that_sleeps_does_not_hold_up_its_child() -> None:
    sleeps = threading.Event()

    def root(c: Component) -> Automaton:
        def code() -> None:
            sleeps.set()
            c.sleep(FOREVER)

        child = automaton(2, "child", [State(id=1, name="x")], period=0.02)
        return automaton(1, "root", [State(id=1, name="a", code=code, children=(child,))], period=0.02)

    with running(root) as runtime:
        assert sleeps.wait(EVENT_LIMIT)
        cycles = runtime.actor(2).cycle.count
        until(lambda: runtime.actor(2).cycle.count > cycles + 3)


def test_a_child_that_hangs_does_not_keep_its_parent_from_leaving() -> None:
    hangs, release = threading.Event(), threading.Event()

    def hang() -> bool:
        hangs.set()
        release.wait(FOREVER)
        return False

    states = [State(id=1, name="x"), State(id=2, name="y")]
    child = automaton(2, "child", states, [when(hang, 1, 2)], period=0.01)
    with running(leaves_after(0.06, child), limits=RuntimeLimits(hand_over=0.05)) as runtime:
        assert hangs.wait(EVENT_LIMIT)
        until(lambda: runtime.tree.root.current.name == "B" or bool(runtime.errors))
        release.set()


def test_automata_side_by_side_do_not_wait_for_each_other() -> None:
    left = automaton(
        2, "left", [State(id=1, name="x"), State(id=2, name="y")], [after(60, 1, 2)], period=0.02
    )
    right = automaton(3, "right", [State(id=1, name="x")], period=0.02)
    root = automaton(1, "root", [State(id=1, name="a", children=(left, right))], period=0.02)
    with running_late(root, "left", FOREVER) as (runtime, _):
        until(lambda: runtime.actor(3).cycle.count > runtime.actor(2).cycle.count + 5)


def test_it_is_paused_stepped_resumed_and_stopped_while_a_child_waits_for_a_late_parent() -> None:
    child = automaton(2, "child", [State(id=1, name="x")], period=0.02)
    states = [State(id=1, name="a", children=(child,)), State(id=2, name="b")]
    root = automaton(1, "root", states, [when(lambda: False, 1, 2)], period=0.02)
    clock = OneIsLate("root", FOREVER)
    runtime = Runtime(component(root), clock)
    runtime.start()
    try:
        assert clock.waits.wait(EVENT_LIMIT)
        runtime.pause()
        until(lambda: not runtime.in_cycle)
        cycles = [run.cycle.count for run in runtime.tree.actors]
        runtime.step(0)
        assert [run.cycle.count for run in runtime.tree.actors] == [each + 1 for each in cycles]
        runtime.resume()
        # A child whose turn it is not wakes the one whose turn it is.
        until(
            lambda: all(
                run.cycle.count > each + 3 for run, each in zip(runtime.tree.actors, cycles, strict=True)
            )
        )
    finally:
        runtime.stop()
    assert not any(thread.name.startswith("automaton") for thread in threading.enumerate())


@pytest.fixture
def chain() -> tuple[Tree, Actor, Actor]:
    """Return an active tree of two automata: periods of 0.4 s and 0.1 s, both with a guard."""
    inner = automaton(
        2, "child", [State(id=1, name="x"), State(id=2, name="y")], [when(lambda: False, 1, 2)], period=0.1
    )
    states = [State(id=1, name="a", children=(inner,)), State(id=2, name="b")]
    tree = Tree(automaton(1, "root", states, [when(lambda: False, 1, 2)], period=0.4))
    tree.start(0)
    root, child = tree.actors
    return tree, root, child


def test_the_turn_is_that_of_the_earlier_time_and_of_the_parent_at_the_same_time(
    chain: tuple[Tree, Actor, Actor],
) -> None:
    tree, root, child = chain
    assert turn_of(child, 0, 0) is root
    assert turn_of(root, 0, 0) == 0
    tree.decide(root, 0)
    assert turn_of(child, 0, 0) == 0
    tree.decide(child, 0)
    assert turn_of(root, 400 * MS, 400 * MS) is child
    assert turn_of(child, 400 * MS, 400 * MS) == 300 * MS


def test_a_late_child_runs_the_last_cycle_before_that_of_its_parent(chain: tuple[Tree, Actor, Actor]) -> None:
    tree, root, child = chain
    tree.decide(root, 0)
    assert turn_of(child, 950 * MS, 950 * MS) == 300 * MS
    tree.decide(root, 400 * MS)
    assert turn_of(child, 950 * MS, 750 * MS) == 700 * MS


def test_a_cycle_that_lasts_longer_than_a_period_is_not_waited_for(chain: tuple[Tree, Actor, Actor]) -> None:
    _, root, child = chain
    root.cycle.began = 0
    assert turn_of(child, 100 * MS - 1, 100 * MS - 1) is root
    assert turn_of(child, 100 * MS, 100 * MS) == 100 * MS
    root.cycle.next_slot, child.cycle.began = 400 * MS, 350 * MS
    assert turn_of(root, 450 * MS - 1, 450 * MS - 1) is child
    assert turn_of(root, 450 * MS, 450 * MS) == 400 * MS


def test_a_short_period_leaves_a_cycle_a_tenth_of_a_second() -> None:
    inner = automaton(2, "child", [State(id=1, name="x")], period=0.01)
    states = [State(id=1, name="a", children=(inner,)), State(id=2, name="b")]
    tree = Tree(automaton(1, "root", states, [when(lambda: False, 1, 2)], period=0.02))
    tree.start(0)
    root, child = tree.actors
    root.cycle.began = 0
    assert turn_of(child, 100 * MS - 1, 100 * MS - 1) is root
    assert turn_of(child, 100 * MS, 100 * MS) == 100 * MS


def test_a_ghost_is_not_waited_for(chain: tuple[Tree, Actor, Actor]) -> None:
    tree, root, child = chain
    tree.decide(root, 0)
    assert turn_of(root, 400 * MS, 400 * MS) is child
    wake = threading.Event()
    child.cycle.followers[wake] = None
    assert tree.begin_cycle(root)
    assert tree.leave(root, 400 * MS)
    assert wake.is_set()
    assert turn_of(root, 400 * MS, 400 * MS) == 400 * MS


def test_a_parent_waits_for_late_children_for_one_period(chain: tuple[Tree, Actor, Actor]) -> None:
    tree, root, child = chain
    tree.decide(root, 0)
    assert turn_of(root, 800 * MS - 1, 800 * MS - 1) is child
    assert turn_of(root, 800 * MS, 800 * MS) == 800 * MS


def test_a_parent_that_is_late_does_not_overtake_the_cycles_below() -> None:
    below = automaton(
        2, "child", [State(id=1, name="x"), State(id=2, name="y")], [when(lambda: False, 1, 2)], period=0.08
    )
    states = [State(id=1, name="a", children=(below,)), State(id=2, name="b")]
    tree = Tree(automaton(1, "root", states, [when(lambda: False, 1, 2)], period=0.05))
    tree.start(0)
    root, child = tree.actors
    tree.decide(root, 0)
    tree.decide(child, 0)
    assert turn_of(child, 130 * MS, 130 * MS) is root
    assert turn_of(root, 130 * MS, 130 * MS) == 50 * MS
    tree.decide(root, 50 * MS)
    assert turn_of(root, 130 * MS, 130 * MS) is child
    assert turn_of(child, 130 * MS, 130 * MS) == 80 * MS


def test_nobody_waits_for_a_cycle_in_which_no_timer_has_expired() -> None:
    def timed(id: int, name: str, period: float, *below: Automaton) -> Automaton:
        states = [State(id=1, name="a", children=below), State(id=2, name="b")]
        return automaton(id, name, states, [after(0.4, 1, 2)], period=period)

    tree = Tree(timed(1, "root", 0.4, timed(2, "child", 0.1)))
    tree.start(0)
    root, child = tree.actors
    assert turn_of(child, 0, 0) == 0
    tree.decide(root, 0)
    tree.decide(child, 300 * MS)
    assert turn_of(child, 400 * MS, 400 * MS) is root


def test_an_entry_and_a_final_state_are_waited_for() -> None:
    entering = automaton(2, "entering", [State(id=1, name="x", entry=lambda: None)], period=0.1)
    finishing = automaton(3, "finishing", [State(id=1, name="x", final=True)], period=0.1)
    states = [State(id=1, name="a", children=(entering, finishing)), State(id=2, name="b")]
    tree = Tree(automaton(1, "root", states, [finished(1, 2)], period=0.4))
    tree.start(0)
    root, first, second = tree.actors
    tree.decide(root, 0)
    assert turn_of(root, 400 * MS, 400 * MS) is second
    tree.decide(second, 300 * MS)
    assert turn_of(root, 400 * MS, 400 * MS) is first
