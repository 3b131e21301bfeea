"""A component whose robot refuses a command, or whose hardware fails temporarily."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress

import pytest

from hfsm_runtime import Automaton, Component, State, Transition, VirtualRun
from hfsm_runtime._limits import LIMITS, RuntimeLimits
from hfsm_runtime.debugger.snapshot import take_snapshot
from hfsm_runtime.errors import CycleCutError
from interfaces.hfsm import ComponentStatus
from interfaces.jderobot import CommandRefusedException, HardwareFailedException, InvalidValueException
from tests.support.automata import after, automaton, component, on, when
from tests.support.limits import FOREVER
from tests.support.running import running
from tests.support.waiting import until
from zenoh_ice import ConnectionLostException, ObjectNotExistException, TimeoutException


class Gate:
    """A robot that accepts commands or not; it lists the accepted ones and counts the refused ones."""

    def __init__(self, now: Callable[[], float] = lambda: 0.0) -> None:
        self.now = now
        self.stopped = False
        self.taken: list[tuple[float, str]] = []
        self.refused = 0

    def command(self, name: str) -> None:
        if self.stopped:
            self.refused += 1
            raise CommandRefusedException("the robot is stopped: a hand in the way", "")
        self.taken.append((self.now(), name))


def commanding(gate: Gate, period: float = 0.1) -> Automaton:
    """Return an automaton that commands in each cycle."""
    return automaton(1, "root", [State(id=1, name="a", code=lambda: gate.command("a"))], period=period)


def test_a_refused_command_pauses_the_component_and_the_state_runs_again_after_the_reset() -> None:
    gate = Gate(lambda: virtual.time)
    ran: list[float] = []

    def code() -> None:
        ran.append(virtual.time)
        gate.command("a")

    states = [State(id=1, name="a", code=code), State(id=2, name="b")]
    root = automaton(1, "root", states, [after(0.5, 1, 2)])
    virtual = VirtualRun(component(root), commands_accepted=lambda _holder: not gate.stopped)
    virtual.advance(0.15)
    gate.stopped = True
    virtual.advance(10.0)
    assert virtual.time == pytest.approx(0.2)
    assert (virtual.active, virtual.halted) == ("a", False)
    assert virtual.refusal is not None
    assert virtual.refusal.message.startswith("root/a: CommandRefusedException: ")
    assert "a hand in the way" in virtual.refusal.message
    gate.stopped = False
    virtual.advance(1.0)
    assert virtual.refusal is None
    assert virtual.active == "b"
    assert [at for at, _ in gate.taken] == pytest.approx([0.0, 0.1, 0.3, 0.4])
    assert virtual.changes("root")[-1] == (pytest.approx(0.5), "b"), "its timer stood still during the pause"


def test_a_refusal_of_which_nobody_knows_the_end_is_tried_once_a_second_and_reported_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    gate = Gate()
    gate.stopped = True
    virtual = VirtualRun(component(commanding(gate)))
    virtual.advance(10.5)
    assert gate.refused == 10
    assert virtual.time == pytest.approx(0.9), "each try takes a period"
    assert len(virtual.errors) == 1
    gate.stopped = False
    virtual.advance(1.0)
    reported = [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]
    assert [text.split("; ")[-1].split(" after")[0] for text in reported] == [
        "pauses until commands are accepted again",
        "commands are accepted again: continuing",
    ]


def test_a_cycle_that_is_refused_while_the_component_pauses_for_a_person_says_nothing_contrary(
    caplog: pytest.LogCaptureFixture,
) -> None:
    gate = Gate()
    gate.stopped = True

    def code() -> None:
        virtual.pause_for("the robot is stopped: a hand in the way")
        gate.command("a")

    root = automaton(1, "root", [State(id=1, name="a", code=code)])
    virtual = VirtualRun(component(root), commands_accepted=lambda _holder: False)
    virtual.advance(1.0)
    reported = [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]
    assert [text.split("; ")[-1] for text in reported] == [
        "pauses until a person lets it go on",
        "pauses already",
    ]


def test_entry_code_that_was_refused_runs_again_whole_before_the_state_begins() -> None:
    gate = Gate(lambda: virtual.time)
    ran: list[str] = []

    def enter() -> None:
        ran.append("entry")
        gate.command("raise the arm")

    states = [State(id=1, name="a"), State(id=2, name="b", entry=enter, code=lambda: ran.append("code"))]
    virtual = VirtualRun(component(automaton(1, "root", states, [when(lambda: True, 1, 2)])))
    gate.stopped = True
    virtual.advance(1.5)
    gate.stopped = False
    virtual.advance(0.8)
    assert (virtual.active, ran[:4]) == ("b", ["entry", "entry", "entry", "code"])


def test_the_code_of_a_transition_that_was_refused_does_not_run_again() -> None:
    gate = Gate()
    gate.stopped = True
    ran: list[str] = []
    states = [State(id=1, name="a"), State(id=2, name="b", code=lambda: ran.append("b"))]
    fire = when(lambda: True, 1, 2, code=lambda: gate.command("wave"))
    virtual = VirtualRun(component(automaton(1, "root", states, [fire])))
    virtual.advance(0.5)
    assert (virtual.active, ran) == ("b", [])
    gate.stopped = False
    virtual.advance(1.0)
    assert (gate.refused, gate.taken) == (1, [])
    assert ran, "the state goes on"


def test_no_other_automaton_runs_during_the_pause() -> None:
    gate = Gate()
    beside: list[int] = []
    below = [
        automaton(2, "arm", [State(id=1, name="x", code=lambda: gate.command("arm"))]),
        automaton(3, "leg", [State(id=1, name="y", code=lambda: beside.append(1))]),
    ]
    virtual = VirtualRun(component(automaton(1, "root", [State(id=1, name="a", children=tuple(below))])))
    virtual.advance(0.2)
    gate.stopped = True
    virtual.advance(0.1)
    count = len(beside)
    virtual.advance(0.8)
    assert len(beside) == count


def test_with_on_refused_error_a_refused_command_is_an_error_of_the_code() -> None:
    gate = Gate()
    gate.stopped = True
    root = commanding(gate)
    virtual = VirtualRun(component(root, on_refused="error"))
    virtual.advance(1.0)
    assert virtual.halted
    goes_on = VirtualRun(component(root, on_error="continue", on_refused="error"))
    goes_on.advance(1.0)
    assert (goes_on.time, goes_on.refusal) == (1.0, None)


def test_hardware_that_fails_for_a_moment_skips_cycles_and_the_tenth_in_a_row_is_an_error() -> None:
    fails = 9
    ran: list[float] = []

    def look() -> None:
        nonlocal fails
        if fails:
            fails -= 1
            raise HardwareFailedException("Camera: no image of 320x240 within 1 s")
        ran.append(virtual.time)

    virtual = VirtualRun(component(automaton(1, "root", [State(id=1, name="a", code=look)])))
    virtual.advance(1.0)
    assert ran == [0.9, 1.0]
    fails = 9
    virtual.advance(1.0)
    assert len(virtual.errors) == 18
    assert not virtual.halted, "the ones before do not count"
    fails = 10
    virtual.advance(1.0)
    assert virtual.halted


# A state that waits for the event `refused`.

HEARD = "there is no posture 'Sit'"


def refused(error: Exception) -> Callable[[], object]:
    """Return code that a servant refuses."""

    def code() -> None:
        raise error

    return code


def hearing(asking: State, why: list[object], *transitions: Transition) -> Automaton:
    """Return an automaton that asks for something, and goes to its end when that is refused."""
    heard = on("refused", 1, 2, priority=1, code=lambda event: why.append(event.data))
    return automaton(1, "root", [asking, State(id=2, name="end", final=True)], [*transitions, heard])


@pytest.mark.parametrize(
    "error",
    [
        InvalidValueException(HEARD, "name"),
        CommandRefusedException(HEARD, "somebody"),
        ObjectNotExistException(HEARD),
        ConnectionLostException(HEARD),
        TimeoutException(HEARD),
    ],
    ids=lambda error: type(error).__name__,
)
@pytest.mark.parametrize("piece", ["entry", "code"])
def test_a_state_hears_why_a_servant_refused_what_it_asked_for(error: Exception, piece: str) -> None:
    why: list[object] = []
    asking = State(id=1, name="ask", **{piece: refused(error)})  # type: ignore[arg-type]
    virtual = VirtualRun(component(hearing(asking, why)))
    virtual.advance(0.5)
    assert (virtual.active, why) == ("end", [HEARD])
    assert (virtual.halted, virtual.errors, virtual.refusal) == (False, (), None)


def test_a_refusal_comes_before_guards_that_ask_about_what_was_done_before() -> None:
    why: list[object] = []
    asking = State(id=1, name="ask", entry=refused(InvalidValueException(HEARD)))
    virtual = VirtualRun(component(hearing(asking, why, when(lambda: True, 1, 2))))
    virtual.advance(0.5)
    assert why == [HEARD]


def test_a_guard_that_is_refused_does_not_hold_and_the_state_hears_it() -> None:
    why: list[object] = []
    lost = when(refused(ConnectionLostException(HEARD)), 1, 2)
    virtual = VirtualRun(component(hearing(State(id=1, name="ask"), why, lost)))
    virtual.advance(0.5)
    assert (virtual.active, why) == ("end", [HEARD])


def test_a_state_hears_what_is_refused_below_it() -> None:
    why: list[object] = []
    asks = automaton(
        2, "below", [State(id=1, name="x", code=refused(InvalidValueException(HEARD)))], period=0.01
    )
    virtual = VirtualRun(component(hearing(State(id=1, name="ask", children=(asks,)), why)))
    virtual.advance(0.5)
    assert (virtual.active, why) == ("end", [HEARD])


def test_what_is_refused_while_a_state_is_left_is_no_answer_to_the_next() -> None:
    why: list[object] = []
    leaving = State(id=1, name="ask", exit=refused(ConnectionLostException(HEARD)))
    states = [leaving, State(id=2, name="next"), State(id=3, name="failed")]
    hears = [on("refused", 1, 3), on("refused", 2, 3)]
    virtual = VirtualRun(component(automaton(1, "root", states, [after(0.2, 1, 2), *hears])))
    virtual.advance(1.0)
    assert (virtual.active, why, virtual.errors) == ("next", [], ())


def test_a_state_hears_what_is_refused_while_one_far_below_it_is_left() -> None:
    why: list[object] = []
    leaf = automaton(3, "leaf", [State(id=1, name="y", exit=refused(InvalidValueException(HEARD)))])
    states = [State(id=1, name="x", children=(leaf,), restart=True), State(id=2, name="z")]
    below = automaton(2, "below", states, [after(0.2, 1, 2)])
    virtual = VirtualRun(component(hearing(State(id=1, name="ask", children=(below,)), why)))
    virtual.advance(0.5)
    assert (virtual.active, why, virtual.errors) == ("end", [HEARD], ())


def test_hardware_that_fails_now_and_then_is_not_refused_where_errors_are_ignored() -> None:
    why: list[object] = []

    def look() -> None:
        if round(virtual.time * 10) % 3:
            raise HardwareFailedException("Camera: no image")

    virtual = VirtualRun(component(hearing(State(id=1, name="ask", code=look), why), on_error="continue"))
    virtual.advance(3.0)
    assert (virtual.active, why) == ("ask", [])


def test_a_refusal_that_no_guard_lets_through_is_dropped_and_older_events_are_kept() -> None:
    code = refused(InvalidValueException(HEARD))
    asking = State(id=1, name="ask", code=lambda: code() if virtual.time == 0.2 else None)
    rejects = on("refused", 1, 2, guard=lambda event: event.data != HEARD)
    root = automaton(1, "root", [asking, State(id=2, name="end")], [rejects, on("go", 1, 2)])
    virtual = VirtualRun(component(root))
    virtual.advance(0.25)
    virtual.send("go")
    virtual.advance(0.1)
    (run,) = virtual.tree.actors
    assert run.events.last_dropped is not None
    assert (virtual.active, run.events.last_dropped[0].data, run.events.dropped) == ("end", HEARD, 1)


def test_a_refusal_is_dropped_though_no_other_event_waits() -> None:
    asking = State(id=1, name="ask", entry=refused(InvalidValueException(HEARD)))
    rejects = on("refused", 1, 2, guard=lambda event: event.data != HEARD)
    virtual = VirtualRun(component(automaton(1, "root", [asking, State(id=2, name="end")], [rejects])))
    virtual.advance(0.5)
    (run,) = virtual.tree.actors
    assert (virtual.active, run.events.dropped, virtual.errors) == ("ask", 1, ())


def test_what_is_refused_to_a_ghost_is_an_error_that_no_state_hears() -> None:
    why: list[object] = []

    def root(c: Component) -> Automaton:
        def code() -> None:
            with suppress(CycleCutError):
                c.sleep(60)
            raise InvalidValueException(HEARD)

        late = automaton(3, "late", [State(id=1, name="y", code=code)])
        states = [State(id=1, name="x", children=(late,)), State(id=2, name="z")]
        below = automaton(2, "below", states, [after(0.2, 1, 2)])
        return hearing(State(id=1, name="ask", children=(below,)), why)

    virtual = VirtualRun(component(root))
    virtual.advance(0.5)
    assert (virtual.halted, why, [error.automaton for error in virtual.errors]) == (True, [], [3])


@pytest.mark.parametrize("code", [None, lambda: None])
def test_code_of_a_transition_that_does_not_run_is_reported(
    code: Callable[[], object] | None, caplog: pytest.LogCaptureFixture
) -> None:
    states = [
        State(id=1, name="a", exit=refused(ConnectionLostException("gone"))),
        State(id=2, name="b"),
    ]
    virtual = VirtualRun(component(automaton(1, "root", states, [after(0.2, 1, 2, code=code, name="go")])))
    virtual.advance(0.5)
    assert virtual.active == "b"
    reported = [text for text in caplog.messages if "go does not run" in text]
    assert len(reported) == (code is not None)


@pytest.mark.parametrize("later", [asyncio.CancelledError("why"), SystemExit(4)], ids=repr)
def test_all_that_ends_the_component_in_exit_code_is_reported(later: BaseException) -> None:
    def leave(end: BaseException) -> Callable[[], object]:
        def code() -> None:
            raise end

        return code

    child = automaton(2, "child", [State("x", exit=leave(SystemExit(3)))])
    states = [State("a", restart=True, children=(child,), exit=leave(later)), State("b")]
    virtual = VirtualRun(component(automaton(1, "root", states, [after(0.2, 1, 2)])))
    with pytest.raises(SystemExit) as end:
        virtual.advance(0.5)
    assert (end.value.code, virtual.exit_code) == (3, 3)
    assert len(virtual.errors) == 2
    assert str(later) in virtual.errors[1].message


def test_a_mistake_in_the_code_is_not_refused() -> None:
    virtual = VirtualRun(component(hearing(State(id=1, name="ask", code=refused(ValueError("a slip"))), [])))
    virtual.advance(0.5)
    assert virtual.halted


@pytest.mark.parametrize("on_error", ["stop", "continue"])
def test_a_picture_that_may_be_late_is_not_refused_and_a_broken_camera_is(on_error: str) -> None:
    why: list[object] = []
    looks = State(id=1, name="ask", code=refused(HardwareFailedException("Camera: no image")))
    virtual = VirtualRun(component(hearing(looks, why), on_error=on_error))
    virtual.advance(0.85)
    assert (virtual.active, why) == ("ask", [])
    virtual.advance(0.5)
    assert (virtual.active, why) == ("end", ["Camera: no image"])


# On threads.


def test_on_threads_a_state_hears_it_too() -> None:
    why: list[object] = []
    asking = State(id=1, name="ask", entry=refused(InvalidValueException(HEARD)))
    with running(hearing(asking, why)):
        until(lambda: why == [HEARD])


def test_on_threads_it_is_asked_at_once_and_then_only_after_a_delay() -> None:
    gate = Gate()
    gate.stopped = True
    asked: list[str] = []

    def taken(holder: str) -> bool:
        asked.append(holder)
        return True

    with running(commanding(gate, 0.01), limits=RuntimeLimits(retry=FOREVER)) as runtime:
        until(lambda: runtime.refusal is not None)
        for _ in range(3):
            runtime.retry(taken)
        assert runtime.refusal is not None
    assert asked == [""]
    assert LIMITS.retry == 1.0, "as the manual says"


def test_on_threads_it_is_paused_until_commands_are_taken() -> None:
    gate = Gate()
    asked: list[str] = []

    def taken(holder: str) -> bool:
        asked.append(holder)
        return not gate.stopped

    def tried_until(condition: Callable[[], bool]) -> None:
        def tried() -> bool:
            runtime.retry(taken)
            return condition()

        until(tried)

    with running(commanding(gate, 0.01), limits=RuntimeLimits(retry=0.01)) as runtime:
        until(lambda: len(gate.taken) > 2)
        gate.stopped = True
        until(lambda: runtime.refusal is not None)
        assert runtime.status is ComponentStatus.Paused
        at = runtime.component_time.now()
        tried_until(lambda: len(asked) == 2)
        assert (runtime.component_time.now(), runtime.status, gate.refused) == (at, ComponentStatus.Paused, 1)
        gate.stopped = False
        count = len(gate.taken)
        tried_until(lambda: len(gate.taken) > count)
        assert (runtime.status, runtime.refusal) == (ComponentStatus.Running, None)


def test_somebody_may_resume_it_by_hand_and_it_pauses_again_while_refused() -> None:
    gate = Gate()
    gate.stopped = True
    with running(commanding(gate, 0.01)) as runtime:
        until(lambda: runtime.refusal is not None)
        runtime.resume()
        until(lambda: gate.refused == 2 and runtime.refusal is not None)
        gate.stopped = False
        runtime.resume()
        until(lambda: len(gate.taken) > 2)
        assert runtime.status is ComponentStatus.Running


def test_a_pause_by_hand_outlasts_the_refusal() -> None:
    gate = Gate()
    gate.stopped = True
    with running(commanding(gate, 0.01)) as runtime:
        until(lambda: runtime.refusal is not None)
        refusal = runtime.refusal
        runtime.pause()
        runtime.resume(refusal)
        assert (runtime.status, runtime.refusal) == (ComponentStatus.Paused, None)


def test_all_errors_of_a_run_are_kept_and_its_monitor_shows_the_newest() -> None:
    def code() -> None:
        raise ValueError(f"at {virtual.time:.1f} s")

    root = automaton(1, "root", [State(id=1, name="a", code=code)])
    virtual = VirtualRun(component(root, on_error="continue"))
    virtual.advance(3.5)
    said = [error.message for error in virtual.errors]
    assert said == [f"ValueError: at {cycle / 10:.1f} s" for cycle in range(36)]
    assert [error.message for error in take_snapshot(virtual, 0.0).errors] == said[-20:]
