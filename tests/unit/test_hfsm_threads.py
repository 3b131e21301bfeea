"""Components on threads and a real clock: hand-over, pausing, stepping, ending."""

from __future__ import annotations

import random
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest

from hfsm_runtime import Automaton, Component, State
from hfsm_runtime.runtime import Runtime, Status, UnknownElementError
from hfsm_runtime.supervision import OnError
from tests.support.automata import after, automaton, component, when
from zenoh_ice import WallClock

LIMIT = 10.0


@contextmanager
def running(
    root: Automaton | Callable[[Component], Automaton], on_error: OnError | None = None
) -> Iterator[Runtime]:
    runtime = Runtime(component(root), WallClock(), on_error)
    runtime.start()
    try:
        yield runtime
    finally:
        runtime.stop()


def eventually(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + LIMIT
    while not condition():
        assert time.monotonic() < deadline, "it did not come true in time"
        time.sleep(0.005)


def test_cycles_keep_to_their_schedule() -> None:
    with running(automaton(1, "root", [State(id=1, name="a")], period=0.02)) as runtime:
        eventually(lambda: runtime.timeline.now() > 500_000_000)
    run = runtime.tree.root
    # Each slot is run at most once, whatever the load of the machine.
    assert 1 < run.cycles <= runtime.timeline.now() // 20_000_000 + 1


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
        below = automaton(id + 10, name, [State(id=1, name="x", code=work(name))], period=0.003)
        return automaton(id, name, [State(id=1, name="x", code=work(name), children=(below,))], period=0.005)

    root = automaton(
        1,
        "root",
        [
            State(id=1, name="left", code=arrive("left"), children=(child(2, "left"),)),
            State(id=2, name="right", code=arrive("right"), children=(child(3, "right"),)),
        ],
        [after(0.03, 1, 2), after(0.03, 2, 1)],
        period=0.01,
    )
    with running(root) as runtime:
        eventually(lambda: min(turns.values()) > 30)
    assert faults == []
    assert runtime.errors == ()


def slow_hand_over(order: list[str], release: threading.Event) -> Automaton:
    def slow() -> None:
        order.append("child begins")
        release.wait(LIMIT)
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
    with running(slow_hand_over(order, release)) as runtime:
        eventually(lambda: not runtime.tree.runs[1].active)
        assert (order, runtime.tree.root.current.name) == (["child begins"], "a")
        release.set()
        eventually(lambda: len(order) > 3)
    assert order[:4] == ["child begins", "child ends", "transition", "new state"]
    assert runtime.errors == ()


def test_a_childs_cycle_that_does_not_end_is_told_as_an_error_after_a_second() -> None:
    order: list[str] = []
    release = threading.Event()
    with running(slow_hand_over(order, release)) as runtime:
        eventually(lambda: "new state" in order)
        release.set()
    assert order[:3] == ["child begins", "transition", "new state"]
    (error,) = runtime.errors
    assert (error.automaton, error.state) == (2, 1)
    assert "still in a cycle 1 s after root left the state a" in error.message
    assert not runtime.failed


def test_a_cycle_that_became_a_ghosts_fires_no_transition_and_runs_no_further_code() -> None:
    asked, left = threading.Event(), threading.Event()
    ran: list[str] = []

    def guard() -> bool:
        asked.set()
        left.wait(LIMIT)
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
    with running(root) as runtime:
        eventually(lambda: runtime.tree.root.current.name == "b")
        left.set()
        eventually(lambda: not runtime.tree.runs[1].in_cycle)
    assert runtime.tree.runs[1].current.name == "x"
    assert ran == []


def test_paused_nothing_runs_and_timers_stand_still() -> None:
    ran: list[float] = []
    root = automaton(
        1,
        "root",
        [State(id=1, name="a", code=lambda: ran.append(time.monotonic())), State(id=2, name="b")],
        [after(0.3, 1, 2)],
        period=0.02,
    )
    with running(root) as runtime:
        eventually(lambda: len(ran) >= 2)
        runtime.pause()
        assert runtime.status == "paused"
        eventually(lambda: not runtime.tree.root.in_cycle)
        count, now = len(ran), runtime.timeline.now()
        time.sleep(0.5)  # longer than the timer
        assert (len(ran), runtime.timeline.now()) == (count, now)
        runtime.resume()
        assert runtime.status == "running"
        eventually(lambda: runtime.tree.root.current.name == "b")
    entered = runtime.tree.root.entered
    assert entered is not None
    assert entered >= 300_000_000
    assert entered % 20_000_000 == 0


def test_a_step_runs_one_cycle_and_moves_time_on_by_one_period() -> None:
    ran: list[str] = []
    child = automaton(2, "child", [State(id=1, name="x", code=lambda: ran.append("child"))], period=0.02)
    root = automaton(
        1,
        "root",
        [
            State(id=1, name="a", code=lambda: ran.append("root"), children=(child,)),
            State(id=2, name="b"),
        ],
        [after(30, 1, 2)],
        period=0.03,
    )
    with running(root) as runtime:
        runtime.pause()
        eventually(lambda: not any(run.in_cycle for run in runtime.tree.runs))
        ran.clear()
        now = runtime.timeline.now()
        runtime.step(2)
        assert ran == ["child"]
        assert runtime.timeline.now() - now == 20_000_000
        runtime.step(0)
        assert ran == ["child", "root", "child"]
        assert runtime.timeline.now() - now == 40_000_000
        for _ in range(1510):
            runtime.step(0)
        assert runtime.tree.root.current.name == "b"


def test_a_step_while_it_runs_does_nothing() -> None:
    with running(automaton(1, "root", [State(id=1, name="a")], period=60)) as runtime:
        eventually(lambda: runtime.tree.root.cycles == 1)
        runtime.step(0)
    assert runtime.tree.root.cycles == 1


def test_a_component_that_is_to_end_makes_no_further_step() -> None:
    ran = threading.Event()
    root = automaton(1, "root", [State(id=1, name="a", initial=True, code=ran.set)])
    with running(root) as runtime:
        assert ran.wait(LIMIT)
        runtime.pause()
        eventually(lambda: not runtime.in_cycle)
        ran.clear()
        runtime.request_stop()
        runtime.step(0)
        assert not ran.is_set()


def test_a_transition_is_forced_whatever_its_guard_says() -> None:
    root = automaton(
        1,
        "root",
        [State(id=1, name="a"), State(id=2, name="b")],
        [when(lambda: False, 1, 2), when(lambda: False, 2, 1)],
        period=0.02,
    )
    forth, back = root.transitions
    with running(root) as runtime:
        with pytest.raises(UnknownElementError, match="leaves the state 'b'"):
            runtime.force(1, back.id)
        runtime.force(1, forth.id)
        eventually(lambda: runtime.tree.root.current.name == "b")
        assert runtime.tree.root.last_transition == forth.id
        with pytest.raises(UnknownElementError, match="no transition 999999"):
            runtime.force(1, 999999)
        with pytest.raises(UnknownElementError, match="no automaton 7: there are 1"):
            runtime.force(7, forth.id)
        with pytest.raises(UnknownElementError, match="no automaton 7"):
            runtime.step(7)


def test_stopping_ends_a_sleep_of_user_code_even_one_that_catches_exceptions() -> None:
    sleeping = threading.Event()
    after_sleep: list[str] = []

    def root(c: Component) -> Automaton:
        def code() -> None:
            sleeping.set()
            with suppress(Exception):
                c.sleep(3600)
            after_sleep.append("went on")

        return automaton(1, "root", [State(id=1, name="a", code=code)])

    with running(root) as runtime:
        assert sleeping.wait(LIMIT)
        began = time.monotonic()
        runtime.stop()
        assert time.monotonic() - began < 2
    assert after_sleep == []
    assert runtime.status is Status.HALTED
    assert not runtime.failed


def test_an_exception_halts_all_automata() -> None:
    child = automaton(2, "child", [State(id=1, name="x", code=lambda: 1 / 0)], period=0.02)
    root = automaton(1, "root", [State(id=1, name="a", children=(child,))], period=0.02)
    with running(root) as runtime:
        assert runtime.ended.wait(LIMIT)
        assert runtime.failed
        assert runtime.status is Status.HALTED
        eventually(lambda: not any(run.in_cycle for run in runtime.tree.runs))
        cycles = [run.cycles for run in runtime.tree.runs]
        time.sleep(0.1)
        assert [run.cycles for run in runtime.tree.runs] == cycles


@pytest.mark.parametrize(("code", "failed"), [(0, False), (3, True), (None, False)])
def test_user_code_may_end_the_component(code: int | None, failed: bool) -> None:
    root = automaton(1, "root", [State(id=1, name="a", code=lambda: sys.exit(code))])
    with running(root) as runtime:
        assert runtime.ended.wait(LIMIT)
    assert runtime.failed is failed


def test_a_component_that_halts_stays_halted() -> None:
    with running(automaton(1, "root", [State(id=1, name="a")], period=0.02)) as runtime:
        runtime.request_stop()
        runtime.resume()
        eventually(lambda: not runtime.tree.root.in_cycle)
        cycles = runtime.tree.root.cycles
        time.sleep(0.1)
        assert runtime.tree.root.cycles == cycles
