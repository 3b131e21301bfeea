"""Lines of the terminal about requests that are refused."""

from __future__ import annotations

import logging
import time
from collections import Counter
from typing import Final

_SAID_AGAIN: Final = 60.0
"""Seconds until a reason is logged again: one who asks on and on must not fill the terminal."""

_logger = logging.getLogger(__name__)


class RefusalLog:
    """Logs each reason once a minute, with the number of those in between. Used on one event loop."""

    def __init__(self) -> None:
        self._until: dict[str, float] = {}
        self._unsaid: Counter[str] = Counter()

    def add(self, reason: object) -> None:
        """Log a reason, which contains no text of the request, unless it was just logged."""
        text = str(reason)
        now = time.monotonic()
        if now < self._until.get(text, 0.0):
            self._unsaid[text] += 1
            return
        self._until[text] = now + _SAID_AGAIN
        unsaid = self._unsaid.pop(text, 0)
        more = f" ({unsaid} more since the last report)" if unsaid else ""
        _logger.warning("refused a request: %s%s", text, more)
