"""The cycle of an automaton: the one function that both drivers, threads and virtual time, run."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final, Protocol

from .automaton import Transition
from .errors import ComponentStoppedError
from .tree import Run, Tree

__all__ = ["CycleEnded", "Supervisor", "run_cycle"]

HAND_OVER: Final = 1.0
"""The longest wait in s of wall time for the cycles below a state that is left."""


class CycleEnded(Exception):
    """Raised by a supervisor to skip what is left of a cycle; no error by itself."""


class Supervisor(Protocol):
    """What a cycle asks of its surroundings."""

    def now(self) -> int:
        """Return the component time in ns."""

    def failed(self, run: Run, error: Exception) -> None:
        """Take an exception of user code; raises CycleEnded when the cycle is not to go on."""

    def succeeded(self, run: Run) -> None:
        """Take notice of a cycle that went through to its end."""

    def not_handed_over(self, run: Run, late: list[Run]) -> None:
        """Take notice that automata below a state that was left are still in a cycle."""


def run_cycle(tree: Tree, run: Run, now: int, supervisor: Supervisor) -> bool:
    """Run one cycle of an automaton, which belongs to the component time `now`; false for a ghost.

    Transitions out of the current state are tried in their order, and the first that holds fires: the
    automata below the old state become ghosts and end their running cycles, then the transition's code runs,
    then the timers of the new state start and the automata below it wake. At last the code of the current
    state runs. What takes no longer than the period counts as if it took no time, so that timers keep to the
    schedule of the cycles.
    """
    if not tree.begin_cycle(run):
        return False
    began, began_wall = supervisor.now(), time.perf_counter()
    try:
        transition = _first_that_holds(run, now, supervisor)
        if transition is not None:
            _fire(tree, run, transition, now, supervisor)
        if run.active and run.current.code is not None:
            _call(run, run.current.code, supervisor)
        supervisor.succeeded(run)
    except CycleEnded:
        pass
    except ComponentStoppedError:
        return False
    finally:
        run.cycles += 1
        run.last_cycle = time.perf_counter() - began_wall
        run.longest_cycle = max(run.longest_cycle, run.last_cycle)
        run.overruns += supervisor.now() - began > run.automaton.interval
        tree.end_cycle(run)
    return True


def _first_that_holds(run: Run, now: int, supervisor: Supervisor) -> Transition | None:
    forced, run.forced = run.forced, None
    if forced is not None and forced.origin == run.current.id:
        return forced
    for transition in run.automaton.outgoing(run.current):
        if transition.delay is not None:
            holds = run.active_time(now) >= transition.delay
        else:
            assert transition.guard is not None, "a transition has either a time or a guard"
            holds = bool(_call(run, transition.guard, supervisor))
            run.guards[transition.id] = holds
        if holds:
            return transition
    return None


def _fire(tree: Tree, run: Run, transition: Transition, now: int, supervisor: Supervisor) -> None:
    left = run.current
    if not tree.leave(run, transition, now):
        return
    try:
        late = tree.wait_for_cycles(left, run, HAND_OVER)
        if late:
            supervisor.not_handed_over(run, late)
        if transition.code is not None:
            _call(run, transition.code, supervisor)
    finally:
        ended = supervisor.now()
        tree.enter(run, now if ended < now + run.automaton.interval else ended)


def _call(run: Run, code: Callable[[], object], supervisor: Supervisor) -> object:
    """Return what a piece of user code returns, or None when it failed and the cycle is to go on."""
    try:
        return code()
    except Exception as error:  # noqa: BLE001 - anything may come out of user code; the supervisor tells it
        supervisor.failed(run, error)
        return None
