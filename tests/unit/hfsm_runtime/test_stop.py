"""What a component that lives on stops: everything, if exit code failed or cannot run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from hfsm_runtime import Automaton, Component, Input, Proxy, State
from hfsm_runtime.virtual import Execution
from interfaces.jderobot import InvalidValueException
from tests.support.automata import after, automaton
from tests.support.gripper import GripperPrx
from zenoh_ice import ConnectionLostException

FAILURES = [ConnectionLostException("offline"), InvalidValueException("not that"), ValueError("a mistake")]


class Lifts(Component, document="lifts.xml"):
    """Its exit code greets, and then lets go."""

    Hand = Proxy("Hand", GripperPrx)
    Other = Proxy("Other", GripperPrx)
    Voice = Proxy("Voice", GripperPrx)

    def automaton(self) -> Automaton:
        states = [State("lift", exit=self.leave), State("rest")]
        return automaton(1, "lifts", states, [after(0.1, 1, 2)])

    def leave(self) -> None:
        self.Voice.close(1.0)
        self.let_go()

    def let_go(self) -> None:
        self.Hand.stop()


def stopped(failure: Exception | None, *, on_error: str = "continue") -> list[str]:
    """Return which servants are stopped when the servant of the greeting fails in this way."""
    stopped: list[str] = []
    stubs = {
        name: {"close": failure or 1.0, "stop": lambda name=name: stopped.append(name)}
        for name in ("Hand", "Other", "Voice")
    }
    with Execution(Lifts(), stubs=stubs, on_error=on_error) as run:
        run.advance(0.1)
        assert run.state("lifts") == "rest"
        return sorted(stopped)


@pytest.mark.parametrize("failure", FAILURES, ids=lambda failure: type(failure).__name__)
def test_everything_is_stopped_when_exit_code_fails(failure: Exception) -> None:
    assert stopped(failure) == ["Hand", "Other", "Voice"]


def test_exit_code_that_succeeds_stops_what_it_says() -> None:
    assert stopped(None) == ["Hand"]


def test_all_is_stopped_when_the_error_ends_the_component() -> None:
    assert set(stopped(ValueError("a mistake"), on_error="stop")) == {"Hand", "Other", "Voice"}


class Hands(Component):
    """Its automata are made by a test."""

    Hand = Proxy("Hand", GripperPrx)


def stops(make: Callable[[Hands], Automaton]) -> list[str]:
    """Return the calls that stop something within a second."""

    class Made(Hands):
        def automaton(self) -> Automaton:
            return make(self)

    with Execution(Made(), stubs={"Hand": {"stop": None, "close": 1.0}}, on_error="continue") as run:
        run.advance(1.0)
        return [call.target for call in run.calls() if call.target.endswith("stop")]


def left_early(below: Automaton) -> Automaton:
    """Return automata of which one leaves its state while code below it still sleeps."""
    states = [State("a", restart=True, children=(below,)), State("b")]
    return automaton(1, "above", states, [after(0.2, 1, 2)])


@pytest.mark.parametrize("piece", ["entry", "arguments"])
def test_everything_is_stopped_when_the_entry_did_not_end(piece: str) -> None:
    def make(hands: Hands) -> Automaton:
        def sleep() -> dict[str, object]:
            hands.sleep(60)
            return {}

        inner = automaton(3, "inner", [State("c")], inputs=(Input(name="n", type=int, default=0),))
        code: dict[str, Any] = {"entry": lambda: hands.Hand.close(1.0), piece: sleep}
        lift = replace(State("lift", exit=lambda: None, children=(inner,)), **code)
        return left_early(automaton(2, "below", [lift]))

    assert stops(make) == ["Hand.stop"]


def test_nothing_is_stopped_for_a_state_whose_entry_did_not_begin() -> None:
    def make(hands: Hands) -> Automaton:
        lift = State("lift", entry=lambda: hands.Hand.close(1.0), exit=lambda: hands.Hand.stop())
        leave = after(0.1, 1, 2, lambda: hands.sleep(60))
        return left_early(automaton(2, "below", [State("wait"), lift], [leave]))

    assert stops(make) == []
