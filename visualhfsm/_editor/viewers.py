"""The read-only address of the page: its viewers look on, and can do nothing but stop.

It is below `VIEW`, where another cookie counts than for the editor. Any number of browsers may use it, until
it is withdrawn. What a viewer may ask for is decided by the table in `handlers`, and not by the page.
"""

from __future__ import annotations

import asyncio
import hmac
import secrets
from typing import Final

VIEW: Final = "/view/"
"""The path of the page for viewers, below that of the editor."""


class Viewers:
    """The secrets of the read-only address, new each time that it is shared after it was withdrawn."""

    def __init__(self, port: int) -> None:
        self.cookie_name = f"visualhfsm-view-{port}"
        self.withdrawn = asyncio.Event()
        """Set when all viewers of now are shut out; then there is another event for the next ones."""
        self._token = ""
        self._cookie = ""

    @property
    def is_shared(self) -> bool:
        """Whether there is an address."""
        return bool(self._token)

    def share(self) -> str:
        """Return the token of the address, the same one until it is withdrawn."""
        if not self._token:
            self._token, self._cookie = secrets.token_urlsafe(32), secrets.token_urlsafe(32)
        return self._token

    def withdraw(self) -> None:
        """Shut out all viewers, and forget the address."""
        self._token = self._cookie = ""
        former, self.withdrawn = self.withdrawn, asyncio.Event()
        former.set()

    def redeem(self, token: str) -> str | None:
        """Return the cookie for a token; None for another one."""
        known = self._token and hmac.compare_digest(token.encode(), self._token.encode())
        return self._cookie if known else None

    def accepts_cookie(self, header: str) -> bool:
        """Whether a header `Cookie` holds the cookie of viewers."""
        return bool(self._cookie) and holds_cookie(header, self.cookie_name, self._cookie)


def holds_cookie(header: str, name: str, secret: str) -> bool:
    """Whether a header `Cookie` holds a secret under a name."""
    # A strict parser would fail: other servers on loopback set cookies here, too, in any form.
    pairs = (each.strip().partition("=") for each in header.split(";"))
    values = (value for found, _, value in pairs if found == name)
    return any(hmac.compare_digest(value.encode(), secret.encode()) for value in values)
