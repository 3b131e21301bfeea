"""Pieces of user code that take turns on one thread: each waits where the recorded one did."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from greenlet import getcurrent, greenlet

from .script import Record, ReplayEndedError, Want

_END_ATTEMPTS: Final = 3
"""How often code is asked to end; code that refuses is left where it waits."""


class Code:
    """A cycle, or a callback: it runs while `go` does, until it waits for something recorded, or ends."""

    def __init__(self, context: str, function: Callable[[], object]) -> None:
        self.context: Final = context
        self.want: Want | None = None
        """What the code waits for; None while it runs, and after its end."""
        self._greenlet: Final[Any] = greenlet(lambda _none: function())
        self._greenlet.code = self

    @property
    def ended(self) -> bool:
        """Whether the code has returned, or raised an exception."""
        return bool(self._greenlet.dead)

    def go(self, answer: Record | None = None) -> None:
        """Let the code run, with the answer that it waits for; raises what the code raises."""
        self.want = None
        self._greenlet.switch(answer)

    def wait(self, want: Want) -> Record | None:
        """Wait for the answer from `go`; called by the code."""
        self.want = want
        answer: Record | None = self._greenlet.parent.switch()
        return answer

    def close(self) -> None:
        """End code that waits."""
        for _ in range(_END_ATTEMPTS):
            if self._greenlet:
                with suppress(Exception, SystemExit, ReplayEndedError):
                    self._greenlet.throw(ReplayEndedError)


def current_code() -> Code | None:
    """Return the code that runs here; None outside the code of a replay."""
    found: Code | None = getattr(getcurrent(), "code", None)
    return found
