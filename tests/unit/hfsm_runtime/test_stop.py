"""What a component that lives on stops: the servants that exit code names, if the exit code failed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
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
def test_what_exit_code_names_is_stopped_when_it_fails(failure: Exception) -> None:
    assert stopped(failure) == ["Hand", "Voice"]


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


def by_comprehension(hands: Hands) -> Callable[[], object]:
    return lambda: [1 // each or hands.Hand.stop() for each in range(2)]


def by_lambda(hands: Hands) -> Callable[[], object]:
    return lambda: [hold() for hold in (lambda: 1 // 0, lambda: hands.Hand.stop())]


def by_variable(hands: Hands) -> Callable[[], object]:
    def let_go(force: int) -> None:
        hands.Hand.stop()

    return lambda: let_go(1 // 0)


def by_another_name(hands: Hands) -> Callable[[], object]:
    hand = hands.Hand
    return lambda: 1 // 0 or hand.stop()


def by_an_attribute(hands: Hands) -> Callable[[], object]:
    vars(hands)["mine"] = {"hands": [hands.Hand.stop]}
    return lambda: 1 // 0 or hands.mine["hands"][0]()  # type: ignore[attr-defined]


def by_a_text(hands: Hands) -> Callable[[], object]:
    return lambda: 1 // 0 or [getattr(hands, name).stop() for name in ("Hand",)]


def by_a_part_of_a_text(hands: Hands) -> Callable[[], object]:
    return lambda: 1 // 0 or getattr(hands, f"{'h'.upper()}and").stop()


def by_functions_of_other_kinds(hands: Hands) -> Callable[[], object]:
    let_go = partial(lru_cache(staticmethod(lambda hands: hands.Hand.stop())), hands)
    return lambda: 1 // 0 or let_go()


@pytest.mark.parametrize(
    "leave",
    [
        *(by_comprehension, by_lambda, by_variable, by_another_name, by_an_attribute, by_a_text),
        *(by_a_part_of_a_text, by_functions_of_other_kinds),
    ],
)
def test_what_functions_of_exit_code_name_is_stopped(leave: Callable[[Hands], Callable[[], object]]) -> None:
    def make(hands: Hands) -> Automaton:
        return automaton(1, "hands", [State("lift", exit=leave(hands)), State("rest")], [after(0.1, 1, 2)])

    assert stops(make) == ["Hand.stop"]


def left_early(below: Automaton) -> Automaton:
    """Return automata of which one leaves its state while code below it still sleeps."""
    states = [State("a", restart=True, children=(below,)), State("b")]
    return automaton(1, "above", states, [after(0.2, 1, 2)])


@pytest.mark.parametrize("piece", ["entry", "arguments"])
def test_what_exit_code_names_is_stopped_when_the_entry_did_not_end(piece: str) -> None:
    def make(hands: Hands) -> Automaton:
        def sleep() -> dict[str, object]:
            hands.sleep(60)
            return {}

        inner = automaton(3, "inner", [State("c")], inputs=(Input(name="n", type=int, default=0),))
        code: dict[str, Any] = {"entry": lambda: hands.Hand.close(1.0), piece: sleep}
        lift = replace(State("lift", exit=lambda: hands.Hand.stop(), children=(inner,)), **code)
        return left_early(automaton(2, "below", [lift]))

    assert stops(make) == ["Hand.stop"]


def test_nothing_is_stopped_for_a_state_whose_entry_did_not_begin() -> None:
    def make(hands: Hands) -> Automaton:
        lift = State("lift", entry=lambda: hands.Hand.close(1.0), exit=lambda: hands.Hand.stop())
        wait = State("wait", exit=lambda: hands.sleep(60))
        return left_early(automaton(2, "below", [wait, lift], [after(0.1, 1, 2)]))

    assert stops(make) == []
