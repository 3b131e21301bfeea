"""A Zenoh session as a carrier of calls, samples and tokens."""

from __future__ import annotations

import ctypes
import logging
import os
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, Final

import zenoh
from zenoh.handlers import Callback

from zenoh_ice.carriers.zenoh._streams import Sample, SmallInlet, bounded
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
from zenoh_ice.settings import Settings
from zenoh_ice.threads.pool import Job, JobKind, Pool
from zenoh_ice.transport import NoAnswer, Outcome, Receiver, Registration, outcome_of, refusal

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


class Network:
    """A Zenoh session, usually that of a peer that talks to every other peer directly.

    Methods that `Transport` has, too, do what it says there.

    Calls that arrive are put into the queue of the pool, by C code on Zenoh's thread; threads of the pool
    hand them to their receivers, in that order.
    """

    def __init__(self, settings: Settings, pool: Pool, receivers: Mapping[str, Receiver]) -> None:
        """Open the session, for receivers by the prefixes of their targets; raises as `open_session` does."""
        self.settings: Final = settings
        self.pool: Final = pool
        self._receivers: Final = receivers
        self._lock: Final = threading.Lock()
        self._followed: Final[dict[str, Tokens]] = {}  # by pattern
        self._appeared: Final[dict[str, object]] = {}  # our tokens, by realm
        self._closed = False
        pool.place = self._place
        with _prepared_process():
            self.session: Final = open_session(settings)
        try:
            self.id = str(self.session.zid())
            self.endpoints: Sequence[str] = tuple(connect_endpoints(settings))
            self.appear(settings.realm)
        except BaseException:
            self.session.close()
            raise

    def explain_unreachable(self, limit: float) -> str:
        return explain_endpoints(self.endpoints, self.settings.security, limit)

    @contextmanager
    def refusing(self, what: str) -> Iterator[None]:
        """Raise a SystemException for what Zenoh refuses."""
        try:
            yield
        except zenoh.ZError as error:
            if self._closed:
                raise CommunicatorDestroyedException(f"{what}: the communicator was destroyed") from error
            raise ConnectionLostException(f"{what} could not be sent: {without_source(error)}") from error

    # Calls.

    def serve(self, target: Target) -> Registration:
        """Pass the calls of a target to its receiver."""
        # Complete: if several processes serve the same identity, one of them gets the call, not all.
        queryable = self.session.declare_queryable(
            target.key("*"), Callback(self.pool.watched_put(), indirect=False), complete=True
        )
        return Registration(partial(undeclare, queryable))

    def _place(self, query: zenoh.Query) -> Job | None:
        """Give a call its place among those of its servant; return the job that executes or refuses it."""
        key = query.key_expr
        prefix, _, name = str(key).rpartition("/")
        reply = partial(self._reply, query, key)
        try:
            return self._receivers[prefix].admit(name, query.payload, query.attachment, reply)
        except BaseException as failure:  # noqa: BLE001 - it is logged, and answered
            return refusal(failure, str(key), reply)

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

    # Streams.

    def listen(self, key: str, limit: int, queue: int) -> SmallInlet:
        """Return a listening end of a stream of small values."""
        with self.refusing(key):
            return SmallInlet(self.session, key, limit, queue)

    def subscribe(self, key: str, keep: Callable[[Sample], object]) -> Registration:
        """Call a function with each sample of a stream, on Zenoh's thread."""
        with self.refusing(key):
            subscriber = self.session.declare_subscriber(key, Callback(keep, indirect=False))
        return Registration(partial(undeclare, subscriber))

    # Presence.

    def appear(self, realm: str) -> None:
        """Announce this process to the servants of a realm."""
        with self._lock:
            if realm not in self._appeared and not self._closed:
                token = client_token(realm, self.id)
                self._appeared[realm] = self.session.liveliness().declare_token(token)

    def announce(self, token: str) -> Registration:
        return Registration(partial(undeclare, self.session.liveliness().declare_token(token)))

    def follow(self, pattern: str, changed: Callable[[str, bool], object]) -> None:
        """Report the tokens of a pattern until the end; the first call for a pattern counts."""
        with self._lock:
            if pattern not in self._followed:
                self._followed[pattern] = Tokens(self.session, pattern, changed, self.pool.submit)

    def watch_links(self, changed: Callable[[str, bool], object]) -> Registration:
        def on_event(event: zenoh.TransportEvent) -> None:
            changed(str(event.transport.zid), event.kind == zenoh.SampleKind.PUT)

        listener = self.session.info.declare_transport_events_listener(
            Callback(on_event, indirect=False), history=True
        )
        return Registration(partial(undeclare, listener))

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
        why = "it is gone, or not known here yet, or access control denies it"
        with suppress(zenoh.ZError):  # nobody is known who would answer: this ends at once
            reply = self.session.get(
                f"@process/{realm}/{process}/status",
                timeout=timeout,
                congestion_control=zenoh.CongestionControl.BLOCK,
                # It must overtake the calls whose failure it is to explain.
                priority=zenoh.Priority.INTERACTIVE_HIGH,
            ).recv()
            if reply.ok is not None:
                return reply.ok.payload
            why = f"there was no answer within {timeout:g} s"
        what = f"the process {process} of realm {realm} did not report its status"
        raise ConnectionLostException(f"{what}: {why}")

    def close(self) -> None:
        with self._lock:
            self._closed = True
        for tokens in tuple(self._followed.values()):
            tokens.close()
        close_session(self.session)


class NetworkCalls:
    """Carries the calls of one operation over Zenoh, by a querier."""

    def __init__(
        self, network: Network, target: Target, operation: Operation[..., Any], timeout: float
    ) -> None:
        settings, result = network.settings, operation.result
        self._network: Final = network
        self._limit: Final = result.size_limit
        self._kind: JobKind | None = None
        self._what: Final = f"reply of {target.identity}.{operation.name}"
        bulk = operation.arguments.holds_bytes or result.holds_bytes
        # A blocked link may block the sender for the limit of the settings, after which Zenoh closes the
        # link; a call with a shorter limit is dropped instead, and ends at its limit.
        drop = timeout < settings.timeout
        with network.refusing(operation.name):
            self._get: Final = network.session.declare_querier(
                target.key(operation.name),
                timeout=timeout,
                # The first reply is enough; replies are not compared with one another.
                consolidation=zenoh.ConsolidationMode.NONE,
                # The reply has the same quality of service. Not express: that halves the calls in flight.
                congestion_control=zenoh.CongestionControl.DROP if drop else zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.DATA_HIGH if bulk else zenoh.Priority.INTERACTIVE_HIGH,
            ).get

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
        pool = self._network.pool
        if self._kind is None:
            self._kind = pool.kind()
        handler = Callback(replies.append, partial(pool.put, (self._kind, finish)), indirect=False)
        with self._network.refusing(self._what):
            self._get(
                handler, payload=payload, attachment=attachment or None, cancellation_token=cancellation
            )
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
