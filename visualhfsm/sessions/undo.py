"""Undo and redo: the documents before and after each step, and what a step changed."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass
from typing import Final

from codegen.hfsm.document import Automaton, Document

__all__ = ["MERGE_WITHIN", "Added", "Change", "UndoStack"]

MERGE_WITHIN: Final = 2.0
"""Seconds without a change after which the same kind of change is a new step."""

_MOST_STEPS: Final = 5000


@dataclass(frozen=True, slots=True)
class Added:
    """What is new in one automaton: ids of states and transitions. An automaton may be new itself."""

    automaton: int
    states: tuple[int, ...]
    transitions: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Change:
    """What became of a document: `before` and `after` share everything that did not change."""

    name: str
    revision: int
    before: Document
    after: Document

    @property
    def added(self) -> tuple[Added, ...]:
        """What is new, such as to select it; empty when nothing is."""
        return tuple(_added(self.before, self.after))


@dataclass(frozen=True, slots=True)
class _Step:
    name: str
    document: Document
    """What comes when the step is undone, or done again."""


class UndoStack:
    """The present document between those before and those that were undone.

    Documents share what they have in common, so that a step costs little memory; the oldest of 5000 goes.
    """

    def __init__(self, document: Document, clock: Callable[[], float] = time.monotonic) -> None:
        self.document = document
        self._clock = clock
        self._past: deque[_Step] = deque(maxlen=_MOST_STEPS)
        self._future: list[_Step] = []
        self._key: Hashable | None = None
        self._changed_at = 0.0

    @property
    def undo_names(self) -> list[str]:
        """The names of the steps that can be undone, the latest first."""
        return [step.name for step in reversed(self._past)]

    @property
    def redo_names(self) -> list[str]:
        """The names of the steps that can be done again, the next first."""
        return [step.name for step in reversed(self._future)]

    def merges(self, key: Hashable | None) -> bool:
        """Return whether a change with this key would continue the last step."""
        recent = self._clock() - self._changed_at <= MERGE_WITHIN
        return key is not None and key == self._key and recent and bool(self._past)

    def add(self, name: str, document: Document, key: Hashable | None, *, merge: bool) -> None:
        """Make a document the present one, as a separate step or as part of the last one."""
        if not merge:
            self._past.append(_Step(name, self.document))
        self._future.clear()
        self.document = document
        self._key = key
        self._changed_at = self._clock()

    def seal(self) -> None:
        """Make the next change a separate step, as it is after undoing and redoing."""
        self._key = None

    def undo(self) -> str | None:
        """Go back one step and return its name, or None when there is none."""
        if not self._past:
            return None
        step = self._past.pop()
        self._future.append(_Step(step.name, self.document))
        self.document = step.document
        self.seal()
        return step.name

    def redo(self) -> str | None:
        """Do the step again that was undone last, and return its name, or None when there is none."""
        if not self._future:
            return None
        step = self._future.pop()
        self._past.append(_Step(step.name, self.document))
        self.document = step.document
        self.seal()
        return step.name


def _added(before: Document, after: Document) -> Iterator[Added]:
    former = {automaton.id: automaton for automaton in before.automata}
    for automaton in after.automata:
        old = former.get(automaton.id)
        if old is automaton:
            continue
        known = old or Automaton(id=automaton.id)
        states = {state.id for state in known.states}
        transitions = {transition.id for transition in known.transitions}
        added = Added(
            automaton.id,
            tuple(state.id for state in automaton.states if state.id not in states),
            tuple(each.id for each in automaton.transitions if each.id not in transitions),
        )
        if old is None or added.states or added.transitions:
            yield added
