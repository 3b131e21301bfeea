"""Tell the operator what happens to a robot: in the health report once there is a server, and in the log."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
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
        self._publish: Callable[[], None] = lambda: None
        self._lock = threading.Lock()
        self._told: dict[str, str] = {}

    def report_to(self, events: EventLog, publish: Callable[[], None]) -> None:
        """Tell `events` from now on; `publish` sends the health report that they stand in."""
        self._events, self._publish = events, publish

    def tell(self, level: Severity, message: str, kind: str = "", *, at_once: bool = False) -> None:
        """Tell what happened, if wanted without waiting for the next health report.

        Of one kind at most one event a second is kept.
        """
        if self._events is None:
            _logger.log(_LEVELS[level], "%s: %s", _SOURCE, message)
            return
        self._events.add(level, _SOURCE, message, kind or message)
        if at_once:
            try:
                self._publish()
            except Exception:
                _logger.exception("the health report could not be sent")

    def tell_once(self, kind: str, message: str) -> None:
        """Warn, unless the newest warning of this kind said the same; an empty message ends it."""
        with self._lock:
            if self._told.get(kind, "") == message:
                return
            self._told[kind] = message
        if message:
            self.tell(Severity.Warning, message, kind)
