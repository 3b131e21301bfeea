"""The client's side of calls: one object for each operation of each servant that is called."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import zenoh
from zenoh.handlers import Callback

from .attachment import encode_call_attachment
from .exceptions import (
    BusyException,
    CommunicatorDestroyedException,
    ConnectionLostException,
    InterfaceMismatchException,
    MarshalException,
    TimeoutException,
)
from .identity import Target
from .mismatch import with_difference
from .operation import Interface, Operation
from .session import send_limit
from .shared_memory import read_payload
from .stop_signals import unbroken
from .wire_errors import ERROR_ENCODING, decode_error

if TYPE_CHECKING:
    from .communicator import Communicator
    from .incoming import Incoming

__all__ = ["OutgoingCall", "fail", "settle"]

# s in which the token of a servant that died during a call goes away; measured 2-3 ms.
_LOSS_NOTICE: Final = 0.25
# s in which word comes that the link was closed over which a message could not be sent.
_CLOSE_NOTICE: Final = 1.0
# s for which the one retry of an idempotent call waits for the servant to be back.
_RETRY_WAIT: Final = 0.5

_Request = tuple[bytes, bytes]  # payload and attachment

_logger = logging.getLogger(__name__)


class OutgoingCall:
    """Call one operation of one servant, remote or in this process, within one limit of time."""

    def __init__(
        self,
        communicator: Communicator,
        target: Target,
        operation: Operation[..., Any],
        interface: Interface,
        timeout: float,
    ) -> None:
        self.what: Final = f"{target.identity}.{operation.name}"
        self._communicator: Final = communicator
        self._target: Final = target
        self._operation: Final = operation
        self._interface: Final = interface
        self._fingerprint: Final = interface.fingerprint
        self._timeout: Final = timeout
        self._local: Final = communicator.local_servants
        self._request_limit: Final = communicator.size_limit(operation.arguments)
        self._reply_limit: Final = communicator.size_limit(operation.result)
        self._client: Final = communicator.client_id
        self._numbers: Final = communicator.call_numbers
        self._pack: Final = operation.arguments.pack
        self._unpack: Final = operation.result.unpack_result
        bulk = operation.result.holds_bytes or operation.arguments.holds_bytes
        # A call is sent from the caller's own thread, which is fastest, unless that may hold it up for
        # longer than the call may take: Zenoh takes no limit for one message.
        self._send_limit: Final = send_limit(communicator.settings)
        self._hurried: Final = timeout < self._send_limit
        self._lane: Final = communicator.sending_lane(target)
        # The reply travels as the request does. Dropping either where the link is busy would lose calls. No
        # express: it halves the calls in flight.
        self._priority: Final = zenoh.Priority.DATA_HIGH if bulk else zenoh.Priority.INTERACTIVE_HIGH
        self._querier: Final = communicator.session.declare_querier(
            target.prefix + operation.name,
            timeout=timeout,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=self._priority,
        )
        self._get: Final = self._querier.get

    def invoke(self, arguments: tuple[Any, ...], context: Mapping[str, str] | None = None) -> object:
        """Call, wait for the answer, and return what the operation returns."""
        if self._communicator.destroyed:
            raise CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")
        request = self._encode(arguments), self._attachment(context)
        started = time.monotonic()
        servant = self._local.get(self._target)
        if servant is not None:
            return self._invoke_local(servant, request)
        return self._interpret(self._exchange(request), request, started, retry=self._operation.idempotent)

    def begin(
        self, arguments: tuple[Any, ...], future: Future[Any], context: Mapping[str, str] | None = None
    ) -> None:
        """Call, and let the future tell the outcome; does not wait for that."""
        dispatcher = self._communicator.dispatcher
        try:
            request = self._encode(arguments), self._attachment(context)
        except Exception as error:  # noqa: BLE001 - it is told by the future
            fail(future, error)
            return
        # A servant of this process is called by way of the session, too: its timer ends the call in time.
        started = time.monotonic()
        replies: list[zenoh.Reply] = []

        def interpret() -> object:
            reply = replies[0] if replies else None
            return self._interpret(reply, request, started, retry=self._operation.idempotent)

        def ended() -> None:  # on Zenoh's thread; whatever waits for the future runs on ours
            dispatcher.submit(partial(settle, future, interpret))

        def send() -> None:
            try:
                self._get(
                    Callback(replies.append, unbroken(ended), indirect=False),
                    payload=request[0],
                    attachment=request[1],
                )
            except zenoh.ZError as error:
                fail(future, self._closed(error))

        def send_in_time() -> None:
            with dispatcher.blocked():
                if time.monotonic() - started < self._timeout:
                    send()
                else:
                    fail(future, self._unsent(self._timeout))

        if not self._hurried:
            send()
            return
        try:
            self._lane.submit(send_in_time)
        except BusyException as error:
            fail(future, error)

    def _encode(self, arguments: tuple[Any, ...]) -> bytes:
        payload = self._pack(arguments, self.what)
        if len(payload) > self._request_limit:
            raise MarshalException(
                f"{self.what}: a request of {len(payload)} bytes where at most {self._request_limit} are sent"
            )
        return payload

    def _attachment(self, context: Mapping[str, str] | None) -> bytes:
        number = next(self._numbers)
        return encode_call_attachment(self._fingerprint, number, self._client, self._timeout, context)

    def _exchange(self, request: _Request) -> zenoh.Reply | None:
        if self._hurried:
            send = partial(self._get, payload=request[0], attachment=request[1])
            return self._exchange_within(send, self._timeout)
        try:
            handler = self._get(payload=request[0], attachment=request[1])
        except zenoh.ZError as error:
            raise self._closed(error) from error
        return _first(handler)

    def _exchange_again(self, request: _Request, timeout: float) -> zenoh.Reply | None:
        # Not through the querier: what is left of the call's time is shorter than the querier's limit.
        send = partial(
            self._communicator.session.get,
            self._querier.key_expr,
            payload=request[0],
            attachment=request[1],
            timeout=timeout,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=self._priority,
        )
        return self._exchange_within(send, timeout)

    def _exchange_within(
        self, send: Callable[[], zenoh.Handler[zenoh.Reply]], timeout: float
    ) -> zenoh.Reply | None:
        """Send from another thread, so that a link that takes nothing holds nobody up beyond the limit."""
        dispatcher = self._communicator.dispatcher
        sent: Future[zenoh.Handler[zenoh.Reply]] = Future()

        def send_unless_late() -> None:
            with dispatcher.blocked():
                if sent.set_running_or_notify_cancel():
                    settle(sent, send)

        self._lane.submit(send_unless_late)
        try:
            with dispatcher.blocked():
                handler = sent.result(timeout)
        except TimeoutError:
            sent.cancel()
            raise self._unsent(timeout) from None
        except zenoh.ZError as error:
            raise self._closed(error) from error
        return _first(handler)

    def _interpret(
        self, reply: zenoh.Reply | None, request: _Request, started: float, *, retry: bool
    ) -> object:
        if reply is None:
            return self._unanswered(request, started, retry=retry)
        sample = reply.ok
        if sample is not None:
            data = sample.payload
            if len(data) > self._reply_limit:
                raise MarshalException(
                    f"{self.what}: a reply of {len(data)} bytes where at most {self._reply_limit} are taken"
                )
            return self._unpack(read_payload(data, self.what), self.what, self._communicator)
        error = reply.err
        if error is None or str(error.encoding) != ERROR_ENCODING:  # Zenoh's own: its timer ran out
            raise self._unanswered_in_time()
        raise self._error(error.payload)

    def _error(self, payload: bytes | zenoh.ZBytes) -> Exception:
        error = decode_error(payload, self._operation.exceptions, self.what, self._communicator)
        # Not of the call that asks for the difference: who refused it, too, would be asked for ever.
        if isinstance(error, InterfaceMismatchException) and not error.member and self._fingerprint:
            proxy = self._communicator.stringToProxy(str(self._target))
            return with_difference(error, proxy, self._interface)
        return error

    def _unanswered(self, request: _Request, started: float, *, retry: bool) -> object:
        """Find out why a call ended without an answer; an idempotent one is sent once more."""
        presence = self._communicator.presence
        if self._communicator.destroyed:
            raise CommunicatorDestroyedException(
                f"{self.what}: the communicator was destroyed during the call"
            )
        left = self._timeout - (time.monotonic() - started)
        unsent = self._timeout - left >= self._send_limit
        lost_now = presence.wait_for_loss(self._target, started, min(_LOSS_NOTICE, left))
        if retry and lost_now:
            left = self._timeout - (time.monotonic() - started)
            if presence.wait_for_return(self._target, min(_RETRY_WAIT, left)):
                left = self._timeout - (time.monotonic() - started)
                if left > 0:
                    _logger.debug("%s: sent once more after the connection was lost", self.what)
                    return self._interpret(self._exchange_again(request, left), request, started, retry=False)
        if presence.interfaces(self._target):
            if lost_now:
                raise ConnectionLostException(f"{self.what}: the server restarted during the call")
            left = self._timeout - (time.monotonic() - started)
            # The servant's token outlives its link for a while, and may be back with another one.
            if presence.wait_for_link_loss(started, min(_CLOSE_NOTICE, left) if unsent else 0.0):
                raise ConnectionLostException(f"{self.what}: the connection was lost during the call")
            if left <= 0:
                raise self._unanswered_in_time()
            raise BusyException(
                f"{self.what} was not executed: too many calls wait for {self._target}, or access control "
                "denies it"
            )
        raise presence.explain_absence(self._target)

    def _unanswered_in_time(self) -> TimeoutException:
        return TimeoutException(f"{self.what} did not answer within {self._timeout:g} s")

    def _unsent(self, timeout: float) -> TimeoutException:
        return TimeoutException(
            f"{self.what} could not be sent within {timeout:g} s: the link to {self._target} takes nothing"
        )

    def _closed(self, error: zenoh.ZError) -> Exception:
        if self._communicator.destroyed:
            return CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")
        return ConnectionLostException(f"{self.what} could not be sent: {error}")

    def _invoke_local(self, servant: Incoming, request: _Request) -> object:
        ok, answer = servant.call_here(self._operation.name, *request, self._timeout)
        if ok:
            return self._unpack(bytes(answer), self.what, self._communicator)
        raise self._error(answer)


def settle(future: Future[Any], compute: Callable[[], object]) -> None:
    """Give a future the outcome of a function, unless it has one already."""
    try:
        result = compute()
    except BaseException as error:  # noqa: BLE001 - it is told by the future
        fail(future, error)
    else:
        with suppress(InvalidStateError):
            future.set_result(result)


def fail(future: Future[Any], error: BaseException) -> None:
    """Give a future an exception, unless it has an outcome already."""
    with suppress(InvalidStateError):  # the communicator was destroyed in the meantime and said so
        future.set_exception(error)


def _first(handler: zenoh.Handler[zenoh.Reply]) -> zenoh.Reply | None:
    try:
        return handler.recv()
    except zenoh.ZError:  # the channel was closed without an answer
        return None
