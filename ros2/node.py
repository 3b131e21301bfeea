"""A ROS 2 node over a Zenoh session: publishers, subscriptions, services and their clients.

Nodes and all their parts are thread-safe. Callbacks run on the node's threads, one at a time for each
subscription and service.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import math
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future, InvalidStateError
from concurrent.futures import TimeoutError as FutureTimeoutError
from typing import Any, Final, Self, TypeVar

import zenoh
import zenoh.ext
from zenoh.handlers import Callback

from zenoh_ice import Sample, Settings
from zenoh_ice.session import close_session, open_session
from zenoh_ice.text import printable

from . import wire
from .exceptions import CallError, CallTimeoutError, MessageError, NodeClosedError, RosError
from .graph import Graph
from .messages import LARGEST_MESSAGE, Types
from .wire import Attachment, Entity, QoS
from .workers import Job, Line, Workers

DEFAULT_SETTINGS: Final = Settings(connect=("tcp/127.0.0.1:7447",))
"""The default router, the same as that of rmw_zenoh's nodes."""

LONGEST_CALL: Final = 24 * 3600.0
"""Limit in s of a call without a given limit, such as waiting for an action's result."""

LARGEST_REQUEST: Final = 4 << 20
"""Maximum bytes of a request or a goal: a megabyte of tiny nested messages takes a second to decode."""

_MOST_REQUESTS: Final = 256  # that wait for one service
_GRACE: Final = 0.5  # s by which a call may end after its limit
_TIMED_OUT: Final = "Timeout"  # Zenoh's own error
_FIRST_WARNINGS: Final = 3  # malformed messages of a subscription that are logged

_logger = logging.getLogger(__name__)

Handler = Callable[[Any], Any]
_E = TypeVar("_E", bound="_Endpoint")


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
    ) -> None:
        """Open a session and announce a node.

        `domain` is ROS_DOMAIN_ID or 0 by default; `settings.connect` has the endpoints of the router, or of
        other nodes. `remap` has other names for topics and services. `clock` gives ns since 1970 for stamps:
        for a simulated robot, its own time instead of wall time. Raises RosError for bad names, and the
        exceptions of `open_session`.
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
        self.workers: Final = Workers(f"node {name}")
        self.session: Final = open_session(settings)
        try:
            self._session_id: Final = str(self.session.zid())
            self.graph: Final = Graph(self.session, self.domain)
            self._token = self.session.liveliness().declare_token(self._entity("NN", 0).token())
        except zenoh.ZError as error:
            close_session(self.session)
            raise RosError(f"node {name}: {error}") from error
        if settings.connect and not self.connected:
            where = ", ".join(settings.connect)
            _logger.warning("nothing of ROS answers at %s so far: start rmw_zenohd or `nao router`", where)

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
    ) -> Subscription:
        """Subscribe to a topic; the callback gets each message."""
        return self._made(Subscription(self, self._endpoint("MS", type_name, topic, qos), callback))

    def create_client(self, type_name: str, service: str) -> Client:
        """Announce that a service will be called."""
        return self._made(Client(self, self._endpoint("SC", type_name, service, QoS())))

    def create_service(self, type_name: str, service: str, handler: Handler) -> Service:
        """Serve a service: the handler gets each request.

        It returns the response: a message, a mapping of its fields, or a Future of either.
        """
        return self._made(Service(self, self._endpoint("SS", type_name, service, QoS()), handler))

    def close(self) -> None:
        """Withdraw everything, the newest first, and close the session."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            closers = [*self._closers.values()]
        for close in reversed(closers):
            close()
        self._token.undeclare()
        self.graph.close()
        self.workers.close()
        close_session(self.session)

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


class _Endpoint:
    """The common part of everything that a node creates: its entity, its key, its token, and its end."""

    def __init__(self, node: Node, entity: Entity) -> None:
        self.node: Final = node
        self.entity: Final = entity
        self.name: Final = entity.name
        self.type_name: Final = entity.type_name
        self._gid: Final = entity.gid()
        self._key: Final = wire.key(entity.domain, entity.name, entity.type_name, entity.type_hash)
        self._numbers: Final = itertools.count(1)
        self._declared: list[Any] = []
        self._closed = False

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
        for each in reversed(self._declared):  # the token first
            each.undeclare()


class Publisher(_Endpoint):
    """Publishes the messages of a topic."""

    def __init__(self, node: Node, entity: Entity) -> None:
        super().__init__(node, entity)
        congestion = zenoh.CongestionControl
        waits = entity.qos.reliability == "reliable" and entity.qos.keep_all  # as in rmw_zenoh
        control = congestion.BLOCK if waits else congestion.DROP
        if entity.qos.durability == "transient_local":
            self._publisher: Any = zenoh.ext.declare_advanced_publisher(
                node.session,
                self._key,
                cache=zenoh.ext.CacheConfig(entity.qos.queue),
                sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None),
                publisher_detection=True,
                congestion_control=control,
            )
        else:
            self._publisher = node.session.declare_publisher(self._key, congestion_control=control)
        self._announce(self._publisher)
        self._turn: Final = threading.Lock()

    @property
    def subscribers(self) -> int:
        """Return the number of subscriptions of the topic, according to the graph."""
        return len(self.node.graph.subscriptions(self.name))

    def publish(self, message: object = None, /, **fields: object) -> None:
        """Publish a message, or one with some fields; raises MessageError for a wrong value."""
        self._check_open()
        data = self.node.types.encode(self.node.types.coerce(self.type_name, message, **fields))
        with self._turn:  # they are sent in the order of their numbers
            _, attachment = self._attachment()
            try:
                self._publisher.put(data, attachment=attachment)
            except zenoh.ZError as error:
                self._check_open()  # it was closed meanwhile
                raise RosError(f"{self.name}: {error}") from error


class Subscription(_Endpoint):
    """Receives the messages of a topic: the newest, the next one, or each by a callback."""

    def __init__(self, node: Node, entity: Entity, callback: Handler | None) -> None:
        super().__init__(node, entity)
        self.malformed = 0
        """Number of messages that did not follow their type; they are dropped."""
        self.lost = 0
        """Number of messages dropped because a callback was too slow, or lost on the way."""
        self._callback: Final = callback
        self._line: Final = Line(node.workers, entity.qos.queue)
        self._changed: Final = threading.Condition()
        self._newest: Sample[Any] | None = None
        self._received = 0
        self._last: dict[bytes, int] = {}  # number of the newest message of each publisher
        if entity.qos.durability == "transient_local":
            subscriber: Any = zenoh.ext.declare_advanced_subscriber(
                node.session,
                self._key,
                Callback(self._receive, indirect=False),
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=entity.qos.queue),
            )
        else:
            subscriber = node.session.declare_subscriber(self._key, Callback(self._receive, indirect=False))
        self._announce(subscriber)

    @property
    def publishers(self) -> int:
        """Return the number of publishers of the topic, according to the graph."""
        return len(self.node.graph.publishers(self.name))

    def latest(self) -> Sample[Any] | None:
        """Return the newest message with its age, without waiting; None before the first."""
        return self._newest

    def next(self, timeout: float) -> Sample[Any]:
        """Wait for the next message that arrives from now on; raises CallTimeoutError."""
        with self._changed:
            seen = self._received
            if not self._changed.wait_for(lambda: self._received > seen or self._closed, timeout):
                raise CallTimeoutError(f"{self.name}: no message within {timeout:g} s")
            self._check_open()
            assert self._newest is not None
            return self._newest

    def close(self) -> None:
        """Stop receiving; wake threads that wait for a message."""
        super().close()
        with self._changed:
            self._changed.notify_all()

    def _receive(self, received: zenoh.Sample) -> None:
        """Decode a message, on Zenoh's thread: newer ones must not overtake it."""
        attachment = Attachment.decode(received.attachment.to_bytes()) if received.attachment else None
        try:
            if attachment is None:
                raise MessageError("its attachment is none of rmw_zenoh")
            check_size(received.payload)
            message = self.node.types.decode(received.payload.to_bytes(), self.type_name)
        except RosError as error:
            self._reject(error)
            return
        with self._changed:
            number, last = attachment.sequence, self._last.get(attachment.gid)
            lost = max(0, number - last - 1) if last is not None else 0
            if len(self._last) > 1024:  # publishers come and go
                self._last.clear()
            self._last[attachment.gid] = number
            self.lost += lost
            self._newest = Sample(
                message, number, math.nan, attachment.stamp / 1e9, lost, attachment.gid.hex()
            )
            self._received += 1
            self._changed.notify_all()
        if self._callback is not None and self._line.put(lambda: self._deliver(message)) is not None:
            self.lost += 1

    def _deliver(self, message: object) -> None:
        if self._callback is not None and not self._closed:
            self._callback(message)

    def _reject(self, error: RosError) -> None:
        self.malformed += 1
        if self.malformed <= _FIRST_WARNINGS:
            more = "; further ones are only counted" if self.malformed == _FIRST_WARNINGS else ""
            _logger.warning("%s: a malformed message is dropped: %s%s", self.name, error, more)


class Client(_Endpoint):
    """Calls a service."""

    def __init__(self, node: Node, entity: Entity) -> None:
        super().__init__(node, entity)
        self._calls: set[Future[Any]] = set()
        self._lock: Final = threading.Lock()
        self._announce()

    @property
    def ready(self) -> bool:
        """Return whether a server is present."""
        return bool(self.node.graph.servers(self.name))

    def wait(self, timeout: float) -> None:
        """Wait until a server is present; raises CallTimeoutError."""
        if not self.node.graph.wait(lambda: self.ready, timeout):
            raise CallTimeoutError(f"{self.name}: no server within {timeout:g} s")

    def call(self, request: object = None, /, *, timeout: float = 2.0, **fields: object) -> Any:  # noqa: ANN401
        """Call the service and return its response.

        Raises MessageError for a request that does not fit, CallTimeoutError without a response in time,
        and CallError when there is no server, or it fails.
        """
        future = self._start(lambda job: job(), request, timeout, fields)
        try:
            return future.result(timeout + _GRACE)
        except FutureTimeoutError as error:
            raise CallTimeoutError(f"{self.name}: no response within {timeout:g} s") from error

    def call_async(
        self, request: object = None, /, *, timeout: float = LONGEST_CALL, **fields: object
    ) -> Future[Any]:
        """Call the service; return the future of its response, whose callbacks run on the node's threads."""
        return self._start(self.node.workers.submit, request, timeout, fields)

    def _start(
        self, run: Callable[[Job], object], request: object, timeout: float, fields: Mapping[str, object]
    ) -> Future[Any]:
        """Send a request; `run` runs the job that ends its future."""
        self._check_open()
        types = self.node.types
        data = types.encode(types.coerce(f"{self.type_name}_Request", request, **fields))
        number, attachment = self._attachment()
        deadline = time.monotonic() + timeout
        future: Future[Any] = Future()
        with self._lock:
            self._calls.add(future)
        future.add_done_callback(self._calls.discard)
        replies: deque[zenoh.Reply] = deque(maxlen=1)  # the first response, or else the newest error

        def answered() -> bool:
            return bool(replies) and replies[0].ok is not None

        def receive(reply: zenoh.Reply) -> None:
            if not answered():
                replies.append(reply)
                if answered():
                    run(end)  # another server of the service may be slow, or silent

        def end() -> None:
            try:
                response = self._response(replies[0], number) if replies else self._no_response(deadline)
            except RosError as error:
                fail(future, error)
            else:
                with contextlib.suppress(InvalidStateError):  # closing ended it
                    future.set_result(response)

        handler = Callback(receive, lambda: None if answered() else run(end), indirect=False)
        try:
            self.node.session.get(
                self._key,
                handler,
                target=zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
                payload=data,
                attachment=attachment,
                timeout=timeout,
            )
        except zenoh.ZError as error:
            fail(future, CallError(f"{self.name}: {error}"))
        return future

    def _response(self, reply: zenoh.Reply, number: int) -> Any:  # noqa: ANN401
        if reply.ok is None:
            why = reply.err.payload.to_bytes().decode(errors="replace") if reply.err else ""
            if why == _TIMED_OUT:
                raise CallTimeoutError(f"{self.name}: no response in time")
            raise CallError(f"{self.name}: {printable(why)[:500]}")
        answered = Attachment.decode(reply.ok.attachment.to_bytes()) if reply.ok.attachment else None
        if answered is None or (answered.sequence, answered.gid) != (number, self._gid):
            raise CallError(f"{self.name}: a response came that belongs to another request")
        check_size(reply.ok.payload)
        return self.node.types.decode(reply.ok.payload.to_bytes(), f"{self.type_name}_Response")

    def _no_response(self, deadline: float) -> Any:  # noqa: ANN401
        if time.monotonic() >= deadline:
            raise CallTimeoutError(f"{self.name}: no response in time")
        there = "its server was lost, or does not answer" if self.ready else "there is no server"
        raise CallError(f"{self.name}: {there}")

    def close(self) -> None:
        """Stop; pending calls fail."""
        super().close()
        with self._lock:
            calls = [*self._calls]
        for each in calls:
            fail(each, NodeClosedError(f"{self.name}: it was closed during the call"))


class Service(_Endpoint):
    """Serves a service."""

    def __init__(self, node: Node, entity: Entity, handler: Handler) -> None:
        super().__init__(node, entity)
        self.malformed = 0
        """Number of requests that did not follow their type; they are refused."""
        self._handler: Final = handler
        self._line: Final = Line(node.workers, _MOST_REQUESTS)
        self._announce(
            node.session.declare_queryable(self._key, Callback(self._receive, indirect=False), complete=True)
        )

    def _receive(self, query: zenoh.Query) -> None:
        """Take a request from Zenoh's thread."""
        attachment = Attachment.decode(query.attachment.to_bytes()) if query.attachment else None
        try:
            if attachment is None or query.payload is None:
                raise MessageError("a request has a payload, and an attachment of 33 bytes")
            check_size(query.payload, LARGEST_REQUEST)
            request = self.node.types.decode(query.payload.to_bytes(), f"{self.type_name}_Request")
        except MessageError as error:
            self.malformed += 1
            _logger.debug("%s: a malformed request: %s", self.name, error)
            self._refuse(query, str(error))
            return
        dropped = self._line.put(_Request(self, query, attachment, request))
        if isinstance(dropped, _Request):
            self._refuse(dropped.query, f"more than {_MOST_REQUESTS} requests wait")

    def _refuse(self, query: zenoh.Query, why: str) -> None:
        try:
            query.reply_err(why.encode())
        except zenoh.ZError as error:  # the client is gone
            _logger.debug("%s: %s", self.name, error)
        finally:
            query.drop()

    def handle(self, request: _Request) -> None:
        """Run the handler of a request, and answer now or when its future is done."""
        try:
            response = self._handler(request.message)
        except Exception as error:
            _logger.exception("%s: its handler failed", self.name)
            self._refuse(request.query, f"the handler failed: {type(error).__name__}: {error}")
            return
        if isinstance(response, Future):
            response.add_done_callback(lambda done: self._answer_future(request, done))
        else:
            self._answer(request, response)

    def _answer_future(self, request: _Request, done: Future[Any]) -> None:
        if done.cancelled() or done.exception() is not None:
            self._refuse(request.query, str(done.exception() if not done.cancelled() else "it was cancelled"))
        else:
            self._answer(request, done.result())

    def _answer(self, request: _Request, response: object) -> None:
        name = f"{self.type_name}_Response"
        try:
            data = self.node.types.encode(self.node.types.coerce(name, response))
        except MessageError as error:
            _logger.error("%s: its handler returned what is no response: %s", self.name, error)
            self._refuse(request.query, str(error))
            return
        asked = request.attachment
        try:
            request.query.reply(
                self._key, data, attachment=Attachment(asked.sequence, time.time_ns(), asked.gid).encode()
            )
        except zenoh.ZError as error:  # the client is gone
            _logger.debug("%s: %s", self.name, error)
        finally:
            request.query.drop()


class _Request:
    """A request that waits for its turn."""

    def __init__(self, service: Service, query: zenoh.Query, attachment: Attachment, message: object) -> None:
        self.service: Final = service
        self.query: Final = query
        self.attachment: Final = attachment
        self.message: Final = message

    def __call__(self) -> None:
        self.service.handle(self)


def fail(future: Future[Any], error: Exception) -> None:
    """End a future with an error, unless it has ended."""
    with contextlib.suppress(InvalidStateError):
        future.set_exception(error)


def check_size(payload: zenoh.ZBytes, most: int = LARGEST_MESSAGE) -> None:
    """Raise MessageError for a payload that is too large to be copied."""
    if len(payload) > most:
        raise MessageError(f"{len(payload)} bytes; at most {most} are decoded")
