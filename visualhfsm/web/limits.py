"""How much the server takes from its clients."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["Limits", "TokenBucket"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Bounds that keep one client from exhausting the server; what is beyond is refused or waits."""

    message_bytes: int = 4 * 1024 * 1024
    """Largest message on the websocket; a larger one closes it."""

    messages_per_second: float = 200.0
    """Rate at which the messages of one connection are read in the long run; the others wait."""

    message_burst: int = 400
    """Messages that are read at once after a pause."""

    sockets: int = 24
    """Websockets open at a time: several windows, each with cameras and the scene."""

    concurrent_operations: int = 16
    """Requests of one connection that are under way at a time; help with code and stops are counted apart."""

    tabs: int = 32
    """Documents open at a time."""

    threads: int = 4
    """Threads that do the work that takes long."""

    operation_seconds: float = 15.0
    """Longest duration of an operation, after which it is answered with an error."""

    output_lines: int = 2000
    """Lines of a component's output that are kept for a window."""

    quiet_seconds: float = 0.15
    """How long a document must not have changed before it is checked."""

    file_check_seconds: float = 1.0
    """How often the open files are looked at for changes from outside."""


class TokenBucket:
    """A bound on a rate that lets bursts through.

    Nothing is lost: `take` tells how long to wait before going on, which holds back who sends.
    """

    def __init__(self, rate: float, burst: int, now: Callable[[], float] = time.monotonic) -> None:
        self._rate = rate
        self._burst = burst
        self._now = now
        self._tokens = float(burst)
        self._filled_at = now()

    def take(self) -> float:
        """Take one token; return the seconds until it is there, 0 when there was one."""
        now = self._now()
        self._tokens = min(self._burst, self._tokens + (now - self._filled_at) * self._rate)
        self._filled_at = now
        self._tokens -= 1.0
        return max(0.0, -self._tokens / self._rate)
