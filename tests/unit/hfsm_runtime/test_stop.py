"""What a component that lives on stops: the servants that exit code names, if the exit code failed."""

from __future__ import annotations

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State
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
