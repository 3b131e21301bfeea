"""What everything that a node creates has in common: its entity, its key, its token, its other ends.

In Zenoh the type of messages and its hash are part of the key: ends that differ in them never hear each
other, and do not know it.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Collection
from typing import Any, Final, Protocol

import zenoh
import zenoh.ext

from zenoh_ice.threads.pool import Pool

from . import _wire as wire
from ._graph import Discovery, EndpointsOf
from ._messages import Types
from ._refusals import Refusals
from ._wire import Attachment, Entity, EntityKind
from ._workers import join_all
from .exceptions import MessageError, NodeClosedError

_MOST_NAMED: Final = 1024
_OPPOSITE: Final[dict[EntityKind, EntityKind]] = {"MP": "MS", "MS": "MP", "SS": "SC", "SC": "SS"}
_WORDS: Final[dict[EntityKind, tuple[str, str, str]]] = {
    "MP": ("a publisher is not heard", "publishes", "expected"),
    "MS": ("a subscription hears nothing", "subscribes to", "published"),
    "SS": ("a server is not called", "serves", "called"),
    "SC": ("a client is not answered", "calls", "served"),
}

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
    def workers(self) -> Pool:
        """The threads of callbacks."""

    @property
    def receiving(self) -> Pool:
        """The threads that decode messages."""

    def on_close(self, key: object, close: Callable[[], None] | None) -> None:
        """Call `close` when the node closes; None to forget it."""


class OtherEnds(EndpointsOf):
    """The ends of the opposite kind; those that do not fit are named in the log, once each."""

    def __init__(self, discovery: Discovery, own: Entity, besides: Collection[str] = ()) -> None:
        """Follow the other ends of an end's topic or service until `close`.

        Those of the types `besides` are left to other ends of its node.
        """
        self._own: Final = own
        self._delay: Final = discovery.limits.announcement
        self._besides: Final = frozenset(besides) - {own.type_name}
        kind = _OPPOSITE[own.kind]
        what, self._does, self._done = _WORDS[kind]
        self._unheard: Final = Refusals(own.name, what)
        self._named: set[Entity] = set()
        self._timing: Final = threading.Lock()
        self._timer: threading.Timer | None = None
        self._ended = False
        super().__init__(discovery, kind, own.name, self._meet)

    def fitting(self) -> list[Entity]:
        """Return those that messages pass to or from."""
        return [each for each in self.all() if self._own.fits(each)]

    def close(self) -> None:
        """Stop following, and name no more."""
        super().close()
        with self._timing:
            self._ended, timer = True, self._timer
        if timer is not None:
            timer.cancel()
            join_all([timer])

    def _meet(self, other: Entity) -> None:
        """Look soon, when the other ends of its node are known, whether one that came is heard."""
        if self._own.fits(other) or other.type_name in self._besides:
            return
        with self._timing:
            if self._timer is not None or self._ended:
                return
            timer = threading.Timer(self._delay, self._name_strangers)
            timer.daemon = True
            try:
                timer.start()
            except RuntimeError as error:  # at a limit of threads
                self._unheard.add(error)
            else:
                self._timer = timer

    def _name_strangers(self) -> None:
        with self._timing:
            self._timer = None
        others = {*self.all()}
        fitting = {each for each in others if self._own.fits(each)}
        hearing = {(each.session, each.node_id) for each in fitting if each.kind == "MS"}
        strangers = [
            each
            for each in others - fitting - self._named
            if each.type_name not in self._besides and (each.session, each.node_id) not in hearing
        ]
        if len(self._named) >= _MOST_NAMED:
            self._named.clear()
        self._named.update(strangers)
        if strangers:
            self._unheard.add("; ".join(map(self._difference, strangers)))

    def _difference(self, other: Entity) -> str:
        own = self._own.type_name
        if other.type_name != own:
            return f"{other.node_name} {self._does} {other.type_name}, {own} is {self._done}"
        version = f"{other.node_name} {self._does} {own} with the hash {other.type_hash}"
        return f"{version}, of another definition or distribution (ROS_DISTRO)"


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
                _withdraw(self._declared.pop())
        self.others.close()


def _withdraw(declared: Any) -> None:  # noqa: ANN401
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
