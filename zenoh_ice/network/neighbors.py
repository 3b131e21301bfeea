"""Who of a realm can read the memory of this process, by the liveliness tokens of communicators."""

from __future__ import annotations

import math
import threading
import time
from typing import Any, Final

import zenoh
from zenoh.handlers import Callback

from ..stop_signals import unbroken
from .client_tokens import any_client, parse_client_token

__all__ = ["Neighbors"]

_MOST: Final = 1 << 14  # clients; no robot has so many
_WORD_COMES: Final = 0.5  # s until all tokens that are there are known


class Neighbors:
    """Follow the clients of a realm as soon as somebody wants to know; may be used from any thread.

    Without a memory space there are no neighbors.
    """

    def __init__(self, session: zenoh.Session, realm: str, memory_space: str) -> None:
        self._session: Final = session
        self._realm: Final = realm
        self._space: Final = memory_space
        self._lock: Final = threading.Lock()
        self._subscriber: Any = None
        self._known_at = math.inf
        self._closed = not memory_space
        # Changed on Zenoh's thread alone.
        self._near: Final[set[str]] = set()
        self._far: Final[set[str]] = set()

    def watch(self) -> None:
        """Follow the clients from now on."""
        if self._subscriber is not None or self._closed:
            return
        with self._lock:
            if self._subscriber is None and not self._closed:
                self._known_at = time.monotonic() + _WORD_COMES
                # Zenoh's thread takes no lock of ours, so it may be asked while we hold this one.
                self._subscriber = self._session.liveliness().declare_subscriber(
                    any_client(self._realm), Callback(unbroken(self._on_token), indirect=False), history=True
                )

    def includes(self, client: str) -> bool:
        """Return whether a client is known to be one that can read this process's memory."""
        self.watch()
        return client in self._near and client not in self._far  # anybody can say so of others

    def are_all(self) -> bool:
        """Return whether all clients of the realm can read this process's memory."""
        self.watch()
        return not self._far and time.monotonic() >= self._known_at

    def close(self) -> None:
        """Follow nobody any longer."""
        with self._lock:
            self._closed = True
            self._known_at = math.inf
            subscriber, self._subscriber = self._subscriber, None
        if subscriber is not None:
            subscriber.undeclare()

    def _on_token(self, sample: zenoh.Sample) -> None:
        token = parse_client_token(str(sample.key_expr))
        if token is None:
            return
        client, space = token
        known = self._near if space == self._space else self._far
        if sample.kind == zenoh.SampleKind.DELETE:
            known.discard(client)
        elif len(known) < _MOST:
            known.add(client)
