"""What an operator should know, kept for the health report."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import Final

from interfaces.nao import HealthEvent, Severity

log = logging.getLogger(__name__)

KEPT: Final = 20
_LEVELS: Final = {
    Severity.Info: logging.INFO,
    Severity.Warning: logging.WARNING,
    Severity.Error: logging.ERROR,
}


class EventLog:
    """Collect events and count what was limited; of one source and kind, at most one event a second is kept.

    Thread-safe. `robot_time` gives an event's time, `wall_time` (steady) paces the rate limit.
    """

    def __init__(self, robot_time: Callable[[], float], wall_time: Callable[[], float]) -> None:
        self._robot_time = robot_time
        self._wall_time = wall_time
        self._lock = threading.Lock()
        self._events: deque[HealthEvent] = deque(maxlen=KEPT)
        self._last: dict[tuple[str, str], tuple[float, int]] = {}  # wall time of the newest, suppressed since
        self._limited = 0
        self._timeouts = 0

    def add(self, level: Severity, source: str, message: str, kind: str = "") -> None:
        """Tell what happened to `source`; events of the same source and `kind` count as the same."""
        now = self._wall_time()
        with self._lock:
            last, suppressed = self._last.get((source, kind), (-float("inf"), 0))
            if now - last < 1.0:
                self._last[source, kind] = (last, suppressed + 1)
                return
            self._last[source, kind] = (now, 0)
            if suppressed:
                message = f"{message} ({suppressed} more since the last report)"
            self._events.append(HealthEvent(self._robot_time(), level, source, message))
        log.log(_LEVELS[level], "%s: %s", source, message)

    def count_limited(self) -> None:
        """Count a command that was limited."""
        with self._lock:
            self._limited += 1

    def count_timeout(self) -> None:
        """Count a velocity command that was stopped because it was not renewed."""
        with self._lock:
            self._timeouts += 1

    def snapshot(self) -> tuple[list[HealthEvent], int, int]:
        """Return the newest events, oldest first, the limited commands and the velocity timeouts."""
        with self._lock:
            return list(self._events), self._limited, self._timeouts
