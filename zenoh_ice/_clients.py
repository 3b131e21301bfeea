"""The clients of a realm, and the end of each of them, by their liveliness tokens.

A client is what it first appeared as: only the end of that very token is its end. Others may declare tokens
with its id, and end them, which changes nothing.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Final, Self

from ._tokens import any_client, parse_client_token
from .transport import Served, Transport

__all__ = ["ClientWatch", "Clients"]

Submit = Callable[[Callable[[], object]], None]
"""Runs a function on another thread."""

_MOST_CLIENTS: Final = 1 << 14  # no robot has so many: somebody floods the realm


class ClientWatch:
    """A callback on lost clients; `close` ends it, also as the end of a `with` block."""

    def __init__(
        self, callback: Callable[[str], Any], submit: Submit, ended: Callable[[ClientWatch], None]
    ) -> None:
        self._callback: Final = callback
        self._submit: Final = submit
        self._ended: Final = ended
        self._lock: Final = threading.Lock()
        self._unreported: dict[str, None] = {}  # in the order in which they were lost
        self._reporting = False
        self._closed = False

    def close(self) -> None:
        """Begin no call any more; one that runs goes on."""
        self._closed = True
        self._ended(self)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def lost(self, client: str) -> None:
        """Call the function with the id of a client, on another thread, one after the other."""
        with self._lock:
            self._unreported[client] = None
            start, self._reporting = not self._reporting, True
        if start:
            self._submit(self._report_next)

    def _report_next(self) -> None:
        with self._lock:
            client = next(iter(self._unreported), None)
            if client is None or self._closed:
                self._reporting = False
                return
            del self._unreported[client]
        try:
            self._callback(client)
        finally:
            self._submit(self._report_next)  # so that others get their turn in between


class Clients:
    """Follow the clients of a realm as soon as somebody wants to know."""

    def __init__(self, transport: Transport, realm: str, submit: Submit) -> None:
        self._transport: Final = transport
        self._pattern: Final = any_client(realm)
        self._submit: Final = submit
        self._lock: Final = threading.Lock()
        self._watches: list[ClientWatch] = []
        self._following: Served | None = None
        self._closed = False
        # Changed on the thread alone that reports tokens.
        self._first_tokens: Final[dict[str, str]] = {}

    def watch(self, callback: Callable[[str], Any]) -> ClientWatch:
        """Call a function with the id of every client that goes away."""
        watch = ClientWatch(callback, self._submit, self._remove)
        with self._lock:
            self._watches.append(watch)
            follow = self._following is None and not self._closed
            if follow:
                self._following = self._transport.watch(self._pattern, self._on_token)
        return watch

    def close(self) -> None:
        """Follow nobody any longer."""
        with self._lock:
            self._closed = True
            following, self._following = self._following, None
            watches = list(self._watches)
        if following is not None:
            following.close()
        for watch in watches:
            watch.close()

    def _remove(self, watch: ClientWatch) -> None:
        with self._lock:
            if watch in self._watches:
                self._watches.remove(watch)

    def _on_token(self, key: str, came: bool) -> None:  # takes no lock that is held while a watch begins
        token = parse_client_token(key)
        if token is None:
            return
        client, _ = token
        if came:
            if len(self._first_tokens) < _MOST_CLIENTS:
                self._first_tokens.setdefault(client, key)
        elif self._first_tokens.get(client) == key:
            del self._first_tokens[client]
            for watch in tuple(self._watches):
                watch.lost(client)
