"""The job that stops whatever moves without being commanded any more."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable
from typing import Final, Protocol

from zenoh_ice import Clock

__all__ = ["Watchdog", "Watched"]

_logger = logging.getLogger(__name__)

_LONGEST: Final = 1.0
"""Seconds between two checks while everything rests."""
_AFTER_ERROR: Final = 0.1


class Watched(Protocol):
    """What can move and must not for longer than its client wants it: joints, and the walk."""

    @property
    def name(self) -> str:
        """What it is called in the log."""

    def watch(self) -> float | None:
        """Stop what was not renewed; return in how many wall seconds to look again, None while all rests."""

    def drop_client(self, client: str) -> None:
        """Stop what a lost client drives."""

    def close(self) -> None:
        """Stop, and refuse further motion."""


class Watchdog:
    """Check devices for expired commands: rarely while all rest, and in time after each command.

    `clock` is steady wall time on a robot, however fast a simulation runs; in tests it is the virtual one.
    `sooner` is called when the next check has become due earlier. Implements `naoserver.jobs.Job`.
    """

    def __init__(self, clock: Clock, sooner: Callable[[], None]) -> None:
        self.name: Final = "watchdog"
        self.thread: Final = "watchdog"
        self.clock: Final = clock
        self.watched: Final[list[Watched]] = []
        """What moves and is checked."""
        self._sooner = sooner
        self._lock = threading.Lock()
        self._next = clock.now()

    def look_within(self, seconds: float) -> None:
        """Check again in at most `seconds`: something has been commanded."""
        when = self.clock.now() + seconds
        with self._lock:
            sooner = when < self._next
            if sooner:
                self._next = when
        if sooner:
            self._sooner()

    def due(self, now: float) -> float:  # noqa: ARG002 - it does not depend on the time
        """Return when the next check is due."""
        return self._next

    def run(self) -> None:
        """Check every device; one that fails does not keep the others from being checked."""
        with self._lock:
            self._next = math.inf  # so that a command during the check is not missed
        seconds = min((self._check(device) for device in self.watched), default=_LONGEST)
        with self._lock:
            self._next = min(self._next, self.clock.now() + seconds)

    def _check(self, device: Watched) -> float:
        try:
            due = device.watch()
        except Exception:
            _logger.exception("the watchdog could not check %s", device.name)
            return _AFTER_ERROR
        return _LONGEST if due is None else due
