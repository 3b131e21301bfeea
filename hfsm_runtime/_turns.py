"""The order of cycles on threads: by their times, and of cycles due at one time the ancestors' first.

Only automata of which one is below the other are ordered: the upper one decides whether the lower one is
active, and may wait until that has finished. Virtual time has the same order.

Before its cycle, each thread asks whether it is its turn. It waits until an earlier cycle has decided which
transition fires, and not for the code of its state, which runs side by side with others. It does not wait for
a cycle that can change nothing because no timer has expired. An automaton that takes the outputs of another
one waits for the end of the other one's earlier cycles.

A thread that is late may hold the others up; code that hangs must not. Nobody waits for a cycle that lasts
longer than 0.1 s and longer than a period, its own or that of the automaton that waits. An automaton waits
for late ones below it for at most one period, or 0.1 s if that is longer.
"""

from __future__ import annotations

from typing import Final

from ._actor import Actor
from ._timeline import slot_at

_LEAST_WAIT: Final = 100_000_000
"""The least wait in ns, however short the periods are: a busy machine may interrupt a cycle."""


def turn_of(actor: Actor, now: int, latest: int) -> int | Actor:
    """Return the time of the next cycle of an automaton if it is its turn, or else whose turn it is.

    The cycle is due, and its time is at most `latest`. A thread that was late for several slots makes up for
    none of them: it takes the last one that is still before the next cycle of each automaton above. While it
    waits for late automata below, it takes none that is after their next cycles, either.
    """
    first = above = actor.parent
    while above is not None:
        if (
            above.cycle.next_slot <= latest
            and above.may_change(latest)
            and not _lasts_too_long(above, actor, now)
        ):
            first, latest = above, above.cycle.next_slot - 1
        above = above.parent
    if latest < actor.cycle.next_slot:
        assert first is not None
        return first
    at, interval = actor.cycle.next_slot, actor.automaton.interval
    waits = bool(actor.children) and now - at < patience(actor, actor)
    if latest - at >= interval:
        at = slot_at(_soonest_below(actor, latest, actor, now) if waits else latest, interval)
    if waits and actor.may_change(at):
        return _late_below(actor, actor, now) or at
    return at


def patience(actor: Actor, first: Actor) -> int:
    """Return how long a running cycle may last for which the one of `actor` waits, in ns."""
    return max(_LEAST_WAIT, min(actor.automaton.interval, first.automaton.interval))


def _late_below(actor: Actor, waiting: Actor, now: int) -> Actor | None:
    """Return an active automaton below the state of `actor` whose cycle is due before that of `waiting`."""
    for child in reversed(actor.below):  # the last one will probably be the last to wake
        if not child.active or child.finished:
            continue
        late = _late_below(child, waiting, now)
        if late is not None:
            return late
        due = child.cycle.next_slot < waiting.cycle.next_slot and child.may_change(waiting.cycle.next_slot)
        due |= actor is waiting and child.hands_up and child.cycle.began is not None
        if due and not _lasts_too_long(child, waiting, now):
            return child
    return None


def _soonest_below(actor: Actor, latest: int, waiting: Actor, now: int) -> int:
    """Return the first time up to `latest` of a cycle below the state of `actor` that may change anything.

    It is not before the next cycle of `waiting`.
    """
    soonest = latest
    for child in actor.below:
        if child.active and not child.finished:
            soonest = _soonest_below(child, soonest, waiting, now)
            if child.may_change(latest) and not _lasts_too_long(child, waiting, now):
                soonest = min(soonest, max(child.cycle.next_slot, waiting.cycle.next_slot))
    return soonest


def _lasts_too_long(first: Actor, actor: Actor, now: int) -> bool:
    began = first.cycle.began
    return began is not None and now - began >= patience(actor, first)
