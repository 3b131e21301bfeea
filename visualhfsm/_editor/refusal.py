"""Refusals: what is read instead of the page, why and what to do, and what the terminal shows of them.

People read it in their browser's language: the one that was chosen in *View* is kept in the browser, and not
sent with a request.
"""

from __future__ import annotations

import html
import logging
import secrets
import time
from collections import Counter
from collections.abc import Callable
from typing import Final

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response

from codegen.messages import Message
from visualhfsm._base.languages import accepted_language, said

from .viewers import VIEW

_PAGE: Final = """<!doctype html>
<html lang="{language}">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<meta name="color-scheme" content="light dark">
<title>VisualHFSM</title>
<style nonce="{nonce}">
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 38rem; margin: 15vh auto; padding: 0 1rem; }}
</style>
<h1>{heading}</h1>
{paragraphs}
</html>
"""
_STRANGER: Final = Message("The editor runs, but does not know this page")
_VIEWER: Final = Message("This address shows nothing any more")
_NO_PAGE: Final = Message("There is no such page")
_ABOUT_KEYS: Final = (
    Message(
        "The address contains a key that is new whenever the editor is started. Look for the line with "
        "?token= in the terminal in which you started visualhfsm. Without that terminal, end the editor and "
        "start it again."
    ),
    Message("Changes that were not saved are kept: the editor offers to recover them."),
)
"""Words for the owner of the editor, who alone has a terminal."""
_SAID_AGAIN: Final = 60.0
"""Seconds until a reason is logged again: one who asks on and on must not fill the terminal."""

_logger = logging.getLogger(__name__)


def refused(headers: Headers, path: str, reason: Message) -> Response:
    """Return the answer to a request that is refused, for people as a page.

    `reason`, which says what to do, contains no text of the request.
    """
    if path.startswith(VIEW):
        return _answer(headers, 403, _VIEWER, reason)
    return _answer(headers, 403, _STRANGER, reason, *_ABOUT_KEYS)


async def not_found(request: Request, _error: Exception) -> Response:
    """Answer a request for a page that does not exist."""
    address = Message("Open the address of the editor itself, without what stands behind its last slash.")
    return _answer(request.headers, 404, _NO_PAGE, address)


def _answer(headers: Headers, status: int, heading: Message, reason: Message, *more: Message) -> Response:
    if "text/html" not in headers.get("accept", ""):
        return PlainTextResponse(f"{reason}\n", status)
    language = accepted_language(headers.get("accept-language", ""))
    nonce = secrets.token_urlsafe(16)
    page = _PAGE.format(
        language=language,
        nonce=nonce,
        heading=html.escape(said(heading, language)),
        paragraphs="\n".join(f"<p>{html.escape(said(each, language))}</p>" for each in (reason, *more)),
    )
    policy = f"default-src 'none'; style-src 'nonce-{nonce}'; frame-ancestors 'none'"
    return HTMLResponse(page, status, {"content-security-policy": policy, "vary": "accept-language"})


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
