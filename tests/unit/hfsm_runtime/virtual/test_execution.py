"""An execution in plain Python: a component in virtual time, watched and steered, without robot and pytest."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest

from hfsm_runtime import Automaton, Component, Parameter, Proxy, State
from hfsm_runtime.virtual import BehaviorFailed, Execution, UnknownName, VirtualWorld
from interfaces.jderobot import CameraPrx, ImageData
from tests.support.automata import after, automaton, component, when
from tests.support.gripper import GripperPrx
from zenoh_ice import CommunicatorDestroyedException, ConnectionLostException


class Grasps(Component, document="grasps.xml"):
    Hand = Proxy("Hand", GripperPrx)
    force = Parameter(2.0)

    def automaton(self) -> Automaton:
        held = 0.0

        def grasp() -> None:
            nonlocal held
            held = self.Hand.close(self.force)

        states = [State(id=1, name="open"), State(id=2, name="closed", entry=grasp)]
        transitions = [
            after(1.0, 1, 2, name="time to close"),
            when(lambda: held > 5.0, 2, 1, name="too much"),
        ]
        return automaton(1, "grasps", states, transitions)


def test_it_runs_and_knows_what_happened() -> None:
    with Execution(
        Grasps(), parameters={"force": 3.0}, stubs={"Hand": {"close": lambda force: force}}
    ) as run:
        assert run.run_until("closed") == 1.0
        assert repr(run) == "<grasps at 1 s in closed>"
        assert (run.state("grasps"), run.variables("grasps")["held"]) == ("closed", 3.0)
        assert [(call.target, call.force, call.result) for call in run.calls()] == [("Hand.close", 3.0, 3.0)]
        assert [fired.transition for fired in run.fired] == ["time to close"]
        assert "grasps: open -> closed  by time to close after 1 s" in run.timeline
        run.set("grasps", held=6.0)
        run.advance(0.1)
        assert run.changes("grasps")[-1] == (1.1, "open")


class Looks(Component, document="looks.xml"):
    Camera = Proxy("Camera", CameraPrx)

    def automaton(self) -> Automaton:
        look = State(id=1, name="look", code=lambda: self.Camera.getImageData("RGB8"))
        return automaton(1, "looks", [look], [])


def test_of_pictures_the_newest_are_kept() -> None:
    picture = ImageData(pixelData=bytes(1 << 20))
    with Execution(Looks(), stubs={"Camera": {"getImageData": lambda _: picture}}) as run:
        run.advance(5.0)
        kept = [call.result is not None for call in run.calls("Camera.getImageData")]
        assert len(kept) > 40
        assert kept == [False] * (len(kept) - 32) + [True] * 32


def test_an_error_of_its_code_is_raised_unless_a_policy_says_what_follows() -> None:
    stubs = {"Hand": {"close": ValueError("stuck")}}
    with Execution(Grasps(), stubs=stubs) as run, pytest.raises(BehaviorFailed, match="stuck"):
        run.advance(2.0)
    with Execution(Grasps(), stubs=stubs, on_error="stop") as run:
        run.advance(2.0)
        assert run.halted
        assert "stuck" in run.errors[-1].message


def test_a_servant_that_is_offline_is_no_error_of_the_code() -> None:
    with Execution(Grasps(), stubs={"Hand": {"close": 1.0}}) as run:
        with run.server_offline("Hand"):
            run.advance(1.5)
            assert isinstance(run.calls("Hand")[-1].error, ConnectionLostException)
        run.advance(0.1)
        assert run.calls("Hand")[-1].result == 1.0


def test_nothing_is_served_any_more_when_it_is_closed() -> None:
    component = Grasps()
    with Execution(component, stubs={"Hand": {"close": 1.0}}):
        assert component.Hand.close(1.0) == 1.0
    with pytest.raises(CommunicatorDestroyedException):
        component.Hand.close(1.0)


def test_one_that_cannot_be_made_closes_its_world() -> None:
    world = VirtualWorld()
    with pytest.raises(UnknownName, match="no parameter 'strength'; there are force"):
        Execution(Grasps(), world, parameters={"strength": 1.0})
    assert world.communicator.destroyed


def test_a_world_may_keep_the_newest_calls_alone() -> None:
    with Execution(Grasps(), VirtualWorld(kept=2), stubs={"Hand": {"close": 9.0}}) as run:
        run.advance(10.0)
        assert len(run.calls()) == len(run.fired) == 2
        assert run.timeline.count("\n") == 3  # the head, how many were left out, and two lines


def test_a_pause_between_two_cycles_leaves_none_out() -> None:
    times: list[float] = []
    root = automaton(1, "root", [State(id=1, name="a", code=lambda: times.append(run.time))])
    with Execution(component(root)) as run:
        run.world.clock.call_at(0.25, run.pause)
        run.advance(1.0)
        assert (times, run.time) == ([0.0, 0.1, 0.2], 0.25)
        run.step(0)
        run.resume()
        run.advance(0.1)
        assert times[3:] == pytest.approx([0.35, 0.4])


def test_a_cycle_that_a_pause_came_before_runs_after_it() -> None:
    times: list[float] = []
    root = automaton(1, "root", [State(id=1, name="a", code=lambda: times.append(run.time))])
    with Execution(component(root)) as run:
        run.world.clock.call_at(0.25, run.pause)
        run.advance(1.0)
        run.resume()
        run.advance(0.2)
        assert times == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])


def leaving(code: Callable[[], object]) -> Component:
    """Return a component with the hand whose third cycle does something."""

    class Leaves(Component):
        Hand = Proxy("Hand", GripperPrx)

        def automaton(self) -> Automaton:
            cycles = iter([lambda: None, lambda: None, code])
            return automaton(1, "leaves", [State(id=1, name="a", code=lambda: next(cycles, lambda: None)())])

    return Leaves()


def test_its_root_that_finishes_stops_what_it_commanded() -> None:
    class Finishes(Component):
        Hand = Proxy("Hand", GripperPrx)

        def automaton(self) -> Automaton:
            states = [State(id=1, name="a"), State(id=2, name="b", final=True)]
            return automaton(1, "finishes", states, [after(0.2, 1, 2)])

    with Execution(Finishes(), stubs={"Hand": {"stop": None}}) as run:
        run.advance(0.1)
        assert run.calls() == []
        run.advance(1.0)
        assert run.finished
        assert [(call.time, call.target) for call in run.calls()] == [(0.2, "Hand.stop")]
        run.advance(1.0)
        assert len(run.calls()) == 1


@pytest.mark.parametrize("on_error", [None, "continue"])
def test_sys_exit_ends_it_and_stops_what_it_commanded(on_error: str | None) -> None:
    with Execution(leaving(lambda: sys.exit(3)), stubs={"Hand": {"stop": None}}, on_error=on_error) as run:
        with pytest.raises(BehaviorFailed, match=r"sys.exit\(3\) ends the component"):
            run.advance(1.0)
        assert (run.ended.is_set(), run.exit_code) == (True, 3)
        assert [call.target for call in run.calls()] == ["Hand.stop"]


@pytest.mark.parametrize("code", [lambda: sys.exit(3), lambda: 1 / 0], ids=["sys.exit", "an error"])
def test_what_ends_it_in_a_step_stops_what_it_commanded_and_lets_no_other_cycle_begin(
    code: Callable[[], object],
) -> None:
    class Steps(Component):
        Hand = Proxy("Hand", GripperPrx)

        def automaton(self) -> Automaton:
            child = automaton(2, "child", [State("x", code=lambda: ran.append("child"))])
            root = State("a", children=(child,), code=lambda: run.paused_by_client and code())
            return automaton(1, "steps", [root])

    ran: list[str] = []
    with Execution(Steps(), stubs={"Hand": {"stop": None}}, on_error="stop") as run:
        run.advance(0.1)
        run.pause()
        ran.clear()
        with suppress(BehaviorFailed):
            run.step(0)
        assert run.failed
        assert [call.target for call in run.calls()] == ["Hand.stop"]
        run.advance(1.0)
        assert (ran, len(run.calls())) == ([], 1)


def test_sys_exit_in_a_step_is_told_as_in_an_advance() -> None:
    with Execution(leaving(lambda: sys.exit(3)), stubs={"Hand": {"stop": None}}) as run:
        run.advance(0.1)
        run.pause()
        with pytest.raises(BehaviorFailed, match=r"sys.exit\(3\) ends the component"):
            run.step(0)


def test_an_exception_without_a_message_fails_as_any_other() -> None:
    class Speechless(Exception):
        def __str__(self) -> str:
            raise ValueError("no words")

    def code() -> None:
        raise Speechless

    with Execution(leaving(code), stubs={"Hand": {"stop": None}}, on_error="continue") as run:
        run.advance(1.0)
        assert (run.ended.is_set(), len(run.errors)) == (False, 1)
        assert "Speechless" in run.timeline
    with (
        Execution(leaving(code), stubs={"Hand": {"stop": None}}) as run,
        pytest.raises(BehaviorFailed, match="raised Speechless"),
    ):
        run.advance(1.0)


def test_sys_exit_with_what_cannot_be_shown_ends_it_too() -> None:
    class Speechless:
        def __repr__(self) -> str:
            raise ValueError("no words")

    speechless: Any = Speechless()
    with Execution(leaving(lambda: sys.exit(speechless)), stubs={"Hand": {"stop": None}}) as run:
        with pytest.raises(BehaviorFailed, match=r"sys.exit\(<Speechless.*ends the component"):
            run.advance(1.0)
        assert (run.ended.is_set(), run.exit_code, len(run.errors)) == (True, 1, 1)


def test_code_that_fails_while_it_is_closed_keeps_no_other_from_ending() -> None:
    def code(ends: BaseException) -> Callable[[], None]:
        def sleeps() -> None:
            try:
                run.component.sleep(60)
            finally:
                ended.append(ends)
                raise ends

        return sleeps

    ended: list[BaseException] = []
    ends = [asyncio.CancelledError(), ValueError()]
    below = [automaton(number, "x", [State("y", code=code(each))]) for number, each in enumerate(ends, 2)]
    with Execution(component(automaton(1, "root", [State("a", children=tuple(below))]))) as run:
        run.advance(0.1)
    assert ended == ends


def test_ctrl_c_in_a_cycle_does_not_end_the_cycles_of_its_automaton() -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    with Execution(leaving(interrupted), stubs={"Hand": {"stop": None}}) as run:
        with pytest.raises(KeyboardInterrupt):
            run.advance(1.0)
        run.advance(1.0)
        assert run.tree.root.cycle.count == 13


def test_a_task_that_fails_leaves_no_cycle_out() -> None:
    def fail() -> None:
        raise OSError("no camera")

    with Execution(leaving(lambda: None), stubs={"Hand": {"stop": None}}) as run:
        run.world.clock.call_at(0.3, fail)
        with pytest.raises(OSError, match="no camera"):
            run.advance(1.0)
        run.advance(0.2)
        assert run.tree.root.cycle.count == 6


@pytest.mark.parametrize(
    ("steer", "why"), [(Execution.pause, "is paused"), (Execution.request_stop, "has ended")]
)
def test_nobody_waits_for_what_a_paused_or_ended_one_will_not_do(
    steer: Callable[[Execution], None], why: str
) -> None:
    with Execution(Grasps(), stubs={"Hand": {"close": 1.0}}) as run:
        run.world.clock.call_at(0.25, lambda: steer(run))
        with pytest.raises(
            BehaviorFailed, match=rf"the state closed was not reached: at 0\.\d+ s the behavior {why} in "
        ):
            run.run_until("closed")
