"""The server's side of calls: one object for each servant that is served."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import nullcontext
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import zenoh
from zenoh.handlers import RingChannel

from .attachment import NO_ATTACHMENT, Attachment, decode_attachment
from .dispatch import Lane, mark_thread
from .exceptions import (
    InterfaceMismatchException,
    MarshalException,
    OperationNotExistException,
    TimeoutException,
    UserException,
    ZenohIceError,
)
from .identity import Target
from .object import OBJECT_INTERFACE, Current, Object
from .operation import Operation
from .outgoing import settle
from .presence import servant_token
from .publisher import Channel, Publisher
from .wire_errors import ERROR_ENCODING, encode_error, unknown_exception

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["Incoming"]

_MAX_WAITING: Final = 64  # calls of one servant
_CONCURRENT_CALLS: Final = 4  # of a servant that lets its calls overlap

_logger = logging.getLogger(__name__)


class _Context(threading.local):
    """What the current thread is doing."""

    def __init__(self) -> None:
        self.running: list[Incoming] = []
        """The servants whose calls it runs, the innermost last."""


_context: Final = _Context()


class Incoming:
    """Serve one servant under one identity: queryable, tokens, publishers, and the way of a call."""

    def __init__(self, communicator: Communicator, target: Target, servant: Object) -> None:
        self.target: Final = target
        self.servant: Final = servant
        interface = servant.ice_interface
        self.fingerprints: Final = {known.type_id: known.fingerprint for known in interface.lineage}
        self._accepted: Final = frozenset(self.fingerprints.values())
        self._communicator: Final = communicator
        operations = {**interface.all_operations, **OBJECT_INTERFACE.all_operations}
        self._methods: Final[dict[str, tuple[Operation[..., Any], Callable[..., Any], int]]] = {
            name: (
                operation,
                getattr(servant, operation.method),
                communicator.size_limit(operation.arguments),
            )
            for name, operation in operations.items()
        }
        self._width: Final = _CONCURRENT_CALLS if servant.ice_concurrent else 1
        self._turn: Final = nullcontext() if servant.ice_concurrent else threading.Lock()
        self._lane: Final = Lane(
            communicator.dispatcher, target.identity, width=self._width, depth=_MAX_WAITING
        )
        self._prefix: Final = target.prefix
        self._queryable: zenoh.Queryable[zenoh.Handler[zenoh.Query]] | None = None
        self._threads: list[threading.Thread] = []
        self._tokens: list[zenoh.LivelinessToken] = []
        self._channels: list[tuple[Publisher[Any], Channel]] = []

    def activate(self, session: zenoh.Session) -> None:
        """Take calls, then let everybody know."""
        interface = self.servant.ice_interface
        for operation in interface.all_operations.values():
            if operation.streamed:
                publisher = self.servant.ice_publisher(operation)
                limit = self._communicator.size_limit(operation.result)
                key = self._prefix + operation.name
                channel = Channel(session, key, publisher, interface.fingerprint, limit)
                self._channels.append((publisher, channel))
                publisher.attach(channel)
        # A ring: a queue that is full would hold up everything that the session receives. The oldest calls
        # fall out of it; their clients get no answer, from which they know. Our own threads take the calls
        # out, which needs neither code of ours on Zenoh's thread nor another hop to a pool: both cost a small
        # call some 20 us each. Complete: of two servants of one identity one gets a call, not both.
        self._queryable = session.declare_queryable(
            self._prefix + "*", RingChannel(_MAX_WAITING), complete=True
        )
        for number in range(self._width):
            name = f"servant {self.target.identity}" + (f" {number + 1}" if number else "")
            thread = threading.Thread(
                target=self._serve, args=(self._queryable.handler,), name=name, daemon=True
            )
            thread.start()  # first: if Ctrl-C strikes here, what was not started must not be waited for
            self._threads.append(thread)
        # Its own last: who waits for the servant's own interface finds the others, too.
        for known in reversed(interface.lineage):
            key = servant_token(
                self.target, known.type_id, known.fingerprint, self._communicator.client_id, time.time()
            )
            self._tokens.append(session.liveliness().declare_token(key))

    def withdraw(self) -> None:
        """Let everybody know, and take no more calls."""
        while self._tokens:
            self._tokens.pop().undeclare()
        if self._queryable is not None:
            self._queryable.undeclare()  # ends the threads: their channel is closed
            self._queryable = None
        while self._channels:
            publisher, channel = self._channels.pop()
            publisher.detach(channel)
            channel.close()

    def drain(self, timeout: float) -> None:
        """Wait for at most `timeout` s for the calls that run, except one of the current thread."""
        deadline = time.monotonic() + timeout
        ended = self._lane.close(timeout, expected=1 if self._is_running_here() else 0)
        while self._threads:
            thread = self._threads.pop()
            if thread is not threading.current_thread():
                thread.join(max(0.0, deadline - time.monotonic()))
                ended = ended and not thread.is_alive()
        if not ended:
            _logger.error("a call of %s still runs", self.target)

    def call_here(self, name: str, payload: bytes, attachment: bytes, timeout: float) -> tuple[bool, bytes]:
        """Execute a call from this process; return whether it succeeded, and its result or error.

        Both are as they would travel.

        Raises TimeoutException, BusyException, ObjectNotExistException.
        """
        if self._is_running_here():  # the servant calls itself: it must not wait for its own turn
            return self._run(name, payload, attachment, time.monotonic())
        future: Future[tuple[bool, bytes]] = Future()
        call = partial(self._execute, name, payload, attachment, time.monotonic())
        self._lane.submit(partial(settle, future, call))
        with self._communicator.dispatcher.blocked():
            try:
                return future.result(timeout)
            except TimeoutError:
                raise TimeoutException(
                    f"{self.target.identity}.{name} did not answer within {timeout:g} s"
                ) from None

    def _serve(self, handler: zenoh.Handler[zenoh.Query]) -> None:
        mark_thread()
        waiting_since = time.monotonic()
        while True:
            try:
                query = handler.try_recv()
                if query is None:
                    query = handler.recv()
                    waiting_since = time.monotonic()  # nobody waited before it, so who waits came later
            except zenoh.ZError:  # the queryable was undeclared
                return
            try:
                self._answer(query, waiting_since)
            except BaseException:
                _logger.exception("internal error in %s", threading.current_thread().name)
            del query  # not held while the next is waited for: its client would hang

    def _answer(self, query: zenoh.Query, waiting_since: float) -> None:
        with query:  # dropped in any case: a held query hangs its client until the timeout
            key = query.key_expr
            name = str(key).removeprefix(self._prefix)
            try:
                ok, answer = self._execute_query(query, name, waiting_since)
            except BaseException as error:
                _logger.exception("internal error in %s.%s", self.target.identity, name)
                ok, answer = False, encode_error(unknown_exception(error))
            try:
                if ok:
                    query.reply(key, answer)
                else:
                    query.reply_err(answer, encoding=ERROR_ENCODING)
            except zenoh.ZError as error:
                _logger.debug("answer of %s.%s dropped: %s", self.target.identity, name, error)

    def _execute_query(self, query: zenoh.Query, name: str, received: float) -> tuple[bool, bytes]:
        if name not in self._methods:
            return False, encode_error(self._no_operation(name))
        payload, attachment = query.payload, query.attachment
        size = 0 if payload is None else len(payload)
        limit = self._methods[name][2]
        if size > limit:  # before the payload is so much as copied
            what = f"{self.target.identity}.{name}"
            error = MarshalException(f"{what}: a request of {size} bytes where at most {limit} are taken")
            return False, encode_error(error)
        return self._execute(
            name,
            b"\x80" if payload is None else payload.to_bytes(),
            None if attachment is None else attachment.to_bytes(),
            received,
        )

    def _execute(
        self, name: str, payload: bytes, attachment: bytes | None, since: float
    ) -> tuple[bool, bytes]:
        """Run the servant when it is its turn; return whether it succeeded, and its result or error."""
        with self._turn:
            return self._run(name, payload, attachment, since)

    def _run(self, name: str, payload: bytes, attachment: bytes | None, since: float) -> tuple[bool, bytes]:
        what = f"{self.target.identity}.{name}"
        try:
            operation, method, _ = self._methods[name]
        except KeyError:
            return False, encode_error(self._no_operation(name))
        try:
            about = NO_ATTACHMENT if attachment is None else decode_attachment(attachment)
            self._check_fingerprint(about.fingerprint, name)
            _check_patience(about, since, what)
            arguments = operation.arguments.unpack_arguments(payload, what, self._communicator)
        except ZenohIceError as error:
            return False, encode_error(error)
        current = Current(self.target.identity, name, about.client, about.call_id, self._communicator)
        running = _context.running
        running.append(self)
        try:
            result = method(*arguments, current)
        except BaseException as error:  # not even asyncio.CancelledError may end a thread that serves others
            if isinstance(error, UserException) and isinstance(error, operation.exceptions):
                return False, encode_error(error)
            _logger.exception("%s failed, called by %r", what, about.client or "a stranger")
            return False, encode_error(unknown_exception(error))
        finally:
            running.pop()
        try:
            return True, operation.result.pack_result(result, f"result of {what}")
        except MarshalException as error:
            _logger.error("%s", error)
            return False, encode_error(error)

    def _is_running_here(self) -> bool:
        return self in _context.running

    def _check_fingerprint(self, fingerprint: str, name: str) -> None:
        if fingerprint and fingerprint not in self._accepted and not name.startswith("ice_"):
            own = self.servant.ice_interface
            raise InterfaceMismatchException(
                f"{self.target.identity}.{name}: the caller was generated from {fingerprint}, the servant "
                f"{own.type_id} from {own.fingerprint}; generate both from the same IDL",
                expected=fingerprint,
                found=own.fingerprint,
            )

    def _no_operation(self, name: str) -> OperationNotExistException:
        type_id = self.servant.ice_interface.type_id
        return OperationNotExistException(f"{self.target.identity}, a {type_id}, has no operation {name!r}")


def _check_patience(about: Attachment, waiting_since: float, what: str) -> None:
    """Refuse a call whose caller gave up while it waited: what it commands is no longer wanted.

    When it came is not known, only that it was after `waiting_since`. The caller's wall clock, which may be
    wrong on another machine, is believed only where that leaves room for doubt.
    """
    if about.timeout <= 0 or time.monotonic() - waiting_since < about.timeout:
        return
    waited = time.time() - about.wall_time
    if waited >= about.timeout:
        raise TimeoutException(f"{what} waited {waited:.3g} s for its turn and was not executed")
