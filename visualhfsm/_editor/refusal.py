"""Refusals: what is read instead of the page, and what the terminal shows of them."""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Callable
from typing import Final

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, Response

from codegen.messages import Message
from visualhfsm._base.languages import accepted_language, said

_SAID_AGAIN: Final = 60.0
"""Seconds until a reason is logged again: one who asks on and on must not fill the terminal."""

_logger = logging.getLogger(__name__)


def refused(headers: Headers, reason: Message) -> Response:
    """Return the answer to a request that is refused: what to do, in the language of the browser.

    `reason`, which says that, contains no text of the request.
    """
    language = accepted_language(headers.get("accept-language", ""))
    return PlainTextResponse(f"{said(reason, language)}\n", 403, {"vary": "accept-language"})


class RefusalLog:
    """Logs each reason once a minute, with the number of those in between. Used on one event loop."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._until: dict[str, float] = {}
        self._unsaid: Counter[str] = Counter()

    def add(self, reason: object) -> None:
        """Log a reason, which contains no text of the request, unless it was just logged."""
        text = str(reason)
        now = self._clock()
        if now < self._until.get(text, 0.0):
            self._unsaid[text] += 1
            return
        self._until[text] = now + _SAID_AGAIN
        unsaid = self._unsaid.pop(text, 0)
        more = f" ({unsaid} more since the last report)" if unsaid else ""
        _logger.warning("refused a request: %s%s", text, more)
