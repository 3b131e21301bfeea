"""Undo and redo: documents that were, each with the name of the step that left it."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Final

from codegen.hfsm.document import Document

__all__ = ["History"]

MERGE_WITHIN: Final = 2.0
"""Seconds without a change after which the same kind of change is a new step."""

_MOST_STEPS: Final = 5000


@dataclass(frozen=True, slots=True)
class _Step:
    name: str
    document: Document
    """What comes when the step is undone, or done again."""


class History:
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
        """Make a document the present one, as a step of its own or as part of the last one."""
        if not merge:
            self._past.append(_Step(name, self.document))
        self._future.clear()
        self.document = document
        self._key = key
        self._changed_at = self._clock()

    def seal(self) -> None:
        """Let the next change be a step of its own, as it is after undoing and redoing."""
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
