"""The client's side of calls: one object for each operation of each servant that is called."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Final

import msgspec
import zenoh

from ..exceptions import InterfaceMismatchException, TimeoutException
from ..identity import Target
from ..operation import Interface, Operation
from ..wire.codec import DECODE_ERRORS, misfit
from ..wire.errors import ERROR_ENCODING, decode_error
from ..wire.pieces import Parted
from .invocation import InvocationFuture, Replies, fail, first_reply
from .manner import Manner
from .mismatch import with_difference
from .request import Request, Requests
from .routes import route_for
from .unanswered import UnansweredCall

if TYPE_CHECKING:
    from ..communicator import Communicator
    from ..serving.default_incoming import BoundIncoming
    from ..serving.incoming import Incoming

__all__ = ["OutgoingCall"]

# s for which the one retry of an idempotent call waits for the servant to be back.
_RETRY_WAIT: Final = 0.5

_logger = logging.getLogger(__name__)


class OutgoingCall:
    """Call one operation of one servant, remote or in this process, within one limit of time."""

    def __init__(
        self,
        communicator: Communicator,
        target: Target,
        operation: Operation[..., Any],
        interface: Interface,
        manner: Manner,
    ) -> None:
        requests = Requests(communicator, target, operation, interface, manner.timeout)
        self.what: Final = requests.what
        self._requests: Final = requests
        self._communicator: Final = communicator
        self._target: Final = target
        self._operation: Final = operation
        self._interface: Final = interface
        self._timeout: Final = manner.timeout
        self._hurried: Final = requests.hurried
        self._local: Final = communicator.local_servants
        self._reply: Final = f"reply of {requests.what}"
        self._reply_limit: Final = communicator.size_limit(operation.result)
        self._read: Final = communicator.shared_memory.read
        self._unpack: Final = operation.result.unpack_result
        self._value_of: Final = operation.result.value_of
        self._route: Final = route_for(communicator, target, operation, manner, requests.priority)
        self._send: Final = self._route.send

    @cached_property
    def _decode(self) -> Callable[[bytes], msgspec.Struct]:
        """Returns a result that came; raises DECODE_ERRORS, also when it is made for what cannot come."""
        return self._operation.result.decoder(self._communicator)

    def invoke(self, arguments: tuple[Any, ...], context: Mapping[str, str] | None = None) -> object:
        """Call, wait for the answer, and return what the operation returns."""
        requests = self._requests
        request = requests.make(requests.encode(arguments), context)
        started = time.monotonic()
        servant = self._local.get(self._target)
        if servant is not None:
            return self._invoke_local(servant, request)
        if self._hurried:
            reply = first_reply(
                requests.send_within(
                    self._timeout, partial(self._send, payload=request[0], attachment=request[1])
                )
            )
        else:
            try:
                reply = first_reply(self._send(payload=request[0], attachment=request[1]))
            except zenoh.ZError as error:
                raise requests.closed(error) from error
        return self.interpret(reply, request, started)

    def begin(
        self,
        arguments: tuple[Any, ...],
        future: InvocationFuture[Any],
        context: Mapping[str, str] | None = None,
    ) -> None:
        """Call, and let the future tell the outcome; does not wait for that."""
        # A servant of this process is called by way of the session, too: its timer ends the call in time.
        try:
            requests = self._requests
            request = requests.make(requests.encode(arguments), context)
            exchange = _Exchange(self, request, self._timeout)
            if self._hurried:
                requests.submit(partial(self._begin_in_time, exchange, future))
            else:
                self._begin(exchange, future)
        except Exception as error:  # noqa: BLE001 - it is told by the future
            fail(future, error)

    def interpret(
        self, reply: zenoh.Reply | None, request: Request, started: float, *, again: bool = False
    ) -> object:
        """Return what the operation returns, or raise what it raises; None is the end without a reply.

        `started` is the moment of the monotonic clock when the call began; `again` tells that it was sent
        twice already.
        """
        if reply is None:
            return self._without_answer(request, started, again=again)
        sample = reply.ok
        if sample is not None:
            payload = self._read(sample.payload, self._reply_limit, self._reply)
            if isinstance(payload, Parted):
                return self._unpack(payload, self.what, self._communicator)
            try:
                return self._value_of(self._decode(payload))
            except DECODE_ERRORS as unfit:
                raise misfit(unfit, self.what) from unfit
        error = reply.err
        if error is None or str(error.encoding) != ERROR_ENCODING:  # Zenoh's own: its timer ran out
            raise TimeoutException(f"{self.what} did not answer within {self._timeout:g} s")
        raise self._error(error.payload)

    def _error(self, payload: bytes | zenoh.ZBytes) -> Exception:
        error = decode_error(payload, self._operation.exceptions, self.what, self._communicator)
        # Not of the call that asks for the difference: who refused it, too, would be asked for ever.
        if isinstance(error, InterfaceMismatchException) and not error.member and self._interface.fingerprint:
            proxy = self._communicator.stringToProxy(str(self._target))
            return with_difference(error, proxy, self._interface)
        return error

    def _without_answer(self, request: Request, started: float, *, again: bool) -> object:
        """Raise why there is no answer, or send an idempotent call once more."""
        requests = self._requests
        unanswered = UnansweredCall(
            self._communicator,
            self._target,
            self.what,
            started=started,
            timeout=self._timeout,
            send_limit=requests.send_limit,
        )
        if unanswered.lost and self._operation.idempotent and not again:
            wait = min(_RETRY_WAIT, unanswered.time_left)
            back = self._communicator.presence.wait_for_return(self._target, wait)
            left = unanswered.time_left
            if back and left > 0:
                _logger.debug("%s: sent once more after the connection was lost", self.what)
                # What is left of the call's time is shorter than the route's own limit.
                reply = first_reply(
                    requests.send_within(
                        left,
                        partial(self._route.send_within, left, payload=request[0], attachment=request[1]),
                    )
                )
                return self.interpret(reply, request, started, again=True)
        raise unanswered.reason()

    def _begin(self, exchange: _Exchange, future: InvocationFuture[Any]) -> None:
        if future.given_up:  # before it was sent
            return
        request = exchange.request
        try:
            exchange.replies = self._send(
                payload=request[0], attachment=request[1], cancellation_token=exchange.token
            )
        except zenoh.ZError as error:
            raise self._requests.closed(error) from error
        future.begun(exchange)

    def _begin_in_time(self, exchange: _Exchange, future: InvocationFuture[Any]) -> None:
        try:
            if exchange.longest_wait <= 0:
                raise self._requests.unsent(self._timeout)
            self._begin(exchange, future)
        except Exception as error:  # noqa: BLE001 - it is told by the future
            fail(future, error)

    def _invoke_local(self, servant: Incoming | BoundIncoming, request: Request) -> object:
        ok, answer = servant.call_here(self._operation.name, *request, self._timeout)
        if ok:
            return self._unpack(bytes(answer), self.what, self._communicator)
        raise self._error(bytes(answer))


class _Exchange:
    """A request that was sent, or is about to be, without anybody waiting for it here."""

    __slots__ = ("_call", "_started", "_timeout", "replies", "request", "token")

    replies: Replies

    def __init__(self, call: OutgoingCall, request: Request, timeout: float) -> None:
        self.request: Final = request
        self.token: Final = zenoh.CancellationToken()
        self._call: Final = call
        self._started: Final = time.monotonic()
        self._timeout: Final = timeout

    @property
    def longest_wait(self) -> float:
        return self._started + self._timeout - time.monotonic()

    def interpret(self, reply: zenoh.Reply | None) -> object:
        del self.replies
        return self._call.interpret(reply, self.request, self._started)

    def cancel(self) -> None:
        self.token.cancel()

    def close(self) -> None:
        del self.replies
