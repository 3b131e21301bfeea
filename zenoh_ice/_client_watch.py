"""Clients by their liveliness tokens: which of them are lost."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import Any, Final

from ._token_keys import any_client, parse_client_token
from .limits import LIMITS, Limits
from .status import own_version
from .transport import Transport

# No robot has more of these: more means a flood.
_MOST_CLIENTS: Final = 1 << 14
_MOST_LOST: Final = 1 << 10  # that may still have calls waiting here

_logger = logging.getLogger(__name__)


class ClientWatch:
    """Call a function with the id of each client of a realm that is lost, one after the other.

    `close` ends the watch. The first token with a client's id represents the client: only the end of that
    token is its end. Later tokens with the same id, which others may declare and end, have no effect.

    A call over a local socket may come before its client's token, which comes over the network. A client that
    is killed in between has no token that ends: it is lost when none has come for a while after its call, and
    so is one whose call was executed after its end.
    """

    def __init__(
        self,
        transport: Transport,
        realm: str,
        callback: Callable[[str], Any],
        submit: Callable[[Callable[[], object]], None],
        forget: Callable[[ClientWatch], object],
        *,
        limits: Limits = LIMITS,
    ) -> None:
        self._own_id: Final = transport.id
        self._callback: Final = callback
        self._submit: Final = submit
        self._forget: Final = forget
        self._token_looks: Final = limits.token_looks
        self._lock: Final = threading.Lock()
        self._first_tokens: Final[dict[str, str]] = {}  # of the present clients
        self._without_token: Final[dict[str, int]] = {}  # clients that called, and looks since
        self._gone: Final[dict[str, None]] = {}  # the clients lost last, in this order
        self._lost: Final[deque[str]] = deque()  # the first is being reported
        self._closed = False
        self._warned = False  # of a client of another version
        self._following: Final = transport.watch(any_client(realm), self._on_token)

    def close(self) -> None:
        """Begin no more calls; a running one continues."""
        with self._lock:
            self._closed = True
        self._forget(self)
        self._following.close()

    def is_lost(self, client: str) -> bool:
        """Return whether a client was lost recently and has not come back, as after a break of its link."""
        return client in self._gone

    def called(self, client: str) -> None:
        """Note that a call of a client is executed, or was: it should have a token."""
        if client in self._first_tokens or not client or client == self._own_id:
            return
        with self._lock:
            if not self._closed and len(self._without_token) < _MOST_CLIENTS:
                self._without_token[client] = 0

    def look(self) -> None:
        """Notice clients whose tokens did not come; called at each look of the pool's watch."""
        if not self._without_token:
            return
        # Counted in looks: nobody looks in a process that stands still, and the tokens wait to be read.
        with self._lock:
            for client in self._without_token:
                self._without_token[client] += 1
            late = [client for client, looks in self._without_token.items() if looks >= self._token_looks]
            for client in late:
                del self._without_token[client]
        for client in late:
            if client not in self._first_tokens:
                self._lose(client)

    def _on_token(self, key: str, came: bool) -> None:  # on the transport's thread
        client = parse_client_token(key)
        if came and not client and not self._warned:
            self._warned = True
            _logger.warning(
                "a client of another version of VisualHFSM is in the realm and may not find these servants; "
                "this is %s: install the same version on both sides",
                own_version(),
            )
        if came and client and len(self._first_tokens) < _MOST_CLIENTS:
            self._first_tokens.setdefault(client, key)
            self._gone.pop(client, None)
        elif not came and self._first_tokens.get(client) == key:
            del self._first_tokens[client]
            self._lose(client)

    def _lose(self, client: str) -> None:
        with self._lock:
            self._gone[client] = None
            if len(self._gone) > _MOST_LOST:
                del self._gone[next(iter(self._gone))]
            self._lost.append(client)
            start = len(self._lost) == 1
        if start:
            self._submit(self._report_next)

    def _report_next(self) -> None:
        try:
            if not self._closed:
                self._callback(self._lost[0])
        finally:
            with self._lock:
                self._lost.popleft()
                left = bool(self._lost)
            if left:  # so that other jobs run in between
                self._submit(self._report_next)
