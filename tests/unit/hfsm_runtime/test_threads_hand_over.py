"""The hand-over between automata on threads: two that exclude each other never drive the robot at once."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable
from contextlib import suppress

import pytest

from hfsm_runtime import Automaton, Component, State
from hfsm_runtime._limits import LIMITS, RuntimeLimits
from tests.support.automata import Code, after, automaton, when
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.running import running
from tests.support.waiting import until

PATIENT = RuntimeLimits(hand_over=FOREVER)
"""A cycle ends, even on a busy machine, before it is reported as an error."""
HASTY = RuntimeLimits(hand_over=0.02)
"""Nobody waits long for a cycle that a test lets last."""


@pytest.mark.slow
def test_sub_automata_never_run_side_by_side_and_the_new_state_waits_for_the_old() -> None:
    inside: list[str] = []
    faults: list[list[str]] = []
    turns = {"left": 0, "right": 0}

    def work(name: str) -> Callable[[], None]:
        def code() -> None:
            inside.append(name)
            time.sleep(random.uniform(0.001, 0.02))
            if any(other != name for other in inside):
                faults.append(list(inside))
            turns[name] += 1
            inside.remove(name)

        return code

    def arrive(allowed: str) -> Callable[[], None]:
        def code() -> None:
            if any(not name.startswith(allowed) for name in inside):
                faults.append([allowed, *inside])

        return code

    def child(id: int, name: str) -> Automaton:
        here = work(name)
        below = automaton(
            id + 10, name, [State(id=1, name="x", entry=here, code=here, exit=here)], period=0.003
        )
        state = State(
            id=1, name="x", entry=here, code=here, exit=here, children=(below,), restart=name == "left"
        )
        return automaton(id, name, [state], period=0.005)

    def children(id: int, name: str) -> tuple[Automaton, Automaton]:
        return child(id, name), child(id + 1, name)

    root = automaton(
        1,
        "root",
        [
            State(id=1, name="left", code=arrive("left"), children=children(2, "left"), restart=True),
            State(id=2, name="right", code=arrive("right"), children=children(4, "right")),
        ],
        [after(0.03, 1, 2), after(0.03, 2, 1)],
        period=0.01,
    )
    with running(root, limits=PATIENT) as runtime:
        until(lambda: min(turns.values()) > 30)
    assert faults == []
    assert runtime.errors == ()


def slow_hand_over(order: list[str], release: threading.Event) -> Automaton:
    def slow() -> None:
        order.append("child begins")
        release.wait(FOREVER)
        order.append("child ends")

    child = automaton(2, "child", [State(id=1, name="x", code=slow)])
    return automaton(
        1,
        "root",
        [
            State(id=1, name="a", children=(child,)),
            State(id=2, name="b", code=lambda: order.append("new state")),
        ],
        [when(lambda: "child begins" in order, 1, 2, code=lambda: order.append("transition"))],
        period=0.02,
    )


def test_neither_the_transition_nor_the_new_state_runs_before_the_childs_cycle_has_ended() -> None:
    order: list[str] = []
    release = threading.Event()
    with running(slow_hand_over(order, release), limits=PATIENT) as runtime:
        until(lambda: not runtime.tree.actors[1].active)
        assert (order, runtime.tree.root.current.name) == (["child begins"], "a")
        release.set()
        until(lambda: len(order) > 3)
    assert order[:4] == ["child begins", "child ends", "transition", "new state"]
    assert runtime.errors == ()


def test_a_childs_cycle_that_does_not_end_is_reported_as_an_error() -> None:
    order: list[str] = []
    release = threading.Event()
    with running(slow_hand_over(order, release), limits=HASTY) as runtime:
        until(lambda: "new state" in order)
        release.set()
    assert order[:3] == ["child begins", "transition", "new state"]
    (error,) = runtime.errors
    assert (error.automaton, error.state) == (2, 1)
    assert "still in a cycle 0.02 s after root left the state a" in error.message
    assert LIMITS.hand_over == 1.0, "outside of tests"
    assert not runtime.failed


def test_a_cycle_that_became_a_ghosts_fires_no_transition_and_runs_no_further_code() -> None:
    asked, left = threading.Event(), threading.Event()
    ran: list[str] = []

    def guard() -> bool:
        asked.set()
        left.wait(FOREVER)
        return True

    child = automaton(
        2,
        "child",
        [
            State(id=1, name="x", code=lambda: ran.append("x")),
            State(id=2, name="y", code=lambda: ran.append("y")),
        ],
        [when(guard, 1, 2)],
    )
    root = automaton(
        1,
        "root",
        [State(id=1, name="a", children=(child,)), State(id=2, name="b")],
        [when(asked.is_set, 1, 2)],
        period=0.02,
    )
    with running(root, limits=HASTY) as runtime:
        until(lambda: runtime.tree.root.current.name == "b")
        left.set()
        until(lambda: not runtime.tree.actors[1].in_cycle)
    assert runtime.tree.actors[1].current.name == "x"
    assert ran == []


def cuts_short(build: Callable[[Component, Code], Automaton]) -> list[str]:
    """Run a child that sleeps below the root, which leaves it then; return what followed the sleep."""
    sleeping = threading.Event()
    after_sleep: list[str] = []

    def root(c: Component) -> Automaton:
        def sleep() -> None:
            sleeping.set()
            with suppress(Exception):
                c.sleep(3600)
            after_sleep.append("went on")

        states = [State(id=1, name="a", children=(build(c, sleep),)), State(id=2, name="b")]
        return automaton(1, "root", states, [when(sleeping.is_set, 1, 2)], period=0.02)

    with running(root, limits=PATIENT) as runtime:
        until(lambda: next(runtime.tree.root.paths()) == "b")
        assert not any(run.in_cycle for run in runtime.tree.actors[1:])
        assert runtime.errors == ()
    return after_sleep


def leaf(sleep: Code, id: int = 2) -> Automaton:
    return automaton(id, "leaf", [State(id=1, name="x", code=sleep)], period=0.02)


@pytest.mark.parametrize(
    "build",
    [
        lambda c, sleep: leaf(sleep),
        lambda c, sleep: automaton(
            3, "middle", [State(id=1, name="m", children=(leaf(sleep),))], period=0.02
        ),
        lambda c, sleep: automaton(2, "entry", [State(id=1, name="x", entry=sleep)], period=0.02),
        lambda c, sleep: automaton(2, "guard", [State(id=1, name="x")], [when(sleep, 1, 1)], period=0.02),
        lambda c, sleep: automaton(
            2, "exit", [State(id=1, name="x", exit=sleep)], [after(0.02, 1, 1)], period=0.02
        ),
        lambda c, sleep: automaton(
            2, "fired", [State(id=1, name="x")], [after(0.02, 1, 1, code=sleep)], period=0.02
        ),
    ],
    ids=["code", "grandchild", "entry", "guard", "exit", "fired"],
)
def test_a_sleep_in_a_child_ends_at_once_and_silently_when_an_ancestor_leaves_the_state(
    build: Callable[[Component, Code], Automaton], caplog: pytest.LogCaptureFixture
) -> None:
    assert cuts_short(build) == []
    assert caplog.records == []


def test_the_exit_code_of_children_that_restart_waits_for_their_running_cycles() -> None:
    order: list[str] = []
    release = threading.Event()

    def blocks() -> None:
        order.append("first begins")
        release.wait(FOREVER)
        order.append("first ends")

    first = automaton(
        2, "first", [State(id=1, name="x", code=blocks, exit=lambda: order.append("exit first"))], period=0.02
    )
    second = automaton(
        3, "second", [State(id=1, name="y", exit=lambda: order.append("exit second"))], period=0.02
    )
    states = [
        State(id=1, name="a", children=(first, second), restart=True, exit=lambda: order.append("exit a")),
        State(id=2, name="b", entry=lambda: order.append("entry b"), code=lambda: order.append("b")),
    ]
    change = when(lambda: "first begins" in order, 1, 2, code=lambda: order.append("fired"))
    with running(automaton(1, "root", states, [change], period=0.02), limits=PATIENT) as runtime:
        until(lambda: not any(run.active for run in runtime.tree.actors[1:]))
        assert order == ["first begins"]
        release.set()
        until(lambda: "b" in order)
    assert order[:8] == [
        "first begins", "first ends", "exit first", "exit second", "exit a", "fired", "entry b", "b",
    ]  # fmt: skip


def test_a_cycle_that_outlives_the_hand_over_changes_nothing_in_an_automaton_that_restarted() -> None:
    leaving, release = threading.Event(), threading.Event()
    ran: list[str] = []

    def blocks() -> None:
        if not leaving.is_set():
            leaving.set()
            release.wait(FOREVER)

    child = automaton(
        2,
        "child",
        [State(id=1, name="x", exit=blocks), State(id=2, name="y", entry=lambda: ran.append("entry y"))],
        [when(lambda: not leaving.is_set(), 1, 2, code=lambda: ran.append("fired"))],
        period=0.02,
    )
    states = [State(id=1, name="a", children=(child,), restart=True), State(id=2, name="b")]
    changes = [when(leaving.is_set, 1, 2), after(0.02, 2, 1)]
    with running(automaton(1, "root", states, changes, period=60), limits=HASTY) as runtime:
        late = runtime.tree.actors[1]
        assert leaving.wait(EVENT_LIMIT)
        runtime.pause()
        runtime.step(1)  # to b, and the child is late
        assert (next(runtime.tree.root.paths()), late.in_cycle) == ("b", True)
        runtime.step(1)  # back to a, where the child restarts
        assert next(runtime.tree.root.paths()) == "a/x"
        release.set()
        until(lambda: not late.in_cycle)
        assert (next(runtime.tree.root.paths()), ran) == ("a/x", [])


def test_an_automaton_that_blocks_delays_no_other() -> None:
    release = threading.Event()
    free = automaton(2, "free", [State(id=1, name="x")], period=0.01)
    stuck = automaton(3, "stuck", [State(id=1, name="x", code=lambda: release.wait(FOREVER))], period=0.01)
    root = automaton(1, "root", [State(id=1, name="a", children=(stuck, free))], period=0.01)
    with running(root, limits=PATIENT) as runtime:
        run = runtime.tree.actor(2)
        assert run is not None
        until(lambda: run.cycle.count > 20)
        release.set()


def test_what_was_left_for_good_is_not_left_again_by_who_had_not_woken_it_since() -> None:
    order: list[str] = []
    known, crossing = threading.Event(), threading.Event()

    def cross() -> None:
        if "lowest leaves" in order:
            crossing.set()
            until(lambda: not runtime.actor(2).active)

    lowest = automaton(3, "lowest", [State(id=1, name="x", exit=lambda: order.append("lowest leaves"))])
    middle = automaton(
        2,
        "middle",
        [State(id=1, name="below", children=(lowest,), restart=True), State(id=2, name="apart")],
        [when(lambda: True, 1, 2), when(known.is_set, 2, 1, code=cross)],
        period=0.02,
    )
    root = automaton(
        1,
        "root",
        [State(id=1, name="a", children=(middle,), restart=True), State(id=2, name="b")],
        [when(crossing.is_set, 1, 2)],
        period=0.02,
    )
    with running(root, limits=PATIENT) as runtime:
        known.set()  # not before: the automata may be faster than this thread, and `cross` needs the runtime
        until(lambda: next(runtime.tree.root.paths()) == "b")
    assert order == ["lowest leaves"]
