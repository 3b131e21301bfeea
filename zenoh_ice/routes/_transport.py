"""Carry calls, samples and tokens over Zenoh."""

from __future__ import annotations

import ctypes
import logging
import os
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache, partial
from typing import Any, Final

import zenoh
from zenoh.handlers import Callback

from zenoh_ice.carriers._local.server import LocalServer
from zenoh_ice.carriers.zenoh.session import (
    close_session,
    connect_endpoints,
    explain_endpoints,
    open_session,
    undeclare,
)
from zenoh_ice.carriers.zenoh.tokens import Tokens
from zenoh_ice.data.codec import LARGEST_PAYLOAD, Buffer, Pieces
from zenoh_ice.data.exceptions import CommunicatorDestroyedException, ConnectionLostException, SystemException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target, client_token
from zenoh_ice.data.text import without_source
from zenoh_ice.data.wire import ERROR_ENCODING
from zenoh_ice.routes._calls import Route, RoutedCaller, Routes
from zenoh_ice.routes._given_up import OwnCalls
from zenoh_ice.routes._streams import BulkInlet, Outlet, SmallInlet, bounded
from zenoh_ice.routes.in_process import InProcessCarrier, InProcessTransport
from zenoh_ice.settings import Security, Settings
from zenoh_ice.threads.clock import WALL, Clock
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.threads.pool import Job, Kind, Pool
from zenoh_ice.transport import Caller, NoAnswer, Outcome, Receiver, Registration, Relay, outcome_of, refusal

# Zenoh has five pools of threads by default, and a small call wakes four threads at each end. One thread that
# receives and one that sends do the same work: docs/decisions/0012-zenoh-threads.md has the figures, and says
# why a router keeps the five.
_THREADS: Final = (
    "(rx: (worker_threads: 1), net: (handover: rx), "
    "tx: (worker_threads: 1), acc: (handover: tx), app: (handover: tx))"
)

# Memory that one of Zenoh's threads allocates and another one frees scatters over glibc's arenas, of which
# there are eight for each processor: a calling client grew by 0.8 MB a minute, and not at all with two.
_M_ARENA_MAX: Final = -8
_ARENAS: Final = 2

_MOST_CALLERS: Final = 256  # shared by proxies: each has a querier

_TIMEOUT: Final = b"Timeout"  # Zenoh's own error at the end of a query

_logger = logging.getLogger(__name__)


@contextmanager
def _prepared_process() -> Iterator[None]:
    """Choose threads and memory for Zenoh while it starts: both apply to the whole process."""
    ours = "ZENOH_RUNTIME" not in os.environ
    os.environ.setdefault("ZENOH_RUNTIME", _THREADS)
    if "MALLOC_ARENA_MAX" not in os.environ:
        with suppress(OSError, AttributeError):  # no glibc
            ctypes.CDLL(None).mallopt(_M_ARENA_MAX, _ARENAS)
    try:
        yield
    finally:
        if ours:  # not for child processes: a router among them needs all its threads
            os.environ.pop("ZENOH_RUNTIME", None)


class ZenohTransport:
    """A Zenoh session, usually that of a peer that talks to every other peer directly.

    Calls that arrive are put into the queue of the pool, by C code on Zenoh's thread; threads of the pool
    hand them to their receivers, in that order.
    """

    clock: Clock = WALL
    relay: Relay | None = None

    def __init__(self, settings: Settings, pool: Pool, limits: Limits = LIMITS) -> None:
        """Open the session; raises as `open_session` does."""
        self.settings: Final = settings
        self.pool: Final = pool
        self.limits: Final = limits
        self.token_delay = limits.token_delay
        self.local: Final = InProcessTransport(pool)
        self._lock: Final = threading.Lock()
        self._receivers: Final = self.local.receivers
        self._followed: Final[dict[str, Tokens]] = {}  # by pattern
        self._tokens: Final[dict[str, object]] = {}  # by realm
        self._closed = False
        # Callers that it evicts live on in the calls that hold them.
        self.caller: Final = lru_cache(_MOST_CALLERS)(self._caller)
        pool.place = self._place
        with _prepared_process():
            self.session: Final = open_session(settings)
        try:
            self.id = str(self.session.zid())
            self.endpoints: Sequence[str] = tuple(connect_endpoints(settings))
            # Credentials mean that others decide who may call whom; they see nothing of a socket.
            self.is_local: Final = settings.local_sockets and settings.security == Security()
            self.calls: Final = OwnCalls(self.id)
            self.local.calls = self.calls
            self.routes: Final = Routes(self.local.watch, limits) if self.is_local else None
            self._local_server: LocalServer | None = None
            self._wants_local_server = self.is_local
            self.appear(settings.realm)
        except BaseException:
            self.session.close()
            raise

    @property
    def local_address(self) -> str:
        return "" if self._local_server is None else self._local_server.address

    def route(self, target: Target) -> Route:
        """Return the route to a target."""
        return Route() if self.routes is None else self.routes.route(target)

    def is_near(self, target: Target) -> bool:
        if target.prefix in self._receivers:
            return True
        channels = self.route(target).channels
        return channels is not None and not channels.is_absent

    def explain_unreachable(self, limit: float) -> str:
        return explain_endpoints(self.endpoints, self.settings.security, limit)

    # Calls.

    def _caller(
        self,
        target: Target,
        operation: Operation[..., Any],
        *,
        timeout: float,
        fingerprint: str | None = None,
    ) -> Caller:
        if target.realm != self.settings.realm:
            self.appear(target.realm)
        return RoutedCaller(
            self.calls,
            target,
            operation,
            timeout=timeout,
            fingerprint=fingerprint,
            served_here=self._receivers,
            here=InProcessCarrier(self.local, target.key(operation.name), timeout),
            route=self.route(target),
            network=_NetworkCarrier(self, target, operation, timeout),
        )

    def serve(self, target: Target, receiver: Receiver) -> Registration:
        here = self.local.serve(target, receiver)
        self._open_local_server()
        # Complete: if several processes serve the same identity, one of them gets the call, not all.
        queryable = self.session.declare_queryable(
            target.key("*"), Callback(self.pool.watched_put(), indirect=False), complete=True
        )

        def close() -> None:
            here.close()
            undeclare(queryable)

        return Registration(close)

    def _place(self, query: zenoh.Query) -> Job | None:
        """Give a call its place among those of its servant; return the job that executes or refuses it."""
        key = query.key_expr
        prefix, _, name = str(key).rpartition("/")
        reply = partial(self._reply, query, key)
        try:
            return self._receivers[prefix].admit(name, query.payload, query.attachment, reply)
        except BaseException as failure:  # noqa: BLE001 - it is logged, and answered
            return refusal(failure, str(key), reply)

    def _open_local_server(self) -> None:
        with self._lock:
            if self._wants_local_server and not self._closed:
                self._wants_local_server = False
                try:
                    self._local_server = LocalServer(self.pool, self._receivers, self.id, self.limits)
                except OSError as error:
                    _logger.warning("others of this machine call over the network: no socket: %s", error)

    def _reply(self, query: zenoh.Query, key: zenoh.KeyExpr, ok: bool, answer: bytes | Pieces) -> None:
        """Answer a query and drop it: otherwise its client would hang until the limit."""
        try:  # not `with query`: the sooner it is dropped, the more often both travel in one message
            if ok:
                query.reply(key, bytes(answer))
            else:
                query.reply_err(bytes(answer), encoding=ERROR_ENCODING)
        except zenoh.ZError as error:  # the session was closed meanwhile
            _logger.debug("answer at %s dropped: %s", key, error)
        finally:
            query.drop()

    def refusal(self, what: str, error: zenoh.ZError) -> SystemException:
        """Return the exception for an operation that Zenoh refuses."""
        if self._closed:
            return CommunicatorDestroyedException(f"{what}: the communicator was destroyed")
        return ConnectionLostException(f"{what} could not be sent: {without_source(error)}")

    # Streams.

    def publish(self, target: Target, operation: Operation[..., Any]) -> Outlet:
        key, bulk = target.key(operation.name), operation.result.holds_bytes
        self._open_local_server()
        return Outlet(self.session, key, self._local_server if bulk else None, bulk=bulk)

    def subscribe(
        self, target: Target, operation: Operation[..., Any], queue: int = 1
    ) -> SmallInlet | BulkInlet:
        self.appear(target.realm)
        try:
            if operation.result.holds_bytes:
                return BulkInlet(self, target, operation, queue)
            key = target.key(operation.name)
            return SmallInlet(self.session, key, operation.result.size_limit, queue)
        except zenoh.ZError as error:
            raise self.refusal(operation.name, error) from error

    # Presence.

    def announce(self, token: str) -> Registration:
        return Registration(partial(undeclare, self.session.liveliness().declare_token(token)))

    def watch(self, pattern: str, changed: Callable[[str, bool], object]) -> Registration:
        watch = self.local.watch(pattern, changed)
        with self._lock:
            if pattern not in self._followed:  # one follower for all watchers
                self._followed[pattern] = Tokens(self.session, pattern, self.local.notify, self.pool.submit)
        return watch

    def watch_links(self, changed: Callable[[str, bool], object]) -> Registration:

        def on_event(event: zenoh.TransportEvent) -> None:
            up = event.kind == zenoh.SampleKind.PUT
            peer = str(event.transport.zid)
            changed(peer, up)
            if not up and self.routes is not None:
                self.routes.lost(peer)

        listener = self.session.info.declare_transport_events_listener(
            Callback(on_event, indirect=False), history=True
        )
        return Registration(partial(undeclare, listener))

    def appear(self, realm: str) -> None:
        """Announce this process to the servants of a realm."""
        with self._lock:
            if realm not in self._tokens and not self._closed:
                token = client_token(realm, self.id)
                self._tokens[realm] = self.session.liveliness().declare_token(token)

    # Status.

    def serve_status(self, realm: str, status: Callable[[], bytes]) -> Registration:
        self.pool.reserve(1)  # so that it answers while all servants are busy

        def answer(query: zenoh.Query) -> None:  # on Zenoh's thread
            self.pool.submit(lambda: self._reply(query, query.key_expr, True, status()))

        queryable = self.session.declare_queryable(
            f"@process/{realm}/{self.id}/status", Callback(answer, indirect=False), complete=True
        )
        return Registration(partial(undeclare, queryable))

    def ask_status(self, realm: str, process: str, timeout: float) -> Buffer:
        with suppress(zenoh.ZError):  # no answer
            reply = self.session.get(
                f"@process/{realm}/{process}/status",
                timeout=timeout,
                congestion_control=zenoh.CongestionControl.BLOCK,
                # It must overtake the calls whose failure it is to explain.
                priority=zenoh.Priority.INTERACTIVE_HIGH,
            ).recv()
            if reply.ok is not None:
                return reply.ok.payload
        raise ConnectionLostException(
            f"the process {process} of realm {realm} did not report its status within {timeout:g} s: it is "
            "gone, or hangs, or access control denies it"
        )

    def close(self) -> None:
        with self._lock:
            self._closed = True
        for tokens in tuple(self._followed.values()):
            tokens.close()
        self.local.close()
        if self._local_server is not None:
            self._local_server.close()
        if self.routes is not None:
            self.routes.close()
        close_session(self.session)


class _NetworkCarrier:
    """Carries the calls of one operation over Zenoh, by a querier."""

    def __init__(
        self, transport: ZenohTransport, target: Target, operation: Operation[..., Any], timeout: float
    ) -> None:
        settings, result = transport.settings, operation.result
        self._transport: Final = transport
        self._limit: Final = result.size_limit
        self._kind: Kind | None = None
        self._what: Final = f"reply of {target.identity}.{operation.name}"
        bulk = operation.arguments.holds_bytes or result.holds_bytes
        # A blocked link may block the sender for the limit of the settings, after which Zenoh closes the
        # link; a call with a shorter limit is dropped instead, and ends at its limit.
        drop = timeout < settings.timeout
        try:
            self._get: Final = transport.session.declare_querier(
                target.key(operation.name),
                timeout=timeout,
                # The first reply is enough; replies are not compared with one another.
                consolidation=zenoh.ConsolidationMode.NONE,
                # The reply has the same quality of service. Not express: that halves the calls in flight.
                congestion_control=zenoh.CongestionControl.DROP if drop else zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.DATA_HIGH if bulk else zenoh.Priority.INTERACTIVE_HIGH,
            ).get
        except zenoh.ZError as error:
            raise transport.refusal(operation.name, error) from error

    def call(self, payload: bytes, attachment: bytes) -> Outcome:
        try:
            # No variable holds the channel: the frames of an exception would keep it alive, and a channel
            # that a servant fills with further replies blocks everything on the same link.
            reply = self._get(payload=payload, attachment=attachment or None).recv()
        except zenoh.ZError:  # the end without an answer, of the session too
            raise NoAnswer(timed_out=False) from None
        return self._interpret(reply)

    def begin(
        self, payload: bytes, attachment: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        replies: deque[zenoh.Reply] = deque(maxlen=1)  # a servant may send more than one

        def finish() -> None:  # on a thread of the pool
            done(outcome_of(lambda: self._interpret(replies.pop() if replies else None)))

        cancellation = zenoh.CancellationToken()
        # C code alone on Zenoh's thread: it keeps the reply, and notifies the pool at the end.
        pool = self._transport.pool
        if self._kind is None:
            self._kind = pool.kind()
        handler = Callback(replies.append, partial(pool.put, (self._kind, finish)), indirect=False)
        try:
            self._get(
                handler, payload=payload, attachment=attachment or None, cancellation_token=cancellation
            )
        except zenoh.ZError as error:
            raise self._transport.refusal(self._what, error) from error
        return cancellation.cancel

    def _interpret(self, reply: zenoh.Reply | None) -> Outcome:
        """Return the outcome in a reply; raises NoAnswer for none, and for Zenoh's own error at the limit."""
        if reply is None:
            raise NoAnswer(timed_out=False)
        answer = reply.ok
        if answer is not None:
            return True, bounded(answer.payload, self._limit, self._what)
        error = reply.err
        assert error is not None  # a reply has either a result or an error
        if str(error.encoding) == ERROR_ENCODING:
            return False, bounded(error.payload, LARGEST_PAYLOAD, self._what)
        raise NoAnswer(timed_out=error.payload.to_bytes() == _TIMEOUT)
