"""An execution whose time passes by itself: its speed, pauses and steps, and code that does not end."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import pytest

from hfsm_runtime import Automaton, Component, State
from hfsm_runtime._limits import RuntimeLimits
from hfsm_runtime.errors import ReloadRefusedError, ValueTypeError, VariablesError
from hfsm_runtime.tree import Actor
from hfsm_runtime.virtual import BehaviorFailed, PacedClock, PacedExecution, VirtualWorld
from interfaces.hfsm import ComponentStatus
from interfaces.jderobot import CommandRefusedException
from tests.support.automata import after, automaton, component, when
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.running import running
from tests.support.waiting import until
from zenoh_ice import CommunicatorDestroyedException


def two_states(seconds: float, code: Callable[[], object] | None = None, period: float = 0.1) -> Automaton:
    """Return an automaton that leaves its first state after a time."""
    states = [State(id=1, name="a", code=code), State(id=2, name="b")]
    return automaton(1, "root", states, [after(seconds, 1, 2)], period)


def made(root: Automaton | Callable[[Component], Automaton], **options: Any) -> PacedExecution:
    return PacedExecution(component(root), VirtualWorld(PacedClock()), **options)


@contextmanager
def paced(root: Automaton | Callable[[Component], Automaton], **options: Any) -> Iterator[PacedExecution]:
    """Let an execution's time pass in a `with` block."""
    with made(root, **options) as run:
        run.start()
        yield run


class Hanging:
    """Code that hangs until it is released."""

    def __init__(self) -> None:
        self.began = threading.Event()
        self.released = threading.Event()

    def __call__(self) -> None:
        self.began.set()
        self.released.wait(FOREVER)


@pytest.fixture
def hanging() -> Iterator[Hanging]:
    code = Hanging()
    yield code
    code.released.set()


def test_time_passes_as_fast_as_it_is_set() -> None:
    with paced(two_states(1000.0)) as run:
        assert run.speed == 1.0
        run.set_speed(100.0)
        began = time.monotonic()
        until(lambda: run.time > 20.0)
        assert time.monotonic() - began >= 0.19
        assert run.state("root") == "a"


def test_no_cycle_is_left_out_however_fast_it_runs() -> None:
    times: list[float] = []
    with made(lambda c: two_states(1000.0, lambda: times.append(c.clock.now()))) as run:
        run.set_speed(100.0)
        run.start()
        until(lambda: len(times) > 100)
    assert times == pytest.approx([0.1 * number for number in range(len(times))])


def test_who_waits_for_its_time_waits_while_it_passes() -> None:
    entered: list[float] = []

    def timed(c: Component) -> Automaton:
        states = [State(id=1, name="a"), State(id=2, name="b", code=lambda: entered.append(c.clock.now()))]
        return automaton(1, "root", states, [after(2.0, 1, 2)], 0.1)

    with paced(timed) as run:
        run.set_speed(50.0)
        assert run.run_until("b") >= 2.0  # how much later depends on how busy the machine is
        until(lambda: len(entered) > 0)
        assert entered[0] == pytest.approx(2.0)
        before = run.clock.now()
        run.clock.sleep(3.0)
        assert run.clock.now() >= before + 3.0


def test_in_a_pause_all_time_stands_still_and_a_step_moves_it_by_a_period() -> None:
    with paced(two_states(1000.0)) as run:
        run.pause()
        assert run.status is ComponentStatus.Paused
        run.set_speed(100.0)
        now, clock, cycles = run.time, run.clock.now(), run.tree.root.cycle.count
        time.sleep(0.02)
        assert (run.time, run.clock.now(), run.tree.root.cycle.count) == (now, clock, cycles)
        run.step(0)
        assert run.tree.root.cycle.count == cycles + 1
        assert [run.time, run.clock.now()] == pytest.approx([now + 0.1, clock + 0.1])
        run.resume()
        assert run.clock.rate == 100.0
        until(lambda: run.tree.root.cycle.count > cycles + 10)


def test_a_pause_leaves_no_cycle_out() -> None:
    times: list[float] = []
    with made(lambda c: two_states(1000.0, lambda: times.append(c.clock.now()))) as run:
        run.start()
        for _ in range(30):
            run.pause()
            run.resume()
            time.sleep(0.005)
        run.set_speed(100.0)
        until(lambda: len(times) > 50)
    assert [after - before for before, after in pairwise(times)] == pytest.approx([0.1] * (len(times) - 1))


def test_code_that_sleeps_sleeps_by_its_time_and_is_cut_by_a_pause() -> None:
    slept: list[float] = []

    def sleeping(c: Component) -> Automaton:
        def sleep() -> None:
            began = c.clock.now()
            c.sleep(5.0)
            slept.append(c.clock.now() - began)

        return two_states(1000.0, sleep)

    with paced(sleeping) as run:
        run.pause()
        until(lambda: not run.in_cycle)
        assert slept == []
        run.set_speed(100.0)
        run.resume()
        until(lambda: len(slept) > 0)
        assert slept[0] == pytest.approx(5.0)


def test_code_that_waits_ends_with_the_component() -> None:
    with paced(lambda c: two_states(1000.0, lambda: c.sleep(1e6))) as run:
        until(lambda: run.in_cycle)
        run.stop()
        assert not run.in_cycle
        with pytest.raises(CommunicatorDestroyedException):
            run.clock.sleep(1.0)


@pytest.mark.slow
def test_code_that_hangs_keeps_nobody_from_looking_and_is_abandoned(
    hanging: Hanging, caplog: pytest.LogCaptureFixture
) -> None:
    limits = RuntimeLimits(gap=0.05, hangs=0.05, stop=0.05)
    with paced(two_states(1000.0, hanging, period=0.005), limits=limits) as run:
        assert hanging.began.wait(EVENT_LIMIT)
        run.pause()
        run.resume()
        run.set_speed(2.0)
        with pytest.raises(ReloadRefusedError, match="its code must not block"):
            run.exchange(component(two_states(1.0)))
        until(lambda: run.hanging(run.tree.root)[0] > 0.05)
        run.stop()
    assert "did not end within 0.05 s and is abandoned" in caplog.text


def test_a_refused_command_pauses_it_and_is_tried_again_after_a_second_of_its_clock() -> None:
    refused = threading.Event()
    refused.set()

    def command() -> None:
        if refused.is_set():
            raise CommandRefusedException("stopped", "")

    with made(two_states(1000.0, command)) as run:
        run.set_speed(20.0)
        run.start()
        until(lambda: run.refusal is not None)
        assert (run.status, run.time) == (ComponentStatus.Paused, 0.0)
        refused.clear()
        until(lambda: run.time > 0.0)
        assert run.refusal is None
        assert run.clock.now() > 1.0


def test_its_end_is_that_of_its_root() -> None:
    states = [State(id=1, name="a"), State(id=2, name="b", final=True)]
    with paced(automaton(1, "root", states, [after(0.1, 1, 2)])) as run:
        assert run.ended.wait(EVENT_LIMIT)
        assert (run.finished, run.exit_code, run.status) == (True, 0, ComponentStatus.Halted)


def test_sys_exit_ends_it_with_its_code() -> None:
    def leave() -> None:
        raise SystemExit(3)

    with paced(two_states(1000.0, leave)) as run:
        assert run.ended.wait(EVENT_LIMIT)
        assert run.exit_code == 3
        assert "sys.exit(3)" in run.errors[-1].message


def test_an_error_ends_it_and_is_raised_where_its_time_is_waited_for() -> None:
    def fail() -> None:
        raise ValueError("no luck")

    with paced(two_states(1000.0, fail)) as run, pytest.raises(BehaviorFailed, match="no luck"):
        run.advance(1e6)
    assert run.halted


def test_it_continues_in_another_version() -> None:
    with paced(two_states(1000.0)) as run:
        until(lambda: run.tree.root.cycle.count > 1)
        run.exchange(component(automaton(1, "root", [State(id=1, name="z")], [when(lambda: False, 1, 1)])))
        assert run.state("root") == "z"
        cycles = run.tree.root.cycle.count
        until(lambda: run.tree.root.cycle.count > cycles)


@pytest.mark.parametrize("speed", [0.0, -1.0, 101.0, math.inf, math.nan])
def test_what_is_no_speed_is_refused(speed: float) -> None:
    with made(two_states(1.0)) as run:
        with pytest.raises(ValueTypeError, match="at most 100"):
            run.set_speed(speed)
        assert run.clock.rate == run.speed == 1.0


def test_the_time_of_a_run_with_a_robot_is_not_changed() -> None:
    with running(two_states(1.0)) as runtime, pytest.raises(ValueTypeError, match="is no dry run"):
        runtime.set_speed(2.0)


def test_one_that_cannot_be_made_says_why_and_closes_its_world() -> None:
    def fail(_: Component) -> Automaton:
        raise KeyError("speed")

    world = VirtualWorld(PacedClock())
    with pytest.raises(VariablesError, match="'speed'"):
        PacedExecution(component(fail), world)
    assert world.communicator.destroyed


def test_a_reload_right_after_a_cycle_doubles_none() -> None:
    times: list[float] = []

    def root(c: Component) -> Automaton:
        return two_states(1000.0, lambda: times.append(c.clock.now()))

    class Late(PacedExecution):
        """An execution that is reloaded by another thread between a cycle and what comes after it."""

        def run_cycle(self, run: Actor, at: int) -> None:
            super().run_cycle(run, at)
            if len(times) == 3 and not self.reloads:
                reload = threading.Thread(target=self.exchange, args=(component(root),))
                reload.start()
                reload.join(EVENT_LIMIT)

    with Late(component(root), VirtualWorld(PacedClock())) as run:
        run.set_speed(10.0)
        run.start()
        until(lambda: len(times) > 8)
    assert run.reloads == 1
    assert times == pytest.approx([0.1 * number for number in range(len(times))])


@pytest.mark.slow
def test_who_waits_for_a_state_waits_while_a_refused_command_pauses_it() -> None:
    def refuse() -> None:
        raise CommandRefusedException("stopped")

    looks: list[float] = []
    with paced(two_states(0.5, refuse)) as run:
        run.set_speed(10.0)
        with pytest.raises(BehaviorFailed, match="3 s"):
            run.run_until(lambda: looks.append(run.time), limit=3.0)
    assert len(looks) < 1000


def test_calls_are_read_while_it_makes_more() -> None:
    with made(two_states(1000.0)) as run:
        journal = run.world.journal

        class Target(str):
            def partition(self, separator: str, /) -> tuple[str, str, str]:  # while the calls are read
                journal.called("Hand.open", {}, None, None)
                return super().partition(separator)

        for _ in range(2):
            journal.called(Target("Hand.close"), {}, None, None)
        assert [call.target for call in run.calls("Hand")] == ["Hand.close", "Hand.close"]
        assert len(run.calls()) == 4
