"""Words about the hardware: events in the health report, once for each problem."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from interfaces.nao import Severity
from naoserver._event_log import EventLog
from naoserver.errors import HardwareFailure
from naoserver.hardware.link import LinkLost

_logger = logging.getLogger(__name__)


class Reporter:
    """Pass events of `source` on to an event log, which also writes them to the log; else only to the log."""

    def __init__(self, source: str) -> None:
        self.source: Final = source
        self._events: EventLog | None = None
        self._publish: Callable[[], None] = lambda: None
        self._lock = threading.Lock()
        self._reported: dict[str, str] = {}

    def report_to(self, events: EventLog, publish: Callable[[], None]) -> None:
        """Report to `events` from now on; `publish` sends the health report that contains them."""
        self._events, self._publish = events, publish

    def report(self, level: Severity, message: str, kind: str = "", *, at_once: bool = False) -> None:
        """Report an event, with `at_once` without waiting for the next health report.

        At most one event a second of each kind is kept.
        """
        if self._events is None:
            _logger.log(logging.getLevelNamesMapping()[level.name.upper()], "%s: %s", self.source, message)
            return
        self._events.add(level, self.source, message, kind or message)
        if at_once:
            try:
                self._publish()
            except Exception:
                _logger.exception("the health report could not be sent")

    def report_once(self, kind: str, message: str) -> None:
        """Warn, unless the newest warning of this kind was the same; an empty message ends the problem."""
        with self._lock:
            if self._reported.get(kind, "") == message:
                return
            self._reported[kind] = message
        if message:
            self.report(Severity.Warning, message, kind)

    @contextmanager
    def failures_of(self, kind: str) -> Iterator[None]:
        """Report a failure in a `with` block once, until it succeeds; the connection reports a lost link."""
        try:
            yield
        except LinkLost:
            return
        except HardwareFailure as error:
            self.report_once(kind, str(error))
        else:
            self.report_once(kind, "")
