"""What clients may do to a component, on threads and in virtual time alike."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from hfsm_runtime import Automaton, Component, Parameter, State
from hfsm_runtime._component_run import ComponentRun
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.debugger._breakpoints import Breakpoints
from hfsm_runtime.debugger.reload import Reloading
from hfsm_runtime.debugger.snapshot import structure_of, take_snapshot
from hfsm_runtime.errors import EventError, ReloadRefusedError, UnknownElementError, ValueTypeError
from hfsm_runtime.virtual import PacedClock, PacedExecution, VirtualWorld
from interfaces.hfsm import Breakpoint, ComponentStatus
from tests.support.automata import automaton, on, when
from tests.support.waiting import until
from zenoh_ice import WallClock


class Counts(Component, document="counts.xml"):
    step = Parameter(1)

    def automaton(self) -> Automaton:
        count = 0

        def add() -> None:
            nonlocal count
            count += self.step

        states = [State(id=1, name="counts", code=add), State(id=2, name="rests"), State(id=3, name="ends")]
        transitions = [
            on("rest", 1, 2, name="tired"),
            when(lambda: count < 0, 2, 1, name="again"),
            when(lambda: False, 2, 3, name="end"),
        ]
        return automaton(1, "counts", states, transitions, period=0.02)


Make = Callable[[], ComponentRun]


@pytest.fixture(params=["threads", "virtual time"])
def make(request: pytest.FixtureRequest) -> Iterator[Make]:
    with ExitStack() as stack:

        def made() -> ComponentRun:
            if request.param == "threads":
                run: ComponentRun = Runtime(Counts(), WallClock())
                stack.callback(run.stop)
            else:
                run = stack.enter_context(PacedExecution(Counts(), VirtualWorld(PacedClock())))
            return run

        yield made


@pytest.fixture
def run(make: Make) -> ComponentRun:
    started = make()
    started.start()
    return started


def state(run: ComponentRun) -> str:
    return run.tree.root.current.name


def test_a_pause_holds_it_and_a_step_runs_one_cycle(run: ComponentRun) -> None:
    until(lambda: run.tree.root.cycle.count > 0)
    run.pause()
    until(lambda: not run.in_cycle)
    cycles, now = run.tree.root.cycle.count, run.component_time.now()
    run.step(0)
    assert (run.tree.root.cycle.count, run.component_time.now()) == (cycles + 1, now + 20_000_000)
    assert run.status is ComponentStatus.Paused
    run.resume()
    until(lambda: run.tree.root.cycle.count > cycles + 2)


def test_an_event_a_variable_and_a_forced_transition(run: ComponentRun) -> None:
    run.send("rest")
    until(lambda: state(run) == "rests")
    run.set_variable(1, "count", -5)
    until(lambda: state(run) == "counts")
    run.set_variable(1, "count", 0)
    run.set_variable(0, "step", 2)
    assert run.component.step == 2  # type: ignore[attr-defined]
    run.send("rest")
    until(lambda: state(run) == "rests")
    run.force(1, run.tree.root.automaton.transitions[2].id)
    until(lambda: state(run) == "ends")


def test_what_it_does_not_have_is_refused(run: ComponentRun) -> None:
    unknown: list[Callable[[], object]] = [
        lambda: run.force(1, 1234567),
        lambda: run.force(1, run.tree.root.automaton.transitions[1].id),  # it leaves another state
        lambda: run.force(2, 1),
        lambda: run.set_variable(1, "counter", 1),
        lambda: run.set_variable(0, "steps", 1),
        lambda: run.step(7),
    ]
    for request in unknown:
        with pytest.raises(UnknownElementError):
            request()
    with pytest.raises(ValueTypeError):
        run.set_variable(0, "step", "many")
    with pytest.raises(EventError):
        run.send("")


def test_a_breakpoint_pauses_it_and_a_snapshot_shows_it(make: Make) -> None:
    run = make()
    points = Breakpoints(run)
    points.set([Breakpoint(1, 2, 0, "count > 3")])
    run.start()
    until(lambda: run.tree.root.cycle.count > 5)
    run.send("rest")
    until(lambda: run.status is ComponentStatus.Paused)
    snapshot = take_snapshot(run, 0.0, points)
    assert [point.state for point in snapshot.stoppedAt] == [2]
    assert snapshot.automata[0].state == 2
    assert structure_of(run).name == "counts"


def test_it_begins_where_it_is_to_begin(make: Make) -> None:
    run = make()
    run.begin_at(1, 3)
    run.start()
    until(lambda: run.tree.root.cycle.count > 0)
    assert state(run) == "ends"


def test_it_continues_in_another_version_until_it_has_ended(run: ComponentRun) -> None:
    reloading = Reloading(run, lambda _component: None)
    run.send("rest")
    until(lambda: state(run) == "rests")
    assert reloading.exchange(Counts()).notKept == []
    assert (state(run), run.reloads) == ("rests", 1)
    run.request_stop()
    assert run.status is ComponentStatus.Halted
    with pytest.raises(ReloadRefusedError, match="has ended"):
        reloading.exchange(Counts())
