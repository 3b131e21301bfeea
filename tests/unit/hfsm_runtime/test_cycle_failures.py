"""Each cell of the table of what follows when code of a document fails, in virtual time and on threads.

In `make test` each pair of what is raised, where, before which state and with which policy; all cells in `make soak`.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import astuple
from itertools import combinations
from pathlib import Path

import pytest

from hfsm_runtime._component_run import ComponentRun
from hfsm_runtime._recording.run import RecordedRuntime, recording
from hfsm_runtime._replay.run import Replay
from hfsm_runtime._replay.script import Recording
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.errors import OnError
from hfsm_runtime.tree import Actor
from hfsm_runtime.virtual import BehaviorFailed, Execution
from tests.support.failures import ERRORS, EXIT_CODES, Cell, Ends, Failing, Raised, cells
from tests.support.fast_clock import FastClock
from tests.support.soak import cases
from tests.support.waiting import until

FOREVER = 10**18  # ns
CELLS = [*cells()]


def pairwise(every: list[Cell]) -> list[Cell]:
    """Return cells that have each pair of values which any cell has: always the same, and few."""
    pairs = {cell: {*combinations(enumerate(astuple(cell)), 2)} for cell in every}
    missing, chosen = {pair for each in pairs.values() for pair in each}, []
    while missing:
        chosen.append(max(every, key=lambda cell: len(missing & pairs[cell])))
        missing -= pairs[chosen[-1]]
    return chosen


PAIRWISE = pairwise(CELLS)
CHOSEN = cases(PAIRWISE, [cell for cell in CELLS if cell not in PAIRWISE])
TOLD = {Raised.ERROR, Raised.DECLARED, Raised.LOST, Raised.REFUSED, Raised.CUT}
"""What is told when code of a transition does not run for it; by others the component ends."""


def walk(run: ComponentRun) -> Actor:
    """Return the automaton whose code fails."""
    return next(actor for actor in run.tree.actors if actor.automaton.name == "walk")


def check(failing: Failing, run: ComponentRun, warnings: list[str], *, has_ended: bool) -> None:
    """Compare what ran, where it led and what was told with the table."""
    cell = failing.cell
    assert failing.ran == cell.expected
    assert walk(run).current.name == cell.last_state
    assert len(run.errors) == ERRORS[cell.raised]
    is_over = cell.ends is Ends.COMPONENT
    assert has_ended == (is_over or (cell.next.is_final and cell.last_state == "b"))
    assert run.exit_code == (EXIT_CODES[cell.raised] if is_over else 0)
    if not (is_over or cell.raised is Raised.HEARD):
        assert failing.inner_ran == (cell.next.has_children and not cell.next.is_final)
    elif is_over and cell.piece != "code b":  # before it, those below the state have not begun
        assert not failing.inner_ran
    skips = cell.piece.startswith("exit") and cell.ends is not Ends.PIECE and cell.raised in TOLD
    assert skips == any("the code of the transition go does not run" in each for each in warnings)


@pytest.mark.parametrize("cell", CHOSEN, ids=str)
def test_in_virtual_time(cell: Cell, caplog: pytest.LogCaptureFixture) -> None:
    failing = Failing(cell)
    with Execution(failing.component(), on_error=cell.policy) as run:
        failing.run = run
        with suppress(BehaviorFailed):
            for _ in range(10):  # four suffice: after them nothing more runs
                run.advance(0.1)
                run.resume()
        check(failing, run, caplog.messages, has_ended=run.ended.is_set())


def goes_on(run: Runtime) -> bool:
    """Return whether a run is over; one that pauses goes on."""
    if run.component_time.paused and not run.in_cycle:
        run.resume()
    return run.ended.is_set() or walk(run).current.name == "c"


@pytest.mark.parametrize("cell", CHOSEN, ids=str)
def test_on_threads(cell: Cell, caplog: pytest.LogCaptureFixture) -> None:
    failing = Failing(cell)
    run = failing.run = Runtime(failing.component(), FastClock(), OnError(cell.policy))
    run.start()
    try:
        until(lambda: goes_on(run), step=0.001)
        has_ended = run.ended.is_set()
    finally:
        run.stop()
    check(failing, run, caplog.messages, has_ended=has_ended)


@pytest.mark.parametrize("cell", CHOSEN, ids=str)
def test_in_a_replay(cell: Cell, tmp_path: Path) -> None:
    failing = Failing(cell)
    component = failing.component()
    with recording(component, tmp_path / "run.mcap") as recorder:
        run = failing.run = RecordedRuntime(component, FastClock(), recorder, on_error=OnError(cell.policy))
        run.start()
        try:
            until(lambda: goes_on(run), step=0.001)
        finally:
            run.stop()
    again = Failing(cell)
    with Replay(Recording(tmp_path / "run.mcap"), again.component, FOREVER) as replay:
        comparison = replay.run()
    assert again.lines == failing.lines
    assert (comparison.divergences, comparison.differences) == ([], [])
    assert walk(replay.virtual).current.name == cell.last_state
