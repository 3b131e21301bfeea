"""Tell the operator what happens to a robot: in the health report once there is a server, and in the log."""

from __future__ import annotations

import logging
import threading
from typing import Final

from interfaces.nao import Severity
from naoserver.event_log import EventLog

__all__ = ["Reporter"]

_logger = logging.getLogger(__name__)

_SOURCE: Final = "NAOqi"
_LEVELS: Final = {
    Severity.Info: logging.INFO,
    Severity.Warning: logging.WARNING,
    Severity.Error: logging.ERROR,
}


class Reporter:
    """Pass events on to an event log, which writes them to the log too; without one, to the log alone."""

    def __init__(self) -> None:
        self._events: EventLog | None = None
        self._lock = threading.Lock()
        self._told: dict[str, str] = {}

    def report_to(self, events: EventLog) -> None:
        """Tell `events` from now on."""
        self._events = events

    def tell(self, level: Severity, message: str, kind: str = "") -> None:
        """Tell what happened; of one kind at most one event a second is kept in the health report."""
        if self._events is not None:
            self._events.add(level, _SOURCE, message, kind or message)
        else:
            _logger.log(_LEVELS[level], "%s: %s", _SOURCE, message)

    def tell_once(self, kind: str, message: str) -> None:
        """Warn, unless the newest warning of this kind said the same; an empty message ends it."""
        with self._lock:
            if self._told.get(kind, "") == message:
                return
            self._told[kind] = message
        if message:
            self.tell(Severity.Warning, message, kind)
