"""Let the threads of a component run user code one at a time, so that their order can be recorded.

A thread has the turn from the beginning of a cycle to its end, except while it waits: for a servant, for a
time, or for the automata below. What it does with the turn happens as one piece, and the order of those
pieces is all that a replay needs to know of threads.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

PATIENCE: Final = 0.1
"""Wall seconds that a thread waits for its turn: code that blocks unseen must not hold the others up."""


class Turns:
    """The turn of one component.

    A thread that does not get its turn in time takes it away from the one that has it; both run side by side
    then, and `overlap` is told of the two contexts.
    """

    def __init__(self, overlap: Callable[[str, str], None], patience: float = PATIENCE) -> None:
        self._overlap = overlap
        self._patience = patience
        self._given = threading.Condition(threading.Lock())
        self._owner: str | None = None
        self._here = threading.local()

    @property
    def context(self) -> str | None:
        """Whose code this thread runs; None for a thread, or a time, that the runtime knows nothing of."""
        found: str | None = getattr(self._here, "context", None)
        return found

    def begin(self, context: str) -> None:
        """Take the turn for a piece of code of this thread."""
        self._take(context)
        self._here.context = context

    def end(self) -> None:
        """Give the turn back for good."""
        context, self._here.context = self.context, None
        if context is not None:
            self._give(context)

    @contextmanager
    def turn(self, context: str) -> Iterator[None]:
        """Have the turn for a `with` block; within a turn the block belongs to that."""
        if self.context is not None:
            yield
            return
        self.begin(context)
        try:
            yield
        finally:
            self.end()

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Let others have their turns in a `with` block, which waits; whatever it reads is nobody's."""
        context = self.context
        if context is None:
            yield
            return
        self._here.context = None
        self._give(context)
        try:
            yield
        finally:
            self._take(context)
            self._here.context = context

    def _take(self, context: str) -> None:
        with self._given:
            if not self._given.wait_for(lambda: self._owner is None, self._patience):
                self._overlap(context, self._owner or "")
            self._owner = context

    def _give(self, context: str) -> None:
        with self._given:
            if self._owner == context:
                self._owner = None
                self._given.notify()
