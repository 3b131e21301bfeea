"""Cycles in which nothing can happen are counted without being run, and no others."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from hfsm_runtime import State, Transition, VirtualRun
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from tests.support.automata import after, automaton, component, on, when

MS = 1_000_000


def virtual_of(*transitions: Transition, code: Callable[[], object] | None = None) -> VirtualRun:
    """Return a run of one automaton with a period of 0.1 s, after its first cycle."""
    states = [State(id=1, name="a", code=code), State(id=2, name="b")]
    virtual = VirtualRun(component(automaton(1, "root", states, transitions)))
    virtual.advance(0.0)
    return virtual


@pytest.mark.parametrize("transitions", [(), (after(10, 1, 2),), (on("go", 1, 2),)])
def test_a_cycle_in_which_nothing_can_happen_is_skipped_and_counts(
    transitions: tuple[Transition, ...],
) -> None:
    virtual = virtual_of(*transitions)
    root = virtual.tree.root
    assert virtual.tree.skip_cycle(root, 100 * MS)
    assert (root.cycle.count, root.cycle.last_slot, root.cycle.next_slot) == (2, 100 * MS, 200 * MS)


@pytest.mark.parametrize("transition", [after(0.1, 1, 2), when(lambda: False, 1, 2)])
def test_one_in_which_a_transition_is_tried_is_run(transition: Transition) -> None:
    virtual = virtual_of(transition)
    assert not virtual.tree.skip_cycle(virtual.tree.root, 100 * MS)
    assert virtual.tree.root.cycle.count == 1


def test_one_with_code_is_run() -> None:
    virtual = virtual_of(code=lambda: None)
    assert not virtual.tree.skip_cycle(virtual.tree.root, 100 * MS)


def test_one_with_an_event_or_a_forced_transition_is_run() -> None:
    virtual = virtual_of(on("go", 1, 2))
    virtual.force(1, virtual.tree.root.automaton.transitions[0].id)
    assert not virtual.tree.skip_cycle(virtual.tree.root, 100 * MS)
    virtual = virtual_of(on("go", 1, 2))
    virtual.send("go")
    assert not virtual.tree.skip_cycle(virtual.tree.root, 100 * MS)
    virtual.advance(0.1)
    assert virtual.active == "b"


def test_none_is_skipped_while_the_tree_is_held() -> None:
    virtual = virtual_of()
    virtual.pause()
    assert not virtual.tree.skip_cycle(virtual.tree.root, 100 * MS)
    virtual.advance(0.2)
    assert virtual.tree.root.cycle.count == 1


def test_who_watches_cycles_sees_all_of_them() -> None:
    class Watch(Observer):
        seen = 0

        def cycle_ended(self, run: Actor, at: int) -> None:
            self.seen += 1

    virtual = virtual_of()
    virtual.advance(0.5)
    watch = Watch()
    virtual.tree.observers.append(watch)
    virtual.advance(0.5)
    assert (watch.seen, virtual.tree.root.cycle.count) == (5, 11)


def test_a_timer_expires_in_its_cycle_after_many_that_were_skipped() -> None:
    virtual = virtual_of(after(5.0, 1, 2))
    virtual.advance(10.0)
    assert virtual.changes("root") == [(0.0, "a"), (5.0, "b")]
