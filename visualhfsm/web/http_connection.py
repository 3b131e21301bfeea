"""An HTTP connection that may not be silent for long, nor one too many.

Every program on the machine can connect, and needs no token to do nothing. What it holds open must not keep
the page out.
"""

from __future__ import annotations

import asyncio
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

__all__ = ["MOST_CONNECTIONS", "HttpConnection"]

MOST_CONNECTIONS: Final = 256
"""Connections at a time, websockets included; further ones are closed unheard."""

_PATIENCE: Final = 10.0  # s in which a connection must have asked for something


class HttpConnection(H11Protocol):
    """Closes when for a while no request has begun and none is under way."""

    _look: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a connection, unless there are too many."""
        super().connection_made(transport)
        if len(self.connections) > MOST_CONNECTIONS:
            transport.abort()
        else:
            self._look_again()

    def connection_lost(self, exc: Exception | None) -> None:
        """Take notice that the connection is gone."""
        if self._look is not None:
            self._look.cancel()
        super().connection_lost(exc)

    def _look_again(self) -> None:
        self._look = self.loop.call_later(_PATIENCE, self._close_if_silent, self.cycle)

    def _close_if_silent(self, former: Any) -> None:  # noqa: ANN401 - uvicorn's own, of which it may have none
        """Close unless a request has come since the `former` one, or it is still being answered."""
        if self.transport.is_closing() or self.transport.get_protocol() is not self:  # it is a websocket now
            return
        if self.cycle is former and (former is None or former.response_complete):
            self.transport.close()
        else:
            self._look_again()
