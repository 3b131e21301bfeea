"""Code that sleeps or waits lets the other automata run, as on threads: the same states, at the times of the cycles."""

from __future__ import annotations

import gc
from collections.abc import Callable
from contextlib import suppress
from typing import Any
from weakref import ref

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State, VirtualRun
from hfsm_runtime.virtual import Execution, PacedClock, PacedExecution, VirtualWorld
from tests.support.automata import after, automaton, component, when
from tests.support.gripper import GripperPrx

Code = Callable[[Execution], None]


def sleeps(seconds: float) -> Code:
    return lambda run: run.component.sleep(seconds)


def blocks(seconds: float) -> Code:
    """As `time.sleep` does, which no end of a cycle cuts short."""
    return lambda run: run.clock.sleep(seconds)


class Under:
    """A parent that changes its state every 450 ms, and a child whose code sleeps."""

    def __init__(self, code: Code, **options: Any) -> None:
        self.done: list[tuple[str, float]] = []

        def work() -> None:
            self.done.append(("begins", self.run.time))
            try:
                code(self.run)
                self.done.append(("goes on", self.run.time))
            finally:
                self.done.append(("ends", self.run.time))

        child = automaton(2, "child", [State(id=1, name="c", code=work)], [])
        states = [State(id=1, name="a", children=(child,)), State(id=2, name="b")]
        parent = automaton(1, "parent", states, [after(0.45, 1, 2), after(0.45, 2, 1)])
        self.run = Execution(component(parent), **options)

    def __enter__(self) -> Under:
        return self

    def __exit__(self, *_: object) -> None:
        self.run.close()


def test_a_child_that_sleeps_does_not_keep_its_parent_from_leaving() -> None:
    with Under(sleeps(5.0)) as under:
        under.run.advance(1.3)
        assert under.run.changes("parent") == [(0.0, "a"), (0.5, "b"), (1.0, "a")]
        assert under.done == [("begins", 0.0), ("ends", 0.5), ("begins", 1.0)]
        assert under.run.errors == ()


def test_code_that_blocks_is_waited_for_and_reported_as_on_threads() -> None:
    with Under(blocks(0.8)) as under:
        under.run.advance(1.0)
        assert under.run.changes("parent") == [(0.0, "a"), (0.5, "b")]
        assert under.done == [("begins", 0.0), ("goes on", 0.8), ("ends", 0.8)]
        assert under.run.errors == ()
    with Under(blocks(5.0), on_error="continue") as under:
        under.run.advance(2.5)
        (error,) = under.run.errors
        assert error.message == (
            "still in a cycle 1 s after parent left the state a: "
            "its code must not block, and others drive the robot with it until it ends"
        )
        assert under.run.changes("parent")[:2] == [(0.0, "a"), (0.5, "b")]


def test_a_parent_that_sleeps_does_not_hold_up_its_children() -> None:
    child = automaton(
        2, "child", [State(id=1, name="c"), State(id=2, name="d")], [after(0.2, 1, 2), after(0.2, 2, 1)]
    )
    woke: list[float] = []

    def nap() -> None:
        run.component.sleep(0.73)
        woke.append(run.time)

    parent = automaton(1, "parent", [State(id=1, name="a", code=nap, children=(child,))], [])
    with Execution(component(parent)) as run:
        run.advance(1.0)
        assert [time for time, _ in run.changes("child")] == [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
        assert woke == [0.73]
        assert run.tree.root.cycle.overruns == 1


def test_who_comes_after_a_decision_that_takes_long_waits_for_it_but_not_for_ever() -> None:
    """A guard of the parent sleeps: its child waits for 0.1 s, as on threads, and runs then."""
    cycles: list[float] = []
    child = automaton(2, "child", [State(id=1, name="c", code=lambda: cycles.append(run.clock.now()))], [])

    def decides() -> bool:
        run.component.sleep(lasts)
        return False

    parent = automaton(1, "parent", [State(id=1, name="a", children=(child,)), State(id=2, name="b")],
                       [when(decides, 1, 2)])  # fmt: skip
    lasts = 0.03
    with Execution(component(parent)) as run:
        run.advance(0.2)
        assert cycles == [0.03, 0.13]
    cycles.clear()
    lasts = 0.35
    with Execution(component(parent)) as run:
        run.advance(0.33)
        assert cycles == [0.1, 0.2, 0.3]


def test_others_run_as_usual_while_one_waits_for_a_decision() -> None:
    def decides() -> bool:
        run.component.sleep(0.35)
        return False

    beside: list[float] = []
    waiting = automaton(4, "waiting", [State(id=1, name="w")], [])
    slow = automaton(2, "slow", [State(id=1, name="s", children=(waiting,)), State(id=2, name="t")],
                     [when(decides, 1, 2)])  # fmt: skip
    calm = automaton(3, "calm", [State(id=1, name="c", code=lambda: beside.append(run.time))], [], 0.05)
    root = automaton(1, "root", [State(id=1, name="a", children=(slow, calm))], [])
    with Execution(component(root)) as run:
        run.advance(0.5)
        assert beside == pytest.approx([0.05 * number for number in range(11)])


def test_who_wakes_after_an_entry_that_sleeps_begins_at_once() -> None:
    """The child's slot at 0.05 s has come when the entry ends at 0.06 s: as on threads, it is not left out."""
    cycles: list[float] = []
    child = automaton(
        2, "child", [State(id=1, name="c", code=lambda: cycles.append(run.clock.now()))], [], 0.05
    )
    entry = State(id=1, name="a", entry=lambda: run.component.sleep(0.06), children=(child,))
    with Execution(component(automaton(1, "parent", [entry], []))) as run:
        run.advance(0.2)
        assert cycles == [0.06, 0.1, 0.15, 0.2]


def test_at_one_time_cycles_begin_before_code_goes_on() -> None:
    """The parent leaves at the time at which the sleep ends: it comes first, as on threads, where sleeps are late."""
    with Under(sleeps(0.5)) as under:
        under.run.advance(0.5)
        assert under.done == [("begins", 0.0), ("ends", 0.5)]


def test_a_sleep_of_no_time_is_none() -> None:
    with Under(sleeps(0.0)) as under:
        under.run.advance(0.0)
        assert under.done == [("begins", 0.0), ("goes on", 0.0), ("ends", 0.0)]


def test_a_pause_and_the_end_cut_a_sleep() -> None:
    with Under(sleeps(5.0)) as under:
        under.run.advance(0.2)
        under.run.pause()
        under.run.advance(1.0)
        assert under.done == [("begins", 0.0), ("ends", 0.2)]
        under.run.resume()
        under.run.advance(0.2)
        assert [what for what, _ in under.done[2:]] == ["begins"]
        under.run.request_stop()
        under.run.advance(1.0)
        assert under.done[3:] == [("ends", 0.2 + 0.2)]


def test_a_reload_cuts_a_sleep() -> None:
    with Under(sleeps(5.0)) as under:
        under.run.advance(0.2)
        other = automaton(1, "parent", [State(id=1, name="a"), State(id=2, name="c")], [after(0.6, 1, 2)])
        under.run.exchange(component(other))
        assert under.done == [("begins", 0.0), ("ends", 0.2)]
        under.run.advance(1.0)
        assert under.run.changes("parent") == [(0.0, "a"), (0.6, "c")]


def test_time_that_passes_by_itself_is_no_other_time() -> None:
    naps: list[float] = []

    def nap() -> None:
        naps.append(run.time)
        run.component.sleep(500.0)

    child = automaton(2, "child", [State(id=1, name="c", code=nap)], [])
    states = [State(id=1, name="a", children=(child,)), State(id=2, name="b")]
    parent = automaton(1, "parent", states, [after(0.45, 1, 2), after(0.45, 2, 1)])
    with PacedExecution(component(parent), VirtualWorld(PacedClock())) as run:
        run.set_speed(100.0)
        run.start()
        run.advance(4.0)
        run.pause()
        assert run.changes("parent")[:4] == [(0.0, "a"), (0.5, "b"), (1.0, "a"), (1.5, "b")]
        assert naps[:3] == [0.0, 1.0, 2.0]


def test_the_end_of_an_execution_ends_what_sleeps() -> None:
    with Under(blocks(60.0)) as under:
        under.run.advance(0.2)
    assert under.done == [("begins", 0.0), ("ends", 0.2)]


def test_the_end_of_the_component_ends_what_sleeps() -> None:
    final = State(id=2, name="over", final=True)
    ended: list[float] = []

    def work() -> None:
        try:
            run.component.sleep(60.0)
        finally:
            ended.append(run.time)

    child = automaton(2, "child", [State(id=1, name="c", code=work)], [])
    root = automaton(1, "root", [State(id=1, name="a"), State(id=3, name="x", children=(child,)), final],
                     [after(0.1, 1, 3), after(0.4, 3, 2)])  # fmt: skip
    with Execution(component(root)) as run:
        run.advance(2.0)
        assert run.finished
        assert ended == [0.5]


def test_code_that_goes_on_although_it_is_to_end_hangs_nothing() -> None:
    def refuses(run: Execution) -> None:
        while True:
            try:
                run.component.sleep(1.0)
            except BaseException:  # noqa: BLE001 - code of others
                told.append(run.time)

    told: list[float] = []
    with Under(refuses, on_error="continue") as under:
        under.run.advance(2.0)
        assert under.run.changes("parent")[:2] == [(0.0, "a"), (0.5, "b")]
        assert "still in a cycle 1 s after" in under.run.errors[0].message
        assert told[0] == 0.5


def test_code_that_goes_on_although_the_component_has_ended_is_left_where_it_waits() -> None:
    def refuses(run: Execution) -> None:
        while True:
            with suppress(BaseException):
                run.component.sleep(0.1)
            told.append(run.time)

    told: list[float] = []
    with Under(refuses, on_error="stop") as under:
        under.run.advance(0.2)
        under.run.request_stop()
        under.run.advance(2.0)
        assert told
        assert max(told) < 0.3


def test_a_servant_that_takes_long_holds_up_only_who_calls_it() -> None:
    def close(force: float) -> float:
        run.clock.sleep(0.35)
        return force

    beside = automaton(
        2, "beside", [State(id=1, name="c"), State(id=2, name="d")], [after(0.1, 1, 2), after(0.1, 2, 1)]
    )

    class Grasps(Component):
        Hand = Proxy("Hand", GripperPrx)

        def automaton(self) -> Automaton:
            return automaton(
                1,
                "grasps",
                [State(id=1, name="a", code=lambda: self.Hand.close(1.0), children=(beside,))],
                [],
            )

    with Execution(Grasps(), stubs={"Hand": {"close": close}}) as run:
        run.advance(0.5)
        assert [time for time, _ in run.changes("beside")] == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
        assert [call.time for call in run.calls("Hand.close")] == [0.35]


def test_every_run_is_the_same() -> None:
    def seen() -> object:
        with Under(sleeps(0.13)) as under:
            under.run.advance(3.0)
            return list(under.run.trace), under.done

    assert seen() == seen()


@pytest.mark.parametrize("code", [sleeps(0.1), sleeps(5.0), blocks(5.0)], ids=["rests", "sleeps", "waits"])
def test_what_is_closed_is_no_longer_in_memory(code: Code) -> None:
    with Under(code) as under:
        under.run.advance(1.0)
        component = ref(under.run.component)
    del under
    gc.collect()
    assert component() is None


def test_what_was_never_closed_is_no_longer_in_memory_either() -> None:
    run = VirtualRun(component(automaton(1, "a", [State(id=1, name="s")], [])))
    run.advance(1.0)
    left = ref(run)
    del run
    gc.collect()
    assert left() is None
