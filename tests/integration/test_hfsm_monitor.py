"""The monitor of a running component, over the wire."""

from __future__ import annotations

import logging
import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest

from hfsm_runtime import Automaton, Component, Parameter, State, Transition
from hfsm_runtime._limits import LIMITS, RuntimeLimits
from hfsm_runtime._recording.recorder import CodeLock
from hfsm_runtime._recording.run import MONITOR, RecordedRuntime, recording
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.debugger.monitor import Monitor
from interfaces.hfsm import (
    Breakpoint,
    ComponentSnapshot,
    ComponentStatus,
    HfsmMonitorPrx,
    InvalidValue,
    Mark,
    NoSuchElement,
    ReloadRefused,
    TransitionKind,
)
from tests.support.automata import component
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import UnknownException, WallClock


def first_snapshot(
    proxy: HfsmMonitorPrx, condition: Callable[[ComponentSnapshot], bool]
) -> ComponentSnapshot:
    """Return the first snapshot of the stream that meets a condition."""
    deadline = time.monotonic() + EVENT_LIMIT
    for sample in proxy.getSnapshot.samples(timeout=EVENT_LIMIT):
        if condition(sample.value):
            return sample.value
        assert time.monotonic() < deadline, sample.value
    raise AssertionError("the stream ended")


@contextmanager
def monitored(
    pair: Pair, root: Automaton, made: Component | None = None, limits: RuntimeLimits = LIMITS
) -> Iterator[tuple[Runtime, HfsmMonitorPrx]]:
    runtime = Runtime(made or component(root), WallClock(), limits=limits)
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


def test_the_structure_is_reported(pair: Pair) -> None:
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


class WatchedLock(CodeLock):
    """The lock of recorded code, whose holder keeps it; reports who waits for it."""

    def __init__(self) -> None:
        self.overlaps: list[tuple[str, str]] = []
        self.wanted_by = SimpleQueue[str]()
        super().__init__(lambda *contexts: self.overlaps.append(contexts), FOREVER)

    def acquire(self, context: str) -> None:
        self.wanted_by.put(context)
        super().acquire(context)


def test_a_resume_that_waits_for_a_recorded_cycle_keeps_nobody_from_the_automata(
    pair: Pair, tmp_path: Path
) -> None:
    leave = threading.Event()
    state = State(id=1, name="look", initial=True, code=lambda: leave.wait(FOREVER))
    made = component(Automaton(id=1, name="walker", period=0.05, states=(state,), transitions=()))
    lock = WatchedLock()
    with recording(made, tmp_path / "run.mcap") as recorder:
        recorder.lock = lock
        runtime = RecordedRuntime(made, WallClock(), recorder)
        with Monitor(runtime, pair.server) as monitor:
            runtime.start()
            try:
                proxy = HfsmMonitorPrx.checkedCast(pair.client.stringToProxy(monitor.identity))
                assert [lock.wanted_by.get(timeout=EVENT_LIMIT) for _ in range(2)] == ["start", "automaton 1"]
                resumed = proxy.resume.begin()
                assert lock.wanted_by.get(timeout=EVENT_LIMIT) == MONITOR
                assert proxy.getSnapshot.begin().result(EVENT_LIMIT).automata[0].state == 1
                leave.set()
                resumed.result(EVENT_LIMIT)
            finally:
                leave.set()
                runtime.stop()
    assert lock.overlaps == []


def test_a_variable_whose_repr_interrupts_does_not_end_the_stream(pair: Pair) -> None:
    class Torn:
        shown = 0

        def __repr__(self) -> str:
            Torn.shown += 1
            if Torn.shown < 3:
                raise KeyboardInterrupt
            return "whole"

    value = Torn()

    def code() -> None:
        nonlocal value
        value = value

    root = Automaton("torn", id=1, period=0.02, states=(State("a", initial=True, code=code),))
    with monitored(pair, root) as (_, proxy):
        snapshot = first_snapshot(proxy, lambda _: True)
    assert snapshot.automata[0].variables == {"value": "whole"}


@pytest.mark.parametrize("error", [ValueError, SystemExit])
def test_a_log_that_fails_keeps_nobody_from_ending_the_component(
    pair: Pair, error: type[BaseException], request: pytest.FixtureRequest
) -> None:
    made = component(tree())

    def fails(record: logging.LogRecord) -> bool:
        raise error(record.msg)

    made._hfsm_log.addFilter(fails)
    request.addfinalizer(lambda: made._hfsm_log.removeFilter(fails))
    with monitored(pair, tree(), made) as (runtime, proxy):
        with pytest.raises(UnknownException):
            proxy.stop()
        until(runtime.ended.is_set)


def test_what_a_component_marks_is_in_its_snapshots(pair: Pair) -> None:
    made: list[Component] = []
    state = State(id=1, name="look", initial=True, code=lambda: made[0].mark("Camera", 12.5, 7, "ball"))
    root = Automaton(id=1, name="walker", period=0.05, states=(state,))
    made.append(component(root))
    with monitored(pair, root, made[0]) as (_, proxy):
        seen = first_snapshot(proxy, lambda snapshot: bool(snapshot.marks))
    assert seen.marks == [Mark("Camera", 12.5, 7.0, "ball")]


def test_snapshots_report_states_timers_guards_variables_and_cycles(pair: Pair) -> None:
    with monitored(pair, tree()) as (_, proxy):
        snapshot = first_snapshot(proxy, lambda snapshot: snapshot.automata[1].cycles >= 3)
    assert snapshot.status is ComponentStatus.Running
    root, child = snapshot.automata
    assert (root.state, root.ghost, child.state, child.ghost) == (1, False, 1, False)
    assert [(guard.transition, guard.value) for guard in root.guards] == [(1, False)]
    (timer,) = child.timers
    assert 3000 < timer.remaining < 3600
    assert int(child.variables["count"]) >= 3
    assert 0.0 < child.lastCycle <= child.longestCycle
    assert snapshot.errors == []


def test_a_cycle_that_does_not_end_is_reported_with_its_line_and_one_that_sleeps_is_not(
    pair: Pair,
) -> None:
    release, asleep = threading.Event(), threading.Event()

    class Walker(Component, document="walker.xml"):
        def automaton(self) -> Automaton:
            def sleeps() -> None:
                asleep.set()
                self.sleep(FOREVER)

            def hangs() -> None:
                release.wait(FOREVER)

            below = (
                Automaton(
                    id=2, name="a", period=0.02, states=(State(id=1, name="s", initial=True, code=sleeps),)
                ),
                Automaton(
                    id=3, name="b", period=0.02, states=(State(id=1, name="h", initial=True, code=hangs),)
                ),
            )
            top = State(id=1, name="both", initial=True, children=below)
            return Automaton(id=1, name="walker", period=0.02, states=(top,))

    made = Walker()
    with monitored(pair, made.automaton(), made, RuntimeLimits(hangs=0.2)) as (_, proxy):
        assert asleep.wait(EVENT_LIMIT)
        seen = first_snapshot(proxy, lambda snapshot: snapshot.automata[2].hangsFor > 0.5)
        root, sleeping, hanging = seen.automata
        assert (root.hangsFor, sleeping.hangsFor, sleeping.hangsAt) == (0, 0, "")
        assert sleeping.inCycle
        number = int(hanging.hangsAt.removeprefix("test_hfsm_monitor.py:"))
        assert Path(__file__).read_text().split("\n")[number - 1].strip() == "release.wait(FOREVER)"
        release.set()
        first_snapshot(
            proxy, lambda snapshot: snapshot.automata[2].cycles > 1 and not snapshot.automata[2].hangsFor
        )


def test_snapshots_come_each_tenth_of_a_second_and_at_every_change(pair: Pair) -> None:
    with monitored(pair, tree()) as (runtime, proxy):
        times: list[float] = []
        states: list[tuple[int, bool]] = []

        def take(snapshot: ComponentSnapshot) -> None:
            times.append(snapshot.time)
            states.append((snapshot.automata[0].state, snapshot.automata[1].ghost))

        subscription = proxy.getSnapshot.subscribe(lambda sample: take(sample.value))
        until(lambda: len(times) >= 5)
        runtime.force(1, 1)
        until(lambda: (2, True) in states)
        subscription.close()


def test_a_transition_is_forced_and_the_child_becomes_a_ghost(pair: Pair) -> None:
    with monitored(pair, tree()) as (_, proxy):
        proxy.forceTransition(1, 1)
        snapshot = first_snapshot(proxy, lambda snapshot: snapshot.automata[0].state == 2)
        assert snapshot.automata[0].lastTransition == 1
        assert snapshot.automata[1].ghost
        with pytest.raises(NoSuchElement, match="no transition 9"):
            proxy.forceTransition(1, 9)
        with pytest.raises(NoSuchElement, match="no automaton 9"):
            proxy.step(9)


def test_pause_step_and_resume(pair: Pair) -> None:
    with monitored(pair, tree()) as (runtime, proxy):
        proxy.pause()
        until(lambda: not runtime.in_cycle)
        paused = proxy.getSnapshot()
        assert paused.status is ComponentStatus.Paused
        proxy.step(2)
        stepped = proxy.getSnapshot()
        assert stepped.automata[1].cycles == paused.automata[1].cycles + 1
        assert stepped.time == pytest.approx(paused.time + 0.05)
        proxy.resume()
        first_snapshot(proxy, lambda snapshot: snapshot.automata[1].cycles > stepped.automata[1].cycles + 1)


def test_stop_ends_the_component(pair: Pair) -> None:
    with monitored(pair, tree()) as (runtime, proxy):
        proxy.stop()
        assert runtime.ended.wait(EVENT_LIMIT)
        assert first_snapshot(proxy, lambda snapshot: True).status is ComponentStatus.Halted


def test_errors_of_user_code_are_shown(pair: Pair) -> None:
    def broken() -> None:
        raise ValueError("no ball")

    root = Automaton(id=1, name="walker", states=(State(id=3, name="a", initial=True, code=broken),))
    with monitored(pair, root) as (_, proxy):
        snapshot = first_snapshot(proxy, lambda snapshot: snapshot.status is ComponentStatus.Halted)
    (error,) = snapshot.errors
    assert (error.automaton, error.state, error.message) == (1, 3, "ValueError: no ball")
    assert error.time >= 0


def counter(period: float = 0.02, **states: Any) -> Automaton:
    """Return an automaton that counts in a, goes to b on request, and counts there, too."""
    count = 0
    go = False

    def code() -> None:
        nonlocal count
        count += 1

    def guard() -> bool:
        return go

    def more() -> None:
        nonlocal count
        count += 1_000_000

    return Automaton(
        id=1,
        name="walker",
        period=period,
        states=(State(id=1, name="a", initial=True, code=code), State(id=2, name="b", code=more)),
        transitions=(
            Transition(id=1, name="go", origin=1, destination=2, guard=guard, condition="go"),
            Transition(id=2, name="back", origin=2, destination=1, event="home"),
        ),
    )  # fmt: skip


def stopped(proxy: HfsmMonitorPrx) -> ComponentSnapshot:
    return first_snapshot(proxy, lambda snapshot: bool(snapshot.stoppedAt))


def test_a_breakpoint_pauses_before_the_code_of_the_state(pair: Pair) -> None:
    with monitored(pair, counter()) as (_, proxy):
        point = Breakpoint(automaton=1, state=2, transition=0, condition="")
        proxy.setBreakpoints([point])
        assert proxy.getBreakpoints() == [point]
        proxy.setVariable(1, "go", "true")
        snapshot = stopped(proxy)
        assert snapshot.status is ComponentStatus.Paused
        assert snapshot.stoppedAt == [point]
        (automaton,) = snapshot.automata
        assert (automaton.state, automaton.lastTransition) == (2, 1)
        count = int(automaton.variables["count"])
        later = proxy.getSnapshot()
        assert later.time == snapshot.time  # it stands still
        assert int(later.automata[0].variables["count"]) == count < 1_000_000
        proxy.step(1)  # the code of b, and nothing before it
        stepped = proxy.getSnapshot()
        assert int(stepped.automata[0].variables["count"]) == count + 1_000_000
        assert stepped.stoppedAt == []
        assert stepped.status is ComponentStatus.Paused
        proxy.resume()
        first_snapshot(
            proxy, lambda snapshot: int(snapshot.automata[0].variables["count"]) > count + 2_000_000
        )


def test_a_breakpoint_at_a_transition_goes_on_where_it_stood(pair: Pair) -> None:
    with monitored(pair, counter()) as (_, proxy):
        proxy.setBreakpoints([Breakpoint(1, 0, 1, "")])
        proxy.setVariable(1, "go", "true")
        count = int(stopped(proxy).automata[0].variables["count"])
        proxy.setBreakpoints([])
        proxy.resume()
        snapshot = first_snapshot(
            proxy, lambda snapshot: int(snapshot.automata[0].variables["count"]) != count
        )
        assert (int(snapshot.automata[0].variables["count"]) - count) % 1_000_000 == 0
        assert (snapshot.status, snapshot.stoppedAt) == (ComponentStatus.Running, [])


def test_the_code_of_the_state_runs_before_transitions_are_tried_again(pair: Pair) -> None:
    ran: list[str] = []
    root = Automaton(
        id=1, name="walker", period=0.02,
        states=(
            State(id=1, name="a", initial=True),
            State(id=2, name="b", entry=lambda: ran.append("entry"), code=lambda: ran.append("code")),
        ),
        transitions=(
            Transition("", 1, 2, id=1, event="go", code=lambda event: ran.append("fired")),
            Transition("", 2, 1, id=2, guard=lambda: not ran.append("guard")),  # type: ignore[func-returns-value]
        ),
    )  # fmt: skip
    with monitored(pair, root) as (_, proxy):
        proxy.setBreakpoints([Breakpoint(1, 2, 0, "")])
        proxy.sendEvent("go", "")
        stopped(proxy)
        assert ran == ["fired", "entry"]
        proxy.step(1)
        assert ran == ["fired", "entry", "code"]
        proxy.step(1)
        assert ran == ["fired", "entry", "code", "guard"]


def test_a_breakpoint_is_reached_when_its_condition_holds(pair: Pair) -> None:
    with monitored(pair, counter()) as (_, proxy):
        proxy.setBreakpoints([Breakpoint(1, 2, 0, "count >= 1000 and not count < 0")])
        proxy.setVariable(1, "go", "true")
        first_snapshot(proxy, lambda snapshot: snapshot.automata[0].state == 2)
        proxy.setVariable(1, "go", "false")
        proxy.sendEvent("home", "")
        before = first_snapshot(proxy, lambda snapshot: snapshot.automata[0].state == 1)
        assert before.status is ComponentStatus.Running
        proxy.setVariable(1, "count", "1000")
        proxy.setVariable(1, "go", "true")
        assert int(stopped(proxy).automata[0].variables["count"]) >= 1000


def test_a_condition_without_a_value_pauses_and_says_why(pair: Pair) -> None:
    with monitored(pair, counter()) as (_, proxy):
        proxy.setBreakpoints([Breakpoint(1, 2, 0, "count / 0 > 1")])
        proxy.setVariable(1, "go", "true")
        snapshot = stopped(proxy)
        assert "column 1" in snapshot.errors[-1].message
        assert "zero" in snapshot.errors[-1].message


def test_a_forced_transition_reaches_a_breakpoint(pair: Pair) -> None:
    with monitored(pair, tree()) as (_, proxy):
        proxy.setBreakpoints([Breakpoint(1, 2, 0, "")])
        proxy.forceTransition(1, 1)
        assert stopped(proxy).automata[1].ghost


def test_an_automaton_that_wakes_for_the_first_time_reaches_a_breakpoint_at_its_initial_state(
    pair: Pair,
) -> None:
    child = counter()
    root = Automaton(
        id=2, name="root", period=0.02,
        states=(State(id=1, name="idle", initial=True), State(id=2, name="busy", children=(child,))),
        transitions=(Transition("", 1, 2, id=1, event="go"),),
    )  # fmt: skip
    with monitored(pair, root) as (_, proxy):
        proxy.setBreakpoints([Breakpoint(1, 1, 0, "")])
        proxy.sendEvent("go", "")
        snapshot = stopped(proxy)
        assert snapshot.stoppedAt == [Breakpoint(1, 1, 0, "")]
        assert snapshot.automata[1].variables["count"] == "0"


@pytest.mark.parametrize(
    ("point", "error", "reason"),
    [
        ((9, 1, 0, ""), NoSuchElement, "no automaton 9"),
        ((1, 9, 0, ""), NoSuchElement, "no state 9"),
        ((1, 0, 9, ""), NoSuchElement, "no transition 9"),
        ((1, 0, 0, ""), InvalidValue, "one of the two is 0"),
        ((1, 1, 1, ""), InvalidValue, "one of the two is 0"),
        ((1, 1, 0, "cont > 1"), InvalidValue, "column 1: .*no variable cont.*did you mean count"),
        ((1, 1, 0, "count >"), InvalidValue, "column"),
        ((1, 1, 0, "__import__('os').system('true')"), InvalidValue, "is not allowed"),
        ((1, 1, 0, "count.__class__"), InvalidValue, "__class__"),
        ((1, 1, 0, "x" * 100_000), InvalidValue, "at most 500"),
        ((1, 1, 0, "(" * 400), InvalidValue, "column|cannot be read"),
        ((-(2**31), 2**31 - 1, 0, ""), NoSuchElement, "no automaton"),
    ],
)
def test_wrong_breakpoints_are_refused_and_the_others_stay(
    pair: Pair, point: tuple[int, int, int, str], error: type[Exception], reason: str
) -> None:
    with monitored(pair, counter()) as (_, proxy):
        proxy.setBreakpoints([Breakpoint(1, 2, 0, "count > 5")])
        with pytest.raises(error, match=reason):
            proxy.setBreakpoints([Breakpoint(1, 1, 0, ""), Breakpoint(*point)])
        assert proxy.getBreakpoints() == [Breakpoint(1, 2, 0, "count > 5")]


def test_too_many_breakpoints_are_refused(pair: Pair) -> None:
    with monitored(pair, counter()) as (_, proxy), pytest.raises(InvalidValue, match="at most 1000"):
        proxy.setBreakpoints([Breakpoint(1, 1, 0, f"count > {number}") for number in range(1001)])


class Walker(Component, document="walker.xml"):
    speed = Parameter(0.3, "How fast")
    steps = Parameter(3)
    name = Parameter("nao")
    loud = Parameter(False)

    def automaton(self) -> Automaton:
        return counter()


@pytest.mark.parametrize(
    ("name", "value", "shown"),
    [("speed", "0.5", "0.5"), ("speed", "2", "2.0"), ("steps", "-7", "-7"), ("name", '"x\\u00e9"', "'xé'"),
     ("loud", "true", "True")],
)  # fmt: skip
def test_a_parameter_is_set(pair: Pair, name: str, value: str, shown: str) -> None:
    with monitored(pair, counter(), Walker()) as (runtime, proxy):
        structure = proxy.getStructure()
        assert [(p.name, p.type) for p in structure.parameters] == [
            ("speed", "float"), ("steps", "int"), ("name", "str"), ("loud", "bool")
        ]  # fmt: skip
        proxy.setVariable(0, name, value)
        assert proxy.getSnapshot().parameters[name] == shown
        assert repr(getattr(runtime.component, name)) == shown


@pytest.mark.parametrize(
    ("automaton", "name", "value", "error", "reason"),
    [
        (0, "speed", '"fast"', InvalidValue, "speed is float, not str"),
        (0, "steps", "1.5", InvalidValue, "steps is int, not float"),
        (0, "steps", "true", InvalidValue, "steps is int, not bool"),
        (0, "loud", "1", InvalidValue, "loud is bool, not int"),
        (0, "sped", "1", NoSuchElement, "no parameter 'sped': did you mean speed"),
        (0, "automaton", "1", NoSuchElement, "no parameter 'automaton'"),
        (0, "__class__", "1", NoSuchElement, "no parameter"),
        (1, "cuont", "1", NoSuchElement, "no variable 'cuont': did you mean count"),
        (1, "self", "1", NoSuchElement, "no variable 'self'"),
        (9, "count", "1", NoSuchElement, "no automaton 9"),
        (1, "", "1", InvalidValue, "a name has"),
        (1, "x" * 10_000, "1", InvalidValue, "a name has"),
        (1, "\x1b[2J", "1", InvalidValue, "a name has"),
        (1, "count", "NaN", InvalidValue, "not JSON"),
        (1, "count", "1e999", InvalidValue, "not JSON"),
        (1, "count", "[1", InvalidValue, "not JSON"),
        (1, "count", "", InvalidValue, "not JSON"),
        (1, "count", "__import__('os')", InvalidValue, "not JSON"),
        (1, "count", "[" * 10_000, InvalidValue, "not JSON"),
        (1, "count", "[" * 100 + "]" * 100, InvalidValue, "too large"),
        (1, "count", f'"{"x" * 70_000}"', InvalidValue, "more than 65536 bytes"),
    ],
)
def test_values_that_do_not_fit_are_refused(
    pair: Pair, *, automaton: int, name: str, value: str, error: type[Exception], reason: str
) -> None:
    with monitored(pair, counter(), Walker()) as (_, proxy):
        with pytest.raises(error, match=reason):
            proxy.setVariable(automaton, name, value)
        proxy.setVariable(1, "go", "true")  # it is as alive as before
        first_snapshot(proxy, lambda snapshot: snapshot.automata[0].state == 2)


def test_an_event_takes_its_data_to_the_automata(pair: Pair) -> None:
    taken: list[object] = []
    root = Automaton(
        id=1,
        name="walker",
        period=0.02,
        states=(State(id=1, name="a", initial=True), State(id=2, name="b")),
        transitions=(
            Transition("", 1, 2, id=1, event="ball_lost", code=lambda event: taken.append(event.data)),
        ),
    )
    with monitored(pair, root) as (_, proxy):
        proxy.sendEvent("ball_lost", '{"color": "red", "at": [1, 2.5, null]}')
        first_snapshot(proxy, lambda snapshot: snapshot.automata[0].state == 2)
    assert taken == [{"color": "red", "at": [1, 2.5, None]}]


def test_an_event_that_is_not_declared_is_refused_with_the_way_to_declare_it(pair: Pair) -> None:
    class Waiting(Component, document="waiting.xml", events=["go"]):
        def automaton(self) -> Automaton:
            return root

    states = (State(id=1, name="a", initial=True), State(id=2, name="b"))
    waits = Transition("", 1, 2, id=1, event="go & see")
    root = Automaton(id=1, name="waiting", period=0.02, states=states, transitions=(waits,))
    with monitored(pair, root, Waiting()) as (runtime, proxy):
        assert proxy.getStructure().events == ["go"]
        with pytest.raises(InvalidValue) as refused:
            proxy.sendEvent("go & see", "")
        assert "add <event><name>go &amp; see</name></event> to the <events> of waiting.xml" in str(
            refused.value
        )
        proxy.sendEvent("go", "")
        runtime.component.send("go & see")  # its own code may
        first_snapshot(proxy, lambda snapshot: snapshot.automata[0].state == 2)


@pytest.mark.parametrize(
    ("name", "data", "reason"),
    [("", "", "a name"), ("x" * 1000, "", "a name"), ("a\nb", "", "a name"), ("x", "{", "not JSON"),
     ("x", "NaN", "not JSON"), ("x", "[" * 90 + "]" * 90, "too large"), ("x", "1" * 100_000, "more than")],
)  # fmt: skip
def test_events_that_make_no_sense_are_refused(pair: Pair, name: str, data: str, reason: str) -> None:
    with monitored(pair, counter()) as (_, proxy), pytest.raises(InvalidValue, match=reason):
        proxy.sendEvent(name, data)


def test_why_not_reports_guards_timers_and_events(pair: Pair) -> None:
    with monitored(pair, counter()) as (_, proxy):
        first_snapshot(proxy, lambda snapshot: snapshot.automata[0].cycles > 3)
        first = proxy.explain(1)
        (go,) = first.transitions
        assert (first.automaton, first.state, first.ghost, first.enteredBy) == (1, 1, False, 0)
        assert (go.transition, go.order, go.value) == (1, 1, False)
        assert go.askedAt > 0
        assert go.remaining == -1.0
        assert re.match(r"its guard `go` was false when it was evaluated \d+\.\d", go.reason)
        assert first.summary.startswith("walker has been in a for ")
        proxy.setVariable(1, "go", "true")
        first_snapshot(proxy, lambda snapshot: snapshot.automata[0].state == 2)
        second = proxy.explain(1)
        (back,) = second.transitions
        assert (second.enteredBy, back.askedAt, back.asked) == (1, -1.0, False)
        assert back.reason == "no event home has come since the state was entered"
        assert "entered by go" in second.summary
        with pytest.raises(NoSuchElement, match="no automaton 9"):
            proxy.explain(9)


def test_a_reload_without_a_file_is_refused_and_nothing_changes(pair: Pair) -> None:
    with monitored(pair, counter()) as (_, proxy):
        with pytest.raises(ReloadRefused, match=r"does not define|cannot be loaded"):
            proxy.reload()
        assert proxy.getStructure().generation == 0
