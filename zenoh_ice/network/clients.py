"""Who is no longer there: the clients of a realm, by the liveliness tokens of their communicators."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Final, Self

import zenoh
from zenoh.handlers import Callback

from ..stop_signals import unbroken
from .client_tokens import any_client, parse_client_token

__all__ = ["ClientWatch", "Clients"]

Notify = Callable[[Callable[[], None]], None]
"""Hands a function to another thread."""

_MOST_UNTOLD: Final = 1 << 14  # clients, of one watch


class ClientWatch:
    """A callback on lost clients; `close` ends it, also as the end of a `with` block."""

    def __init__(
        self, callback: Callable[[str], Any], notify: Notify, ended: Callable[[ClientWatch], None]
    ) -> None:
        self._callback: Final = callback
        self._notify: Final = notify
        self._ended: Final = ended
        self._lock: Final = threading.Lock()
        self._untold: dict[str, None] = {}  # in the order in which they were lost
        self._telling = False
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
            if len(self._untold) >= _MOST_UNTOLD:
                return  # no robot has so many: somebody floods the realm
            self._untold[client] = None
            tell, self._telling = not self._telling, True
        if tell:
            self._notify(self._tell_next)

    def _tell_next(self) -> None:
        with self._lock:
            client = next(iter(self._untold), None)
            if client is None or self._closed:
                self._telling = False
                return
            del self._untold[client]
        try:
            self._callback(client)
        finally:
            self._notify(self._tell_next)  # so that others get their turn in between


class Clients:
    """Follow the clients of a realm as soon as somebody wants to know.

    `notify` hands a function to another thread: Zenoh's own runs no code of users.
    """

    def __init__(self, session: zenoh.Session, realm: str, notify: Notify) -> None:
        self._session: Final = session
        self._realm: Final = realm
        self._notify: Final = notify
        self._lock = threading.Lock()
        self._watches: list[ClientWatch] = []
        self._subscriber: Any = None
        self._closed = False

    def watch(self, callback: Callable[[str], Any]) -> ClientWatch:
        """Call a function with the id of every client that goes away."""
        watch = ClientWatch(callback, self._notify, self._forget)
        with self._lock:
            self._watches.append(watch)
            # Zenoh's thread takes no lock of ours, so it may be asked while we hold this one.
            if self._subscriber is None and not self._closed:
                self._subscriber = self._session.liveliness().declare_subscriber(
                    any_client(self._realm), Callback(unbroken(self._on_token), indirect=False), history=True
                )
        return watch

    def close(self) -> None:
        """Follow nobody any longer."""
        with self._lock:
            self._closed = True
            self._watches.clear()
            subscriber, self._subscriber = self._subscriber, None
        if subscriber is not None:
            subscriber.undeclare()

    def _forget(self, watch: ClientWatch) -> None:
        with self._lock:
            self._watches = [other for other in self._watches if other is not watch]

    def _on_token(self, sample: zenoh.Sample) -> None:
        if sample.kind != zenoh.SampleKind.DELETE:
            return
        token = parse_client_token(str(sample.key_expr))
        if token is None:
            return  # no communicator has such an id, and it would reach logs
        for watch in self._watches:
            watch.lost(token[0])
