"""What one automaton can do by itself: the transitions out of each state, and when they fire at the earliest.

Times are active time in ns since the automaton began.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import Final

from .guards import Conjunction, satisfy
from .model import AutomatonModel, StateModel, TransitionModel

__all__ = ["Rhythm", "Solitary", "Surroundings", "examine"]

_FINISHED: Final = "children finished"
"""The atom that stands for `the children have finished`."""

_Entry = tuple[int, bool]
"""A state, and whether the automaton began in it; else a transition led there."""

_Candidates = list[tuple[TransitionModel, Conjunction]]


class Rhythm(Enum):
    """At which active times in a state there are cycles."""

    REGULAR = "regular"
    """At multiples of the period, and at 0 where the automaton began."""
    SHIFTED = "shifted"
    """As regular ones, but that the first comes at any time within a period where the automaton began."""
    ANY = "any"
    """At any times."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What others do: automata that may have `finished`, `events` that may come, and the `lifetime`.

    An automaton runs no cycle at its lifetime or later, None for one without an end.
    """

    finished: frozenset[int]
    events: frozenset[str]
    lifetime: int | None = None


@dataclass
class Solitary:
    """What an automaton can do: when its `transitions` fire at the earliest, when its `entries` are."""

    automaton: AutomatonModel
    transitions: dict[int, int] = field(default_factory=dict)
    entries: dict[_Entry, int] = field(default_factory=dict)
    stays: dict[_Entry, int] = field(default_factory=dict)
    """How long it stays in a state at most, for states that are always left."""

    @cached_property
    def states(self) -> frozenset[int]:
        """The states that it may enter."""
        return frozenset(state for state, _ in self.entries)

    @cached_property
    def resting(self) -> frozenset[int]:
        """The states in which it may stay as long as it likes."""
        return frozenset(entry[0] for entry in self.entries if entry not in self.stays)

    @cached_property
    def stuck(self) -> frozenset[int]:
        """The states, none of them final, that it never leaves."""
        left = {item.origin for item in self.automaton.transitions if item.index in self.transitions}
        return frozenset(state for state in self.states - left if not self.automaton.states[state].final)

    @cached_property
    def recurrent(self) -> frozenset[int]:
        """The states that it may enter again and again, without the end of any children."""
        targets: dict[int, set[int]] = {}
        for transition in self.automaton.transitions:
            if transition.index in self.transitions and not transition.finished:
                targets.setdefault(transition.origin, set()).add(transition.target)
        return frozenset(
            state for state in self.states if state in _reach(targets.get(state, set()), targets)
        )

    def longest(self, state: int, lifetime: int | None) -> int | None:
        """Return how long it may be in a state without a break, None for ever."""
        stays: list[int] = []
        for entry, time in self.entries.items():
            if entry[0] == state:
                ends = [*([self.stays[entry]] if entry in self.stays else [])]
                ends += [lifetime - time] if lifetime is not None else []
                if not ends:
                    return None
                stays.append(min(ends))
        return max(stays, default=0)


def _reach(starts: set[int], targets: dict[int, set[int]]) -> set[int]:
    found = set(starts)
    new = list(found)
    while new:
        for target in targets.get(new.pop(), ()):
            if target not in found:
                found.add(target)
                new.append(target)
    return found


def examine(automaton: AutomatonModel, rhythm: Rhythm, surroundings: Surroundings) -> Solitary:
    """Return what an automaton can do in a rhythm.

    It is all that it can do, except for a SHIFTED rhythm: there it is what it can do for certain.
    """
    found = Solitary(automaton)
    first = (automaton.initial, True)
    found.entries[first] = 0
    waiting = [(0, first)]
    while waiting:
        time, entry = heapq.heappop(waiting)
        if found.entries[entry] < time:
            continue
        for moment, transition in _out_of(found, entry, rhythm, surroundings):
            fires = time + moment
            if surroundings.lifetime is not None and fires >= surroundings.lifetime:
                continue
            if fires < found.transitions.get(transition.index, fires + 1):
                found.transitions[transition.index] = fires
            target = (transition.target, False)
            if fires < found.entries.get(target, fires + 1):
                found.entries[target] = fires
                heapq.heappush(waiting, (fires, target))
    return found


def _out_of(
    found: Solitary, entry: _Entry, rhythm: Rhythm, surroundings: Surroundings
) -> Iterator[tuple[int, TransitionModel]]:
    """Yield the transitions that can fire out of a state, with the earliest active time in it."""
    state = found.automaton.states[entry[0]]
    if state.final:
        return
    candidates = [
        (transition, needs)
        for transition in state.outgoing
        if (needs := _needs(transition, state, surroundings)) is not None
    ]
    told: set[int] = set()
    for moment, certain in _moments(candidates, found.automaton.interval, rhythm, entry[1]):
        enabled = [(transition, needs) for transition, needs in candidates if transition.delay <= moment]
        for place, (transition, needs) in enumerate(enabled if certain else ()):
            if transition.index in told:
                continue
            if satisfy(needs, (other for _, other in enabled[:place])) is not None:
                told.add(transition.index)
                yield moment, transition
        if satisfy((), (needs for _, needs in enabled)) is None:  # something fires here at the latest
            found.stays.setdefault(entry, moment)
            if rhythm is not Rhythm.ANY:
                return


def _needs(transition: TransitionModel, state: StateModel, surroundings: Surroundings) -> Conjunction | None:
    if transition.needs is None or (transition.event and transition.event not in surroundings.events):
        return None
    if not transition.finished:
        return transition.needs
    if not state.children or not surroundings.finished.issuperset(state.children):
        return None
    return ((_FINISHED, True), *transition.needs)


def _moments(candidates: _Candidates, period: int, rhythm: Rhythm, began: bool) -> Iterator[tuple[int, bool]]:
    """Yield an active time from each interval between delays, and whether it certainly has a cycle."""
    times = sorted({0, *(transition.delay for transition, _ in candidates)})
    for place, time in enumerate(times):
        end = times[place + 1] if place + 1 < len(times) else None
        if rhythm is Rhythm.ANY:
            yield time, True
        elif rhythm is Rhythm.SHIFTED and began:
            yield time, end is None or end - time >= period
        else:
            moment = -(-time // period) * period
            if moment == 0 and not began:
                moment = period
            if end is None or moment < end:
                yield moment, True
