"""A ROS 2 node over a Zenoh session: publishers, subscriptions, services and their clients.

Nodes and all their parts are thread-safe. Callbacks run on the node's threads, one at a time for each
subscription and service. Whatever they raise, SystemExit included, is logged; who waits for them gets an
error, and the next message, request or goal is handled.
"""

from __future__ import annotations

import itertools
import logging
import os
import secrets
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack
from typing import Any, Final, Self, TypeVar

import zenoh

from zenoh_ice import Settings, ZenohIceError
from zenoh_ice.carriers.zenoh.session import close_session, open_session

from . import _wire as wire
from ._codec import LARGEST_MESSAGE
from ._endpoint import Endpoint, Handler
from ._graph import Discovery, EndpointsOf, Graph
from ._limits import LIMITS, NodeLimits
from ._messages import Types
from ._services import LARGEST_COMMAND, Client, Service
from ._topics import Publisher, Subscription
from ._wire import Entity, QoS
from ._workers import END_LIMIT, make_pool
from .exceptions import NodeClosedError, RosError

DEFAULT_SETTINGS: Final = Settings(connect=("tcp/127.0.0.1:7447",))
"""The default router, the same as that of rmw_zenoh's nodes."""

_MOST_CALLBACKS: Final = 8  # that run at a time
_ANY_PORT: Final = "tcp/127.0.0.1:0"
_CHECK_PERIOD: Final = 0.1  # s
_END_LIMIT: Final = 2.0  # s

_logger = logging.getLogger(__name__)

_E = TypeVar("_E", bound=Endpoint)


def settings_of_node(settings: Settings, connect: Sequence[str] = ()) -> Settings:
    """Return the settings of a node's session for those of its process; `connect` names other endpoints.

    A node is a peer, as those of rmw_zenoh are. Where users are known it is a client, so that everything
    passes the router, which grants rights.
    """
    known = bool(settings.security.authority or settings.security.user)
    listen: Sequence[str] = () if known else (_ANY_PORT,)
    mode = "client" if known else "peer"
    return settings.override(connect=tuple(connect) or settings.connect, listen=listen, mode=mode)


class Node:
    """A node of a domain; closing it withdraws everything that it created."""

    def __init__(
        self,
        name: str,
        *,
        namespace: str = "/",
        domain: int | None = None,
        settings: Settings = DEFAULT_SETTINGS,
        remap: Mapping[str, str] | None = None,
        types: Types | None = None,
        clock: Callable[[], int] = time.time_ns,
        separate_discovery: bool = False,
        limits: NodeLimits = LIMITS,
    ) -> None:
        """Open a session and announce a node.

        `domain` is ROS_DOMAIN_ID or 0 by default; `settings.connect` has the endpoints of the router, or of
        other nodes. `remap` has other names for topics and services. `clock` gives ns since 1970 for stamps:
        for a simulated robot, its own time instead of wall time. With `separate_discovery` other nodes are
        followed over a second session, where thousands of them delay no message. Raises RosError for bad
        names, and the exceptions of `open_session`.
        """
        self.namespace: Final = wire.check_node_name(name, namespace)
        self.name: Final = name
        self.domain: Final = wire.domain_id(
            os.environ.get("ROS_DOMAIN_ID") or 0 if domain is None else domain
        )
        self._remap: Final = {
            wire.resolve(old, name, self.namespace): wire.resolve(new, name, self.namespace)
            for old, new in (remap or {}).items()
        }
        self.types: Final = types or Types()
        self.clock: Final = clock
        self._ids = itertools.count(1)
        self._lock: Final = threading.Lock()
        self._closers: dict[object, Callable[[], None]] = {}
        self._closed = False
        self.workers: Final = make_pool(_MOST_CALLBACKS, f"node {name} callbacks")
        try:
            self.receiving: Final = make_pool(1, f"node {name} receiving")
            """Decodes messages and handles tokens, which Zenoh's threads must not wait for."""
        except RosError:
            self.workers.close(END_LIMIT)
            raise
        self._sessions: Final[list[zenoh.Session]] = []
        self._graph: Graph | None = None
        try:
            for _ in range(2 if separate_discovery else 1):
                self._sessions.append(open_session(settings, session_id=_small_id()))
            self.session: Final = self._sessions[0]
            self.discovery: Final = Discovery(self._sessions[-1], self.domain, self.receiving.submit, limits)
            self._session_id: Final = str(self.session.zid())
            self._token = self.session.liveliness().declare_token(self._entity("NN", 0).token())
        except zenoh.ZError as error:
            self._end()
            raise RosError(f"node {name}: {error}") from error
        except ZenohIceError:
            self._end()
            raise
        if settings.connect:
            absence = AbsenceWarning(lambda: self.connected, settings.connect, limits.first_link)
            self.on_close(absence, absence.close)

    def __enter__(self) -> Self:
        """Return the node."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the node."""
        self.close()

    @property
    def connected(self) -> bool:
        """Return whether there is a link to a router or another node."""
        info = self.session.info
        return bool(info.routers_zid() or info.peers_zid())

    @property
    def graph(self) -> Graph:
        """Return the whole graph, which is followed from now on: at first it is empty."""
        with self._lock:
            self.check_open()
            if self._graph is None:
                self._graph = Graph(self.discovery)
            return self._graph

    def publishers(self, topic: str) -> EndpointsOf:
        """Return the publishers of a topic, also those of the node, which are followed until it closes."""
        self.check_open()
        found = EndpointsOf(self.discovery, "MP", self.resolve(topic))
        self.on_close(found, found.close)
        return found

    @property
    def full_name(self) -> str:
        """Return the name with its namespace."""
        return f"{self.namespace.rstrip('/')}/{self.name}"

    def resolve(self, name: str) -> str:
        """Return the full name of a topic or service, remapped; raises InvalidNameError."""
        full = wire.resolve(name, self.name, self.namespace)
        return self._remap.get(full, full)

    def now(self) -> Any:  # noqa: ANN401
        """Return the node's time as a builtin_interfaces/msg/Time."""
        return self.time(self.clock())

    def time(self, ns: int) -> Any:  # noqa: ANN401
        """Return a builtin_interfaces/msg/Time of ns since 1970, or since the start of a simulation."""
        return self.types["builtin_interfaces/msg/Time"](ns // 1_000_000_000, ns % 1_000_000_000)

    def create_publisher(self, type_name: str, topic: str, qos: QoS = QoS()) -> Publisher:  # noqa: B008
        """Announce that messages of a type will be published on a topic."""
        return self._made(Publisher(self, self._endpoint("MP", type_name, topic, qos)))

    def create_subscription(
        self,
        type_name: str,
        topic: str,
        callback: Handler | None = None,
        qos: QoS = QoS(),  # noqa: B008
        *,
        largest: int = LARGEST_MESSAGE,
        with_sender: bool = False,
        besides: Collection[str] = (),
    ) -> Subscription:
        """Subscribe to a topic; the callback gets each message, `with_sender` also its `Sender`.

        Publishers of other types are warned of, but for those types `besides` that the node hears by other
        subscriptions. Messages of more than `largest` bytes are dropped before they are copied, as are those
        that are larger than their type can be.
        """
        entity = self._endpoint("MS", type_name, topic, qos)
        made = Subscription(self, entity, callback, largest, with_sender=with_sender, besides=besides)
        return self._made(made)

    def create_client(self, type_name: str, service: str) -> Client:
        """Announce that a service will be called."""
        return self._made(Client(self, self._endpoint("SC", type_name, service, QoS())))

    def create_service(
        self,
        type_name: str,
        service: str,
        handler: Handler,
        *,
        largest: int = LARGEST_COMMAND,
        urgent: bool = False,
        with_sender: bool = False,
    ) -> Service:
        """Serve a service: the handler gets each request, `with_sender` also its `Sender`.

        It returns the response: a message, a mapping of its fields, or a Future of either. What it raises is
        logged, and its client gets CallError. Requests of more than `largest` bytes are refused. An urgent
        service, such as a stop, has a separate thread.
        """
        entity = self._endpoint("SS", type_name, service, QoS())
        served = Service(self, entity, handler, largest, urgent=urgent, with_sender=with_sender)
        return self._made(served)

    def close(self) -> None:
        """Withdraw everything, the newest first, and close the session."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            closers = [*self._closers.values()]
        with ExitStack() as steps:  # all, the last first, whatever they raise
            steps.callback(self._end)
            if self._graph is not None:
                steps.callback(self._graph.close)
            steps.callback(self._token.undeclare)
            for close in closers:
                steps.callback(close)

    # For the objects that it creates

    def on_close(self, key: object, close: Callable[[], None] | None) -> None:
        """Call `close` when the node closes; None to forget it."""
        with self._lock:
            if close is None:
                self._closers.pop(key, None)
            else:
                self._closers[key] = close

    def check_open(self) -> None:
        """Raise NodeClosedError once the node is closed."""
        if self._closed:
            raise NodeClosedError(f"node {self.full_name} is closed")

    def _end(self) -> None:
        self.workers.close(END_LIMIT)
        self.receiving.close(END_LIMIT)
        for session in self._sessions:
            close_session(session)

    def _made(self, part: _E) -> _E:
        self.on_close(part, part.close)
        return part

    def _endpoint(self, kind: wire.EntityKind, type_name: str, name: str, qos: QoS) -> Entity:
        self.check_open()
        return self._entity(
            kind, next(self._ids), self.resolve(name), type_name, self.types.hash(type_name), qos
        )

    def _entity(self, kind: wire.EntityKind, entity_id: int, *rest: Any) -> Entity:  # noqa: ANN401
        return Entity(kind, self.domain, self._session_id, 0, entity_id, self.namespace, self.name, *rest)


class AbsenceWarning:
    """Waits on a thread for the first link of a node, and warns if there is none within some seconds."""

    def __init__(
        self, connected: Callable[[], bool], endpoints: Sequence[str], delay: float = LIMITS.first_link
    ) -> None:
        """Wait for `connected` until `close`; the warning names the endpoints."""
        self._connected: Final = connected
        self._delay: Final = delay
        self._where: Final = ", ".join(endpoints)
        self._end: Final = threading.Event()
        self._thread: threading.Thread | None = None
        if connected():
            return
        thread = threading.Thread(target=self._wait, name="first link to ROS", daemon=True)
        try:
            thread.start()
        except RuntimeError:  # at a limit of threads: the warning comes early rather than never
            self._warn()
        else:
            self._thread = thread

    def close(self) -> None:
        """Warn no more."""
        self._end.set()
        if self._thread is not None:
            self._thread.join(_END_LIMIT)

    def _wait(self) -> None:
        for _ in range(round(self._delay / _CHECK_PERIOD)):
            if self._end.wait(_CHECK_PERIOD) or self._connected():
                return
        self._warn()

    def _warn(self) -> None:
        _logger.warning("nothing of ROS answers at %s so far: start rmw_zenohd or `nao router`", self._where)


def _small_id() -> str:
    """Return a random id for a session that is smaller than those of rmw_zenoh's sessions.

    Such a session says only to routers where it listens, and connects only to peers with a smaller id: so it
    meets ours even without a router. Zenoh compares ids as bytes, the lowest first: eight of ours are 0.
    """
    return f"{secrets.randbits(64) | 1 << 63:x}{0:016x}"
