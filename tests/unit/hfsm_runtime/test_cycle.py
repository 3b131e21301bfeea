"""One cycle, as a driver runs it: its measurements, and how it continues after a pause."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import pytest

from hfsm_runtime import Automaton, State, Transition
from hfsm_runtime._cycle import run_cycle
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor, Tree
from tests.support.automata import after, automaton, when

PERIOD = 100_000_000
"""Of the automata here, in ns."""


class Supervisor:
    """Says what time it is; user code sets it."""

    hand_over = 1.0
    halted = False

    def __init__(self) -> None:
        self.time = 0
        self.crashes: list[tuple[type[BaseException], bool]] = []

    def now(self) -> int:
        return self.time

    def heard(self, run: Actor, error: Exception) -> bool:
        return False

    def failed(self, run: Actor, error: Exception) -> None:
        raise error

    def crashed(self, run: Actor, error: BaseException) -> None:
        self.crashes.append((type(error), run.in_cycle))

    def succeeded(self, run: Actor) -> None:
        pass

    def left_early(self) -> None:
        raise AssertionError

    def skipped(self, run: Actor, transition: Transition) -> None:
        raise AssertionError(transition)

    def not_handed_over(self, run: Actor, late: list[Actor]) -> None:
        raise AssertionError(late)


class Rig:
    """An automaton that runs a cycle on request."""

    def __init__(self, root: Automaton) -> None:
        self.tree = Tree(root)
        self.run = self.tree.root
        self.supervisor = Supervisor()
        self.tree.start(0)

    def cycle(self, at: int = 0) -> str:
        """Run a cycle, and return the name of the state after it."""
        self.supervisor.time = at
        run_cycle(self.tree, self.run, at, self.supervisor)
        return self.run.current.name

    def takes(self, time: int) -> Callable[[], None]:
        """Return code with a duration."""

        def code() -> None:
            self.supervisor.time += time

        return code


class PauseIn(Observer):
    """Pauses whenever the state of a name is entered."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.entries = 0

    def entered(self, run: Actor, transition: Transition | None) -> bool:
        self.entries += 1
        return run.current.name == self.name


def working(seconds: int) -> Rig:
    """Return an automaton whose only state takes a number of ns per cycle."""
    rig: Rig
    rig = Rig(automaton(1, "root", [State(id=1, name="a", code=lambda: rig.takes(seconds)())]))
    return rig


def test_a_cycle_as_long_as_the_period_is_no_overrun() -> None:
    rig = working(PERIOD)
    rig.cycle()
    assert rig.run.cycle.overruns == 0


def test_a_longer_cycle_is_one() -> None:
    rig = working(PERIOD + 1)
    rig.cycle()
    assert rig.run.cycle.overruns == 1


@pytest.mark.parametrize("end", [SystemExit, KeyboardInterrupt])
def test_what_ends_the_component_is_handled_before_its_cycle_ends(end: type[BaseException]) -> None:
    def code() -> None:
        raise end

    rig = Rig(automaton(1, "root", [State(id=1, name="a", code=code)]))
    with pytest.raises(end):
        rig.cycle()
    assert (rig.supervisor.crashes, rig.run.in_cycle) == ([(end, True)], False)


def test_a_cycle_notes_how_long_it_took() -> None:
    rig = Rig(automaton(1, "root", [State(id=1, name="a", code=lambda: time.sleep(0.01))]))
    before = time.perf_counter()
    rig.cycle()
    assert 0.01 <= rig.run.cycle.last <= time.perf_counter() - before


def entering(taken: int, at: int = 0) -> Rig:
    """Return an automaton that entered a state with a timer of one period, and slow entry code, at a time."""
    rig: Rig
    states = [
        State(id=1, name="a"),
        State(id=2, name="b", entry=lambda: rig.takes(taken)()),
        State(id=3, name="c"),
    ]
    rig = Rig(automaton(1, "root", states, [when(lambda: True, 1, 2), after(0.1, 2, 3)]))
    rig.cycle(at)
    return rig


@pytest.mark.parametrize("at", [0, 7 * PERIOD])
def test_an_entry_shorter_than_a_period_takes_no_time(at: int) -> None:
    assert entering(PERIOD - 1, at).cycle(at + PERIOD) == "c"


def test_after_an_entry_as_long_as_a_period_the_timers_count_from_its_end() -> None:
    rig = entering(PERIOD)
    assert rig.cycle(PERIOD) == "b"
    assert rig.cycle(2 * PERIOD) == "c"


def paused_in(name: str) -> tuple[Rig, PauseIn, list[str]]:
    """Return an automaton that goes from a to b and to c, one a cycle, and pauses once; and what code ran."""
    ran: list[str] = []
    states = [
        State(id=number, name=letter, code=partial(ran.append, letter))
        for number, letter in enumerate("abc", 1)
    ]
    rig = Rig(automaton(1, "root", states, [when(lambda: True, 1, 2), when(lambda: True, 2, 3)]))
    pause = PauseIn(name)
    rig.tree.observers.append(pause)
    rig.cycle()
    return rig, pause, ran


def test_after_a_pause_where_a_transition_led_the_code_of_the_state_comes_first() -> None:
    rig, _, ran = paused_in("b")
    assert (rig.run.current.name, ran) == ("b", [])
    assert (rig.cycle(PERIOD), ran) == ("b", ["b"])


def test_the_cycle_after_that_asks_the_transitions_again() -> None:
    rig, _, ran = paused_in("b")
    rig.cycle(PERIOD)
    assert (rig.cycle(2 * PERIOD), ran) == ("c", ["b", "c"])


def test_after_a_pause_in_the_first_state_the_transitions_come_first() -> None:
    rig, _, ran = paused_in("a")
    assert (rig.run.current.name, ran) == ("a", [])
    assert (rig.cycle(PERIOD), ran) == ("b", ["b"])


def test_the_entry_after_a_transition_is_reported_once() -> None:
    rig, pause, _ = paused_in("none of them")
    assert pause.entries == 2, "of a, and of b"
    rig.cycle(PERIOD)
    rig.cycle(2 * PERIOD)
    assert pause.entries == 3, "and of c"
