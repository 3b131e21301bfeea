"""What everything that a node creates has in common: its entity, its key, its token, and its end."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Collection
from typing import Any, Final, Protocol

import zenoh
import zenoh.ext

from . import _wire as wire
from ._graph import Discovery
from ._messages import Types
from ._others import OtherEnds
from ._wire import Attachment, Entity
from ._workers import Workers
from .exceptions import MessageError, NodeClosedError

Handler = Callable[..., Any]
"""Gets a message or a request, and its `Sender` if it asks for that."""


class Owner(Protocol):
    """What the parts of a node need of it."""

    @property
    def session(self) -> zenoh.Session:
        """The session that carries their messages."""

    @property
    def discovery(self) -> Discovery:
        """The tokens of the domain."""

    @property
    def types(self) -> Types:
        """The types of messages that are known."""

    @property
    def workers(self) -> Workers:
        """The threads of callbacks."""

    @property
    def receiving(self) -> Workers:
        """The thread that decodes messages."""

    def on_close(self, key: object, close: Callable[[], None] | None) -> None:
        """Call `close` when the node closes; None to forget it."""


class Endpoint:
    """The common part of everything that a node creates: its entity, its keys, its token, and its end.

    It has two keys, one with the hash of its type, and one for nodes of Humble. Both kinds of nodes know each
    other by name and type alone, so that one token is enough.
    """

    def __init__(self, node: Owner, entity: Entity, besides: Collection[str] = ()) -> None:
        self.node: Final = node
        self.entity: Final = entity
        self.name: Final = entity.name
        self.type_name: Final = entity.type_name
        self._gid: Final = entity.gid()
        self._keys: Final = {
            humble: wire.key(entity.domain, entity.name, entity.type_name, type_hash)
            for humble, type_hash in ((False, entity.type_hash), (True, wire.HASHLESS))
        }
        """The key of most nodes, by False, and that of Humble's, by True."""
        self._numbers: Final = itertools.count(1)
        self._declared: list[Any] = []
        self._turn: Final = threading.Lock()
        self._closed = False
        self.others: Final = OtherEnds(node.discovery, entity, besides)

    def _announce(self, *declared: Any) -> None:  # noqa: ANN401
        self._declared += [*declared, self.node.session.liveliness().declare_token(self.entity.token())]

    def _attachment(self) -> tuple[int, bytes]:
        number = next(self._numbers)
        return number, Attachment(number, time.time_ns(), self._gid).encode()

    def _check_open(self) -> None:
        if self._closed:
            raise NodeClosedError(f"{self.name}: it is closed")

    def close(self) -> None:
        """Withdraw it from the graph."""
        if self._closed:
            return
        self._closed = True
        self.node.on_close(self, None)
        with self._turn:  # Zenoh cannot withdraw what is in use
            while self._declared:  # the token first
                withdraw(self._declared.pop())
        self.others.close()


def withdraw(declared: Any) -> None:  # noqa: ANN401
    """Withdraw what was declared; advanced publishers and subscribers end with their last reference.

    To undeclare these, Zenoh (1.10) waits for a lock of the session and keeps Python's meanwhile; another
    thread may hold the session's and wait for Python's, as one that asks for tokens does: a deadlock.
    """
    if not isinstance(declared, zenoh.ext.AdvancedPublisher | zenoh.ext.AdvancedSubscriber):
        declared.undeclare()


def bytes_of(payload: zenoh.ZBytes, most: int, type_name: str) -> bytes:
    """Return the bytes of a payload; raises MessageError for one that is too large to be copied."""
    if len(payload) > most:
        raise MessageError(f"{type_name}: {len(payload)} bytes; at most {most} are decoded")
    return payload.to_bytes()


def attachment_of(data: zenoh.ZBytes | None) -> Attachment | None:
    """Return the attachment of a message; None if there is none of rmw_zenoh."""
    return Attachment.decode(data.to_bytes()) if data is not None and len(data) == Attachment.SIZE else None
