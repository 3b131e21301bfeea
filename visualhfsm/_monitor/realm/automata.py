"""The automata of a component as a tree, their part of a snapshot, and their changes of state."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from interfaces import hfsm
from zenoh_ice.data.text import printable

_DEEPEST_AUTOMATON: Final = 64
"""Levels of automata that are shown; codegen makes no more."""
_LONGEST_LOG: Final = 5_000
"""Changes of state and spans kept."""
_LONGEST_NUMBER: Final = 40
_TRUTHS: Final = {"True": 1.0, "False": 0.0}


class Automata:
    """Find automata, states and transitions by id; unknown ids get a name that shows them."""

    def __init__(self, structure: hfsm.ComponentStructure) -> None:
        _clean(structure)
        self.structure = structure
        self.name = structure.name
        self.all: Sequence[hfsm.AutomatonStructure] = tuple(structure.automata)
        self._by_id = {automaton.id: automaton for automaton in self.all}
        self._states = {(a.id, state.id): state for a in self.all for state in a.states}
        self._transitions = {
            (a.id, transition.id): transition for a in self.all for transition in a.transitions
        }

    def fit(self, snapshot: hfsm.ComponentSnapshot) -> bool:
        """Return whether a snapshot is of these automata, and not of those after a reload."""
        return snapshot.generation == self.structure.generation and all(
            automaton.id in self._by_id for automaton in snapshot.automata
        )

    def automaton(self, automaton: int) -> hfsm.AutomatonStructure | None:
        """Return an automaton, or None when the component has none of this id."""
        return self._by_id.get(automaton)

    def automaton_name(self, automaton: int) -> str:
        """Return the name of the state that owns an automaton, or of the component for the root."""
        found = self._by_id.get(automaton)
        return found.name if found else f"automaton {automaton}"

    def state_name(self, automaton: int, state: int) -> str:
        """Return the name of a state."""
        found = self._states.get((automaton, state))
        return found.name if found else f"state {state}"

    def transition(self, automaton: int, transition: int) -> hfsm.TransitionStructure | None:
        """Return a transition, or None when the automaton has none of this id."""
        return self._transitions.get((automaton, transition))

    def destination_name(self, automaton: int, transition: int) -> str:
        """Return the name of the state that a transition enters."""
        found = self.transition(automaton, transition)
        return self.state_name(automaton, found.destination) if found else f"transition {transition}"

    def depth(self, automaton: int) -> int:
        """Return the number of automata above one."""
        return sum(1 for _ in self.ancestors(automaton))

    def path(self, automaton: int) -> list[str]:
        """Return the names down to an automaton, without that of the component where there are others."""
        names = [self.automaton_name(each) for each in (automaton, *self.ancestors(automaton))][::-1]
        return names[1:] or names

    def ancestors(self, automaton: int) -> Iterator[int]:
        """Yield the ids of the automata above one, the nearest first."""
        seen = {automaton}
        found = self._by_id.get(automaton)
        while found is not None and found.parent in self._by_id and found.parent not in seen:
            seen.add(found.parent)
            yield found.parent
            found = self._by_id.get(found.parent)

    def current_path(self, snapshot: hfsm.ComponentSnapshot) -> list[str]:
        """Return the names of the current states from the root down to the innermost running automaton.

        Where a state owns several automata it follows the first.
        """
        return next(self.current_paths(snapshot), [])

    def current_paths(self, snapshot: hfsm.ComponentSnapshot) -> Iterator[list[str]]:
        """Yield such a path for each branch, where states own several automata that run side by side."""
        states = by_id(snapshot)
        root = next((a for a in self.all if a.parent not in self._by_id), None)
        if root is not None:
            yield from self._paths_below(root, states, [], set())

    def _paths_below(
        self,
        automaton: hfsm.AutomatonStructure,
        states: dict[int, hfsm.AutomatonSnapshot],
        above: list[str],
        visited: set[int],
    ) -> Iterator[list[str]]:
        visited.add(automaton.id)
        found = states.get(automaton.id)
        if found is None:
            if above:
                yield above
            return
        path = [*above, self.state_name(automaton.id, found.state)]
        state = self._states.get((automaton.id, found.state))
        below = [self._by_id[child] for child in state.children if child in self._by_id] if state else []
        below = [child for child in below if child.id not in visited and len(path) < _DEEPEST_AUTOMATON]
        if not below or (state is not None and state.final):
            yield path
            return
        for child in below:
            yield from self._paths_below(child, states, path, visited)


def _clean(structure: hfsm.ComponentStructure) -> None:
    structure.name = printable(structure.name)
    for automaton in structure.automata:
        automaton.name = printable(automaton.name)
        for state in automaton.states:
            state.name = printable(state.name)
        for transition in automaton.transitions:
            transition.name = printable(transition.name)
            transition.event = printable(transition.event)


def by_id(snapshot: hfsm.ComponentSnapshot) -> dict[int, hfsm.AutomatonSnapshot]:
    """Return the automata of a snapshot by their ids."""
    return {automaton.id: automaton for automaton in snapshot.automata}


def number_in(text: str) -> float | None:
    """Return the finite number that the repr of a value shows, 1 or 0 for a truth value, else None."""
    if text in _TRUTHS:
        return _TRUTHS[text]
    # NumPy's own numbers show their type: np.float64(1.5).
    if text.startswith("np.") and text.endswith(")"):
        text = text[text.find("(") + 1 : -1]
    if len(text) > _LONGEST_NUMBER or not text.lstrip("+-")[:1].isdigit():
        return None  # most values are not numbers, and an exception for each would cost time
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


@dataclass(slots=True)
class Span:
    """A time during which an automaton stayed in one state, running or as a ghost."""

    automaton: int
    state: int
    ghost: bool
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class LoggedChange:
    """A change of state, at the component time at which the new state was entered."""

    time: float
    automaton: int
    origin: int
    destination: int
    transition: int


class StateLog:
    """Changes of state and the spans between them, the newest of each. Not thread safe.

    With more automata than `most`, removed ones are forgotten.
    """

    def __init__(self, most: int = 10_000) -> None:
        self._most = most
        self.changes: deque[LoggedChange] = deque(maxlen=_LONGEST_LOG)
        self.spans: deque[Span] = deque(maxlen=_LONGEST_LOG)
        self._open: dict[int, Span] = {}
        self._last: dict[int, hfsm.AutomatonSnapshot] = {}
        self._before = math.inf

    def add(self, snapshot: hfsm.ComponentSnapshot) -> bool:
        """Add a snapshot that is newer than the last; return whether a state or a ghost has changed."""
        changed = False
        for automaton in snapshot.automata:
            self._note_change(automaton)
            changed = self._note_span(automaton, snapshot.time) or changed
            self._last[automaton.id] = automaton
        self._before = snapshot.time
        if len(self._last) > max(self._most, len(snapshot.automata)):
            here = {automaton.id for automaton in snapshot.automata}
            self._last = {number: last for number, last in self._last.items() if number in here}
            self._open = {number: span for number, span in self._open.items() if number in here}
        return changed

    def _note_change(self, automaton: hfsm.AutomatonSnapshot) -> None:
        last = self._last.get(automaton.id)
        if last is None or (last.state, last.enteredAt) == (automaton.state, automaton.enteredAt):
            return
        if automaton.lastTransition == 0:  # first entered now: it was a ghost from the beginning
            return
        change = LoggedChange(
            automaton.enteredAt, automaton.id, last.state, automaton.state, automaton.lastTransition
        )
        self.changes.append(change)

    def _note_span(self, automaton: hfsm.AutomatonSnapshot, now: float) -> bool:
        span = self._open.get(automaton.id)
        if span is not None and (span.state, span.ghost) == (automaton.state, automaton.ghost):
            span.end = now
            return False
        # The time of an entry is exact; that of a ghost that became active is known from the next snapshot.
        start = automaton.enteredAt if self._before < automaton.enteredAt <= now else now
        if span is not None:
            span.end = start
        self._open[automaton.id] = Span(automaton.id, automaton.state, automaton.ghost, start, now)
        self.spans.append(self._open[automaton.id])
        return True
