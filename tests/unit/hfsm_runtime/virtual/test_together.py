"""Several components on one clock: each does what it does alone, and what one does to itself hurts no other."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing

from hfsm_runtime import State
from hfsm_runtime.virtual import Execution, VirtualWorld
from hfsm_runtime.virtual.clock import TaskClock
from hfsm_runtime.virtual.together import Together
from tests.support.automata import after, automaton, component

Log = list[tuple[str, float]]


class _Lone(Execution):
    """Two automata, of which the lower one sleeps, and whose states change every `period` s."""

    def __init__(
        self, name: str, log: Log, clock: TaskClock, period: float = 0.45, work: object = None
    ) -> None:
        def sleep() -> None:
            log.append((f"{name} begins", self.time))
            if callable(work):
                work(self)
            self.component.sleep(0.25)
            log.append((f"{name} goes on", self.time))

        child = automaton(2, "child", [State(id=1, name="c", code=sleep)], [])
        states = [State(id=1, name="a", children=(child,)), State(id=2, name="b")]
        root = automaton(1, "root", states, [after(period, 1, 2), after(period, 2, 1)])
        super().__init__(component(root), VirtualWorld(clock))


def ignore(number: int, error: Exception) -> None:
    raise AssertionError(f"{number}: {error}")


def played(make: Callable[[Log, TaskClock], list[_Lone]], seconds: float = 4.0) -> list[Log]:
    """Return what each of some executions notes and how it changes, when they run together."""
    log: Log = []
    clock = TaskClock()
    runs = make(log, clock)
    together = Together(clock)
    together.runs = runs
    for _ in range(round(seconds / 0.1)):
        together.advance(0.1, ignore)
    changes = [run.changes("root") + run.changes("child") for run in runs]
    for run in runs:
        run.close()
    return [[(state, time) for time, state in each] for each in changes] + [log]


def test_each_does_what_it_does_alone() -> None:
    red, blue, log = played(lambda log, clock: [_Lone("red", log, clock), _Lone("blue", log, clock, 0.7)])
    alone: Log = []
    clock = TaskClock()
    with _Lone("red", alone, clock) as run:
        run.advance(4.0)
        assert red == [(state, time) for time, state in run.changes("root") + run.changes("child")]
    assert [each for each in log if each[0].startswith("red")] == alone
    other: Log = []
    with _Lone("blue", other, TaskClock(), 0.7) as run:
        run.advance(4.0)
        assert blue == [(state, time) for time, state in run.changes("root") + run.changes("child")]
    assert [each for each in log if each[0].startswith("blue")] == other


def test_the_same_again() -> None:
    def make(log: Log, clock: TaskClock) -> list[_Lone]:
        return [_Lone("red", log, clock), _Lone("blue", log, clock, 0.7)]

    assert played(make) == played(make)


def test_one_that_fails_says_which_it_is_and_the_others_go_on() -> None:
    log: Log = []
    clock = TaskClock()

    def late(run: Execution) -> None:
        if run.time > 1.0:
            raise ZeroDivisionError

    failures: list[int] = []
    turns: list[int | None] = []
    together = Together(clock, turns.append)
    with closing(_Lone("red", log, clock, work=late)) as red, closing(_Lone("blue", log, clock)) as blue:
        together.runs = runs = [red, blue]

        def failed(number: int, _: Exception) -> None:
            failures.append(number)
            together.runs = [None if at == number else run for at, run in enumerate(runs)]

        together.advance(3.0, failed)
        assert failures == [0]
        assert blue.time == 3.0
        assert len(blue.changes("root")) == 7
        assert {0, 1, None} == set(turns)


def test_the_end_of_one_does_not_end_the_code_of_another_that_sleeps() -> None:
    log: Log = []
    clock = TaskClock()
    together = Together(clock)
    with closing(_Lone("red", log, clock)) as red, closing(_Lone("blue", log, clock)) as blue:
        together.runs = [red, blue]
        together.advance(0.1, ignore)  # both sleep
        together.runs = [None, blue]
        red.close()
        together.advance(0.3, ignore)
    assert ("blue goes on", 0.25) in log
    assert ("red goes on", 0.25) not in log
