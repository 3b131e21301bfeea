"""The order of cycles on threads: by their times, and of cycles due at one time the ancestors' first.

It concerns automata one below the other: the upper one decides whether the lower one is active, and may wait
until that has finished. Virtual time has the same order. Each thread asks whether it is its turn. A cycle
follows another as soon as that has decided which transition fires: the code of states runs side by side.

A late thread may hold the others up, code that hangs must not: a cycle that lasts longer than a period, its
own or that of the automaton that waits, and longer than 0.1 s, is not waited for any more.
"""

from __future__ import annotations

from typing import Final

from .automaton_run import Run
from .timeline import slot_at

_PATIENCE: Final = 100_000_000
"""How long a cycle may last in ns, however short the periods are: a busy machine may interrupt it."""


def turn_of(run: Run, now: int, latest: int) -> int | Run:
    """Return the time of the next cycle of an automaton if it is its turn, or else whose turn it is.

    The cycle is due. Its time is at most `latest`; of slots that were missed, the last one counts that comes
    before the next cycles of the automata above.
    """
    first = above = run.parent
    while above is not None:
        if above.next_slot <= latest and not _lasts_too_long(above, run, now):
            first, latest = above, above.next_slot - 1
        above = above.parent
    if latest < run.next_slot:
        assert first is not None
        return first
    late = _late_below(run, run, now) if run.automaton.outgoing(run.current) else None
    return late or max(run.next_slot, slot_at(latest, run.automaton.interval))


def patience(run: Run, first: Run) -> int:
    """Return how long a running cycle may last for which the one of `run` waits, in ns."""
    return max(_PATIENCE, min(run.automaton.interval, first.automaton.interval))


def _late_below(run: Run, waiting: Run, now: int) -> Run | None:
    """Return an active automaton below the state of `run` whose cycle is due before that of `waiting`."""
    for child in run.below:
        if not child.active or child.finished:
            continue
        if child.next_slot < waiting.next_slot and not _lasts_too_long(child, waiting, now):
            return child
        late = _late_below(child, waiting, now)
        if late is not None:
            return late
    return None


def _lasts_too_long(first: Run, run: Run, now: int) -> bool:
    began = first.began
    return began is not None and now - began >= patience(run, first)
