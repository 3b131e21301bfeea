"""The moment when a program is to end, for threads that wait for it."""

from __future__ import annotations

import math
import time
from queue import Empty, SimpleQueue
from typing import Final

__all__ = ["Shutdown"]

# s after which a wait of the main thread looks up: a signal that another thread takes does not wake it.
_LOOK: Final = 0.5


class Shutdown:
    """Let threads wait until something is shut down."""

    def __init__(self) -> None:
        self.begun = False
        """Whether that is so."""
        # No event: Ctrl-C while one is taken hold of would leave it locked for ever.
        self._wake: Final[SimpleQueue[None]] = SimpleQueue()

    def begin(self) -> None:
        """Let all go who wait now or later."""
        self.begun = True
        self._wake.put(None)

    def wait(self, timeout: float | None) -> bool:
        """Wait for at most `timeout` s, or without an end; return whether `begin` was called."""
        deadline = math.inf if timeout is None else time.monotonic() + timeout
        while not self.begun:
            left = deadline - time.monotonic()
            try:
                self._wake.get(timeout=max(0.0, min(left, _LOOK)))
            except Empty:
                if left <= _LOOK:
                    return self.begun
            else:
                self._wake.put(None)  # for the next who waits
        return True
