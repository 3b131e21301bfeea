"""Log what is refused of one topic or service without letting its sender fill the log."""

from __future__ import annotations

import logging
import threading
import time
from typing import Final

from zenoh_ice.data.text import printable

_FIRST: Final = 3
"""Refusals that are logged in any case."""
_LINE_PERIOD: Final = 10.0
"""Minimum seconds between two lines about the others."""
_LONGEST_LINE: Final = 500
"""Characters of a line."""

_logger = logging.getLogger(__name__)


class Refusals:
    """Count what is refused; log the first three, then one in ten seconds and how many came in between."""

    def __init__(self, name: str, what: str) -> None:
        self.count = 0
        self._name: Final = name
        self._what: Final = what
        self._lock: Final = threading.Lock()
        self._logged = 0
        self._next = 0.0

    def add(self, why: object) -> None:
        """Count a refusal, and log it unless too many were logged just before."""
        with self._lock:
            self.count += 1
            now = time.monotonic()
            if self.count > _FIRST and now < self._next:
                return
            self._next = now + _LINE_PERIOD
            between, self._logged = self.count - self._logged - 1, self.count
        more = f" ({between} more since the last report)" if between else ""
        _logger.warning("%s: %s: %s%s", self._name, self._what, printable(str(why), _LONGEST_LINE), more)
