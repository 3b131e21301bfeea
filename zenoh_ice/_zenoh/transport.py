"""Carry calls, samples and tokens over Zenoh."""

from __future__ import annotations

import ctypes
import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cached_property, lru_cache, partial
from typing import Any, Final

import zenoh
from zenoh.handlers import Callback

from .._codec import LARGEST_PAYLOAD, Pieces
from .._given_up import OwnCalls
from .._local.channel import NotSent, Outgoing
from .._local.door import Door
from .._local.routes import Neighborhood, Route
from .._pool import Job, Kind, Pool
from .._token_keys import client_token
from .._wire import ERROR_ENCODING
from ..clock import WALL, Clock
from ..exceptions import (
    CommunicatorDestroyedException,
    ConnectionLostException,
    SystemException,
)
from ..in_process import InProcessTransport
from ..interface import Operation
from ..limits import LIMITS, Limits
from ..session import close_session, connect_endpoints, explain_endpoints, open_session, undeclare
from ..settings import Security, Settings
from ..text import without_source
from ..tokens import Tokens
from ..transport import (
    Buffer,
    Caller,
    NoAnswer,
    Outcome,
    Receiver,
    Relay,
    Served,
    Target,
    admit,
    outcome_of,
)
from .streams import BulkInlet, Outlet, SmallInlet, bounded

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
        self.caller: Final = lru_cache(_MOST_CALLERS)(partial(_Caller, self))
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
            self.neighborhood: Final = (
                Neighborhood(pool, self.local.watch, self.calls, limits) if self.is_local else None
            )
            self._door: Door | None = None
            self._wants_door = self.is_local
            self.appear(settings.realm)
        except BaseException:
            self.session.close()
            raise

    @property
    def door(self) -> str:
        return "" if self._door is None else self._door.address

    def route(self, target: Target) -> Route | None:
        """Return the route to a target; None where all goes over Zenoh."""
        return None if self.neighborhood is None else self.neighborhood.route(target)

    def is_near(self, target: Target) -> bool:
        if target.prefix in self._receivers:
            return True
        route = self.route(target)
        neighbor = None if route is None else route.way
        return neighbor is not None and not neighbor.is_absent

    def explain_unreachable(self, limit: float) -> str:
        return explain_endpoints(self.endpoints, self.settings.security, limit)

    # Calls.

    def serve(self, target: Target, receiver: Receiver) -> Served:
        here = self.local.serve(target, receiver)
        self._open_door()
        # Complete: if several processes serve the same identity, one of them gets the call, not all.
        queryable = self.session.declare_queryable(
            target.key("*"), Callback(self.pool.watched_put(), indirect=False), complete=True
        )

        def close() -> None:
            here.close()
            undeclare(queryable)

        return Served(close)

    def _place(self, query: zenoh.Query) -> Job | None:
        """Give a call its place among those of its servant; return the job that executes or refuses it."""
        key = query.key_expr
        prefix, _, name = str(key).rpartition("/")
        receiver = self._receivers.get(prefix)
        reply = partial(self._reply, query, key)
        return admit(receiver, prefix, name, query.payload, query.attachment, reply=reply)

    def _open_door(self) -> None:
        with self._lock:
            if self._wants_door and not self._closed:
                self._wants_door = False
                try:
                    self._door = Door(self.pool, self._receivers, self.id, self.limits)
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
        self._open_door()
        door = self._door if bulk else None
        return Outlet(self.session, key, door, bulk=bulk)

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

    def announce(self, token: str) -> Served:
        return Served(partial(undeclare, self.session.liveliness().declare_token(token)))

    def watch(self, pattern: str, changed: Callable[[str, bool], object]) -> Served:
        watch = self.local.watch(pattern, changed)
        with self._lock:
            if pattern not in self._followed:  # one follower for all watchers
                self._followed[pattern] = Tokens(self.session, pattern, self.local.notify, self.pool.submit)
        return watch

    def watch_links(self, changed: Callable[[str, bool], object]) -> Served:

        def on_event(event: zenoh.TransportEvent) -> None:
            up = event.kind == zenoh.SampleKind.PUT
            peer = str(event.transport.zid)
            changed(peer, up)
            if not up and self.neighborhood is not None:
                self.neighborhood.lost(peer)

        listener = self.session.info.declare_transport_events_listener(
            Callback(on_event, indirect=False), history=True
        )
        return Served(partial(undeclare, listener))

    def appear(self, realm: str) -> None:
        """Announce this process to the servants of a realm."""
        with self._lock:
            if realm not in self._tokens and not self._closed:
                token = client_token(realm, self.id)
                self._tokens[realm] = self.session.liveliness().declare_token(token)

    # Status.

    def serve_status(self, realm: str, status: Callable[[], bytes]) -> Served:
        self.pool.reserve(1)  # so that it answers while all servants are busy

        def answer(query: zenoh.Query) -> None:  # on Zenoh's thread
            self.pool.submit(lambda: self._reply(query, query.key_expr, True, status()))

        queryable = self.session.declare_queryable(
            f"@process/{realm}/{self.id}/status", Callback(answer, indirect=False), complete=True
        )
        return Served(partial(undeclare, queryable))

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
        if self._door is not None:
            self._door.close()
        if self.neighborhood is not None:
            self.neighborhood.close()
        close_session(self.session)

    def abandon(self) -> None:
        if self._door is not None:
            self._door.abandon()
        if self.neighborhood is not None:
            self.neighborhood.abandon()


class _Caller:
    def __init__(
        self,
        transport: ZenohTransport,
        target: Target,
        operation: Operation[..., Any],
        *,
        timeout: float,
        fingerprint: str | None = None,
    ) -> None:
        settings, result = transport.settings, operation.result
        if target.realm != settings.realm:
            transport.appear(target.realm)
        self.timeout: Final = timeout
        self._transport: Final = transport
        self._target: Final = target
        self._operation: Final = operation
        self._fingerprint: Final = fingerprint
        self._calls: Final = transport.calls
        self._prefix: Final = target.prefix
        self._receivers: Final = transport.local.receivers
        self._route: Final = transport.route(target)
        self._limit: Final = result.size_limit
        self._kind: Kind | None = None
        self._what: Final = f"reply of {target.identity}.{operation.name}"
        self._outgoing: Final = Outgoing(self._prefix, operation.name, timeout, self._limit, self._what)
        bulk = operation.arguments.holds_bytes or result.holds_bytes
        # A blocked link may block the sender for the limit of the settings, after which Zenoh closes the
        # link; a call with a shorter limit is dropped instead, and ends at its limit.
        drop = timeout < settings.timeout
        try:
            self._get: Final = transport.session.declare_querier(
                f"{self._prefix}/{operation.name}",
                timeout=timeout,
                # The first reply is enough; replies are not compared with one another.
                consolidation=zenoh.ConsolidationMode.NONE,
                # The reply has the same quality of service. Not express: that halves the calls in flight.
                congestion_control=zenoh.CongestionControl.DROP if drop else zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.DATA_HIGH if bulk else zenoh.Priority.INTERACTIVE_HIGH,
            ).get
        except zenoh.ZError as error:
            raise transport.refusal(operation.name, error) from error

    @cached_property
    def _here(self) -> Caller:
        local = self._transport.local
        return local.caller(
            self._target, self._operation, timeout=self.timeout, fingerprint=self._fingerprint
        )

    def call(self, payload: bytes) -> Outcome:
        if self._prefix in self._receivers:
            return self._here.call(payload)
        number = next(self._calls.numbers)
        try:
            if (route := self._route) is not None and (neighbor := route.way) is not None:
                with suppress(NotSent):
                    if route.in_channel:
                        return self._call_in_channel(number, payload)
                    attachment, named = self._attach(number)
                    return self._heard(named, neighbor.call(self._outgoing, payload, attachment))
            attachment, named = self._attach(number)
            try:
                # No variable holds the channel: the frames of an exception would keep it alive, and a channel
                # that a servant fills with further replies blocks everything on the same link.
                reply = self._get(payload=payload, attachment=attachment or None).recv()
            except zenoh.ZError:  # the end without an answer, of the session too
                raise NoAnswer(timed_out=False) from None
            return self._heard(named, self._interpret(reply))
        except BaseException:  # an interrupt, too
            self._calls.give_up(self._target, number)
            raise

    def _call_in_channel(self, number: int, payload: bytes) -> Outcome:
        """Call after the calls in flight."""
        begin = partial(self._begin, number, payload)
        outcome: Outcome | SystemException = self._transport.local.wait_for(begin, self.timeout)
        if isinstance(outcome, SystemException):
            raise outcome
        return outcome

    def begin(
        self, payload: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        return self._begin(next(self._calls.numbers), payload, done)

    def _begin(
        self, number: int, payload: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        route, target, calls = self._route, self._target, self._calls
        named: tuple[int, ...] = ()

        def end(outcome: Outcome | SystemException) -> None:  # on a thread of the pool
            # Before its way is free for others: calls that take another one are to name it.
            if isinstance(outcome, NoAnswer):
                calls.give_up(target, number)
            elif named:
                calls.heard(target, named)
            if route is not None:
                route.in_channel.discard(number)
                route.over_network.pop(number, None)
            done(outcome)

        # Servants of this process, too, are called through the session, because it enforces the limit.
        if route is not None and (neighbor := route.way) is not None and self._prefix not in self._receivers:
            with suppress(NotSent):
                route.of_channel = neighbor
                channel = neighbor.channel(self.timeout)
                route.in_channel.add(number)
                attachment, named = self._attach(number)
                channel.begin(self._outgoing, payload, attachment, end)
                return partial(calls.give_up, target, number)
            route.in_channel.discard(number)
        if route is not None:
            route.over_network[number] = time.monotonic() + self.timeout
        replies: deque[zenoh.Reply] = deque(maxlen=1)  # a servant may send more than one

        def finish() -> None:  # on a thread of the pool
            end(outcome_of(lambda: self._interpret(replies.pop() if replies else None)))

        cancellation = zenoh.CancellationToken()
        # C code alone on Zenoh's thread: it keeps the reply, and notifies the pool at the end.
        pool = self._transport.pool
        if self._kind is None:
            self._kind = pool.kind()
        handler = Callback(replies.append, partial(pool.put, (self._kind, finish)), indirect=False)
        attachment, named = self._attach(number)
        try:
            self._get(
                handler, payload=payload, attachment=attachment or None, cancellation_token=cancellation
            )
        except zenoh.ZError as error:
            if route is not None:
                route.over_network.pop(number, None)
            raise self._transport.refusal(self._what, error) from error

        def cancel() -> None:
            calls.give_up(target, number)
            cancellation.cancel()

        return cancel

    def _attach(self, number: int) -> tuple[bytes, tuple[int, ...]]:
        return self._calls.attach(self._target, number, self._fingerprint, self.timeout)

    def _heard(self, named: tuple[int, ...], outcome: Outcome) -> Outcome:
        """Return the outcome of a call that named others as given up: its servant knows them now."""
        if named:
            self._calls.heard(self._target, named)
        return outcome

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
