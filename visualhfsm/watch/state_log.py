"""What happened to the states of a component, made out from its snapshots."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

from interfaces.hfsm import AutomatonSnapshot, ComponentSnapshot

__all__ = ["Change", "Span", "StateLog"]

_LONGEST: Final = 5_000
"""Changes of state and spans kept."""
_MOST_AUTOMATA: Final = 10_000
"""Automata that are told apart; of more, those that are gone are forgotten."""


@dataclass(slots=True)
class Span:
    """A time during which an automaton stayed in one state, running or as a ghost."""

    automaton: int
    state: int
    ghost: bool
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Change:
    """A change of state, at the component time at which the new state was entered."""

    time: float
    automaton: int
    origin: int
    destination: int
    transition: int


class StateLog:
    """Changes of state and the spans between them, the newest of each. Not thread safe."""

    def __init__(self) -> None:
        self.changes: deque[Change] = deque(maxlen=_LONGEST)
        self.spans: deque[Span] = deque(maxlen=_LONGEST)
        self._open: dict[int, Span] = {}
        self._last: dict[int, AutomatonSnapshot] = {}
        self._before = math.inf

    def add(self, snapshot: ComponentSnapshot) -> bool:
        """Take a snapshot that is newer than the last; return whether a state or a ghost has changed."""
        changed = False
        for automaton in snapshot.automata:
            self._note_change(automaton)
            changed = self._note_span(automaton, snapshot.time) or changed
            self._last[automaton.id] = automaton
        self._before = snapshot.time
        if len(self._last) > max(_MOST_AUTOMATA, len(snapshot.automata)):
            here = {automaton.id for automaton in snapshot.automata}
            self._last = {number: last for number, last in self._last.items() if number in here}
            self._open = {number: span for number, span in self._open.items() if number in here}
        return changed

    def _note_change(self, automaton: AutomatonSnapshot) -> None:
        last = self._last.get(automaton.id)
        if last is None or (last.state, last.enteredAt) == (automaton.state, automaton.enteredAt):
            return
        if automaton.lastTransition == 0:  # first entered now: it was a ghost from the beginning
            return
        change = Change(
            automaton.enteredAt, automaton.id, last.state, automaton.state, automaton.lastTransition
        )
        self.changes.append(change)

    def _note_span(self, automaton: AutomatonSnapshot, now: float) -> bool:
        span = self._open.get(automaton.id)
        if span is not None and (span.state, span.ghost) == (automaton.state, automaton.ghost):
            span.end = now
            return False
        # When a state was entered is told exactly; when a ghost came alive, only by the next snapshot.
        start = automaton.enteredAt if self._before < automaton.enteredAt <= now else now
        if span is not None:
            span.end = start
        self._open[automaton.id] = Span(automaton.id, automaton.state, automaton.ghost, start, now)
        self.spans.append(self._open[automaton.id])
        return True
