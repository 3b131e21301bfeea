"""Components on threads and a real clock: the schedule, pausing, stepping, ending."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from hfsm_runtime import Automaton, Component, State
from hfsm_runtime._limits import RuntimeLimits
from hfsm_runtime._runtime import Runtime
from hfsm_runtime._timeline import Timeline
from hfsm_runtime.errors import ComponentStoppedError, UnknownElementError
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from interfaces.hfsm import ComponentStatus
from tests.support.automata import after, automaton, component, finished, on, when
from tests.support.documents import generate, load
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.places import DATA
from tests.support.running import running
from tests.support.waiting import until
from zenoh_ice import WallClock


@pytest.mark.slow
def test_cycles_keep_to_their_schedule() -> None:
    with running(automaton(1, "root", [State(id=1, name="a")], period=0.02)) as runtime:
        until(lambda: runtime.component_time.now() > 200_000_000 and runtime.tree.root.cycle.count > 1)
    run = runtime.tree.root
    # Each slot is run at most once, whatever the load of the machine.
    assert 1 < run.cycle.count <= runtime.component_time.now() // 20_000_000 + 1


def test_automata_that_wake_later_in_their_slots_keep_the_times_of_the_slots() -> None:
    def child(number: int) -> Automaton:
        states = [State(id=1, name="x"), State(id=2, name="y", final=True)]
        return automaton(number, f"child {number}", states, [after(0.02, 1, 2)], period=0.02)

    states = [
        State(id=1, name="a", children=tuple(map(child, range(2, 12)))),
        State(id=2, name="b", final=True),
    ]
    with running(automaton(1, "root", states, [finished(1, 2)], period=0.02)) as runtime:
        assert runtime.ended.wait(EVENT_LIMIT)
    entered = [run.entered for run in runtime.tree.actors]
    assert all(time > 0 and time % 20_000_000 == 0 for time in entered)


@pytest.mark.slow
def test_paused_nothing_runs_and_timers_stand_still() -> None:
    ran: list[float] = []
    root = automaton(
        1,
        "root",
        [State(id=1, name="a", code=lambda: ran.append(time.monotonic())), State(id=2, name="b")],
        [after(0.1, 1, 2)],
        period=0.02,
    )
    with running(root) as runtime:
        until(lambda: len(ran) >= 1)  # after two cycles, a busy machine may be in the second state
        runtime.pause()
        assert runtime.status.name == "Paused"
        until(lambda: not runtime.tree.root.in_cycle)
        count, now = len(ran), runtime.component_time.now()
        time.sleep(0.15)  # longer than the timer
        assert (len(ran), runtime.component_time.now()) == (count, now)
        runtime.resume()
        assert runtime.status.name == "Running"
        until(lambda: runtime.tree.root.current.name == "b")
    entered = runtime.tree.root.entered
    assert entered >= 100_000_000
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
        until(lambda: not any(run.in_cycle for run in runtime.tree.actors))
        ran.clear()
        now = runtime.component_time.now()
        runtime.step(2)
        assert ran == ["child"]
        assert runtime.component_time.now() - now == 20_000_000
        runtime.step(0)
        assert ran == ["child", "root", "child"]
        assert runtime.component_time.now() - now == 40_000_000
        for _ in range(1510):
            runtime.step(0)
        assert runtime.tree.root.current.name == "b"


def test_a_step_while_it_runs_does_nothing() -> None:
    with running(automaton(1, "root", [State(id=1, name="a")], period=60)) as runtime:
        until(lambda: runtime.tree.root.cycle.count == 1)
        runtime.step(0)
    assert runtime.tree.root.cycle.count == 1


def test_a_component_that_is_to_end_makes_no_further_step() -> None:
    ran = threading.Event()
    root = automaton(1, "root", [State(id=1, name="a", initial=True, code=ran.set)])
    with running(root) as runtime:
        assert ran.wait(EVENT_LIMIT)
        runtime.pause()
        until(lambda: not runtime.in_cycle)
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
        until(lambda: runtime.tree.root.current.name == "b")
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
        assert sleeping.wait(EVENT_LIMIT)
        runtime.stop()
    assert after_sleep == []
    assert runtime.status is ComponentStatus.Halted
    assert not runtime.failed


def test_an_exception_halts_all_automata() -> None:
    child = automaton(2, "child", [State(id=1, name="x", code=lambda: 1 / 0)], period=0.02)
    root = automaton(1, "root", [State(id=1, name="a", children=(child,))], period=0.02)
    with running(root) as runtime:
        assert runtime.ended.wait(EVENT_LIMIT)
        assert runtime.failed
        assert runtime.status is ComponentStatus.Halted
        until(lambda: not any(run.in_cycle for run in runtime.tree.actors))
        cycles = [run.cycle.count for run in runtime.tree.actors]
        time.sleep(0.1)
        assert [run.cycle.count for run in runtime.tree.actors] == cycles


@pytest.mark.parametrize(("code", "failed"), [(0, False), (3, True), (None, False)])
def test_user_code_may_end_the_component(code: int | None, failed: bool) -> None:
    root = automaton(1, "root", [State(id=1, name="a", code=lambda: sys.exit(code))])
    with running(root) as runtime:
        assert runtime.ended.wait(EVENT_LIMIT)
    assert runtime.failed is failed


@pytest.mark.parametrize("end", [SystemExit, KeyboardInterrupt])
def test_no_other_cycle_begins_once_code_ends_the_component(end: type[BaseException]) -> None:
    class Watch(Observer):
        def cycle_ended(self, actor: Actor, at: int) -> None:
            had_ended.append(runtime.ended.is_set())

    def code() -> None:
        raise end

    had_ended: list[bool] = []
    runtime = Runtime(component(automaton(1, "root", [State("a", code=code)])), WallClock())
    runtime.tree.observers.append(Watch())
    runtime.start()
    try:
        assert runtime.ended.wait(EVENT_LIMIT)
    finally:
        runtime.stop()
    assert had_ended == [True]


def test_a_step_of_all_begins_no_cycle_once_one_has_ended_the_component() -> None:
    ran = threading.Event()
    child = automaton(2, "child", [State("x", code=ran.set)])
    root = automaton(1, "root", [State("a", children=(child,), code=lambda: run_now.is_set() and 1 / 0)])
    run_now = threading.Event()
    with running(root) as runtime:
        assert ran.wait(EVENT_LIMIT)
        runtime.pause()
        until(lambda: not runtime.in_cycle)
        ran.clear()
        run_now.set()
        runtime.step(0)
        assert runtime.failed
        assert not ran.is_set()


def test_a_component_that_halts_stays_halted() -> None:
    with running(automaton(1, "root", [State(id=1, name="a")], period=0.02)) as runtime:
        runtime.request_stop()
        runtime.resume()
        until(lambda: not runtime.tree.root.in_cycle)
        cycles = runtime.tree.root.cycle.count
        time.sleep(0.1)
        assert runtime.tree.root.cycle.count == cycles


def test_the_root_that_finishes_ends_the_component_and_nothing_has_failed() -> None:
    child = automaton(2, "child", [State(id=1, name="x", final=True)], period=0.01)
    states = [State(id=1, name="a", children=(child,)), State(id=2, name="end", final=True)]
    with running(automaton(1, "root", states, [finished(1, 2)], period=0.01)) as runtime:
        assert runtime.ended.wait(EVENT_LIMIT)
    assert (runtime.status, runtime.failed, runtime.errors) == (ComponentStatus.Halted, False, ())


def test_events_reach_automata_from_other_threads_and_from_each_other() -> None:
    def root(c: Component) -> Automaton:
        sender = automaton(2, "sender", [State(id=1, name="x"), State(id=2, name="y")],
                           [on("go", 1, 2, code=lambda event: c.send("back", event.data))], period=0.01)  # fmt: skip
        states = [State(id=1, name="a", children=(sender,)), State(id=2, name="b")]
        return automaton(
            1, "root", states, [on("back", 1, 2, guard=lambda event: event.data == 7)], period=0.01
        )

    with running(root) as runtime:
        until(lambda: runtime.tree.actors[1].active)
        runtime.send("go", 7)
        until(lambda: next(runtime.tree.root.paths()) == "b")


def test_a_sleep_of_user_code_ends_with_a_pause_and_the_cycle_runs_again_when_it_goes_on() -> None:
    sleeping = threading.Event()
    after_sleep: list[str] = []

    def root(c: Component) -> Automaton:
        def code() -> None:
            sleeping.set()
            c.sleep(3600)
            after_sleep.append("went on")

        return automaton(1, "root", [State(id=1, name="a", code=code)], period=0.02)

    with running(root) as runtime:
        assert sleeping.wait(EVENT_LIMIT)
        runtime.pause()
        until(lambda: not runtime.in_cycle)
        sleeping.clear()
        runtime.resume()
        assert sleeping.wait(EVENT_LIMIT)
    assert (after_sleep, runtime.errors) == ([], ())


def test_an_entry_that_a_pause_cuts_short_is_run_again() -> None:
    sleeping, paused = threading.Event(), threading.Event()

    def root(c: Component) -> Automaton:
        def entry() -> None:
            sleeping.set()
            if not paused.is_set():
                c.sleep(3600)

        return automaton(1, "root", [State(id=1, name="a", entry=entry), State(id=2, name="b")],
                         [after(0.02, 1, 2)], period=0.02)  # fmt: skip

    with running(root) as runtime:
        assert sleeping.wait(EVENT_LIMIT)
        runtime.pause()
        until(lambda: not runtime.in_cycle)
        assert runtime.tree.root.owed
        paused.set()
        runtime.resume()
        until(lambda: next(runtime.tree.root.paths()) == "b")


def test_code_may_sleep_in_a_step() -> None:
    slept: list[str] = []

    def root(c: Component) -> Automaton:
        def code() -> None:
            c.sleep(0.01)
            slept.append("slept")

        return automaton(1, "root", [State(id=1, name="a", code=code)], period=0.02)

    with running(root) as runtime:
        runtime.pause()
        until(lambda: not runtime.in_cycle)
        slept.clear()
        runtime.step(0)
        assert slept == ["slept"]


def test_a_sleep_on_a_thread_of_the_users_own_lasts_until_the_component_ends() -> None:
    slept, ended = threading.Event(), threading.Event()
    threads: list[threading.Thread] = []

    def root(c: Component) -> Automaton:
        def background() -> None:
            c.sleep(0.001)
            slept.set()
            with suppress(ComponentStoppedError):
                c.sleep(3600)
            ended.set()

        def entry() -> None:
            threads.append(threading.Thread(target=background))
            threads[0].start()

        return automaton(1, "root", [State(id=1, name="a", entry=entry)], period=0.02)

    with running(root) as runtime:
        assert slept.wait(EVENT_LIMIT)
        runtime.pause()
        assert not ended.is_set()
    assert ended.wait(EVENT_LIMIT)
    threads[0].join(EVENT_LIMIT)


def test_once_a_thread_of_the_users_own_has_failed_only_exit_code_runs() -> None:
    ran: list[str] = []
    runtime: Runtime

    def inner_exit() -> None:
        ran.append("inner exit")
        runtime.thread_failed("", "it failed")

    def says(what: str) -> Callable[[], None]:
        return lambda: ran.append(what)

    below = automaton(2, "below", [State(id=1, name="x", exit=inner_exit)], period=0.02)
    states = [
        State(id=1, name="a", children=(below,), exit=says("exit"), restart=True),
        State(id=2, name="b", entry=says("entry"), code=says("code")),
    ]
    root = automaton(1, "root", states, [after(0.05, 1, 2, says("transition"))], period=0.02)
    with running(root) as runtime:
        assert runtime.ended.wait(EVENT_LIMIT)
        until(lambda: not runtime.in_cycle)
    assert ran == ["inner exit", "exit"]
    assert runtime.tree.root.current.name == "b"
    assert runtime.exit_code == 1


@pytest.mark.slow
def test_functions_of_a_document_may_be_called_like_those_of_every_component(tmp_path: Path) -> None:
    runtime = Runtime(load(generate(DATA / "components" / "own_names.xml", tmp_path)), WallClock())
    runtime.start()
    try:
        until(lambda: next(runtime.tree.root.paths()) == "rest")
    finally:
        runtime.stop()
    assert runtime.errors == ()


def test_what_is_called_like_a_function_of_every_component_may_still_use_it() -> None:
    class Loud(Component):
        def send(self, name: str, data: object = None) -> None:
            super().send(name.upper(), data)

        def automaton(self) -> Automaton:
            states = [State(id=1, name="a", code=lambda: self.send("go")), State(id=2, name="b", final=True)]
            return automaton(1, "root", states, [on("GO", 1, 2)], period=0.02)

    runtime = Runtime(Loud(), WallClock())
    runtime.start()
    try:
        assert runtime.ended.wait(EVENT_LIMIT)
    finally:
        runtime.stop()


def test_an_automaton_that_wakes_after_a_pause_is_not_kept_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    alarm_rests = threading.Event()
    wait_until = Timeline.wait_until

    def rest(timeline: Timeline, when: int, wake: threading.Event) -> None:
        if timeline.paused and threading.current_thread().name == "alarm":
            alarm_rests.set()
        wait_until(timeline, when, wake)

    monkeypatch.setattr(Timeline, "wait_until", rest)
    left = automaton(2, "left", [State(id=1, name="x")], period=0.02)
    right = automaton(3, "right", [State(id=1, name="x")], period=0.02)
    states = [State(id=1, name="a", children=(left,)), State(id=2, name="b", children=(right,))]
    root = automaton(1, "root", states, [when(lambda: False, 1, 2), when(lambda: False, 2, 1)], period=0.02)
    forth, back = root.transitions
    with running(root, limits=RuntimeLimits(idle=FOREVER, paused=FOREVER)) as runtime:
        until(lambda: runtime.actor(2).cycle.count > 0)
        runtime.pause()
        until(lambda: not runtime.in_cycle)
        runtime.force(1, forth.id)
        runtime.step(1)
        assert alarm_rests.wait(EVENT_LIMIT)
        runtime.resume()
        until(lambda: runtime.actor(3).cycle.count > 5)
        before = runtime.actor(2).cycle.count
        runtime.force(1, back.id)
        until(lambda: runtime.actor(2).cycle.count > before)


def test_a_thread_that_is_just_about_to_rest_is_notified_of_the_end(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    armed, reached, reported = threading.Event(), threading.Event(), threading.Event()

    class Wake(threading.Event):
        def clear(self) -> None:
            if armed.is_set() and threading.current_thread() is not threading.main_thread():
                reached.set()
                reported.wait(EVENT_LIMIT)
            super().clear()

        def set(self) -> None:
            super().set()
            if reached.is_set():
                reported.set()

    class Threading:
        Event = Wake

        def __getattr__(self, name: str) -> object:
            return getattr(threading, name)

    monkeypatch.setattr("hfsm_runtime._runtime.threading", Threading())
    root = automaton(1, "root", [State(id=1, name="a")], period=60)
    with running(root, limits=RuntimeLimits(idle=FOREVER, stop=EVENT_LIMIT)) as runtime:
        until(lambda: runtime.tree.root.cycle.count == 1)
        armed.set()
        runtime.resume()
        assert reached.wait(EVENT_LIMIT)
        runtime.stop()
    assert "did not end" not in caplog.text


def test_a_step_of_many_ends_when_the_component_does(caplog: pytest.LogCaptureFixture) -> None:
    paused, inside, release = threading.Event(), threading.Event(), threading.Event()

    def code() -> None:
        if paused.is_set():
            inside.set()
            release.wait(FOREVER)

    child = automaton(2, "child", [State(id=1, name="x")], period=0.02)
    root = automaton(1, "root", [State(id=1, name="a", code=code, children=(child,))], period=0.02)
    with running(root) as runtime:
        until(lambda: runtime.actor(2).cycle.count > 0)
        runtime.pause()
        until(lambda: not runtime.in_cycle)
        paused.set()
        stepping = threading.Thread(target=runtime.step, args=(0,))
        stepping.start()
        assert inside.wait(EVENT_LIMIT)
        stopping = threading.Thread(target=runtime.stop)
        stopping.start()
        until(lambda: "automaton child" not in {thread.name for thread in threading.enumerate()})
        release.set()
        stepping.join(EVENT_LIMIT)
        stopping.join(EVENT_LIMIT)
    assert "takes longer" not in caplog.text
