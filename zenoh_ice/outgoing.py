"""The client's side of calls: one object for each operation of each servant that is called."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import zenoh

from .exceptions import (
    BusyException,
    ConnectionLostException,
    InterfaceMismatchException,
    MarshalException,
    SystemException,
    TimeoutException,
)
from .identity import Target
from .invocation import InvocationFuture, fail, first_reply
from .manner import Manner
from .mismatch import with_difference
from .operation import Interface, Operation
from .request import Request, Requests
from .routes import Replies, route_for
from .unanswered import Unanswered
from .wire_errors import ERROR_ENCODING, decode_error

if TYPE_CHECKING:
    from .communicator import Communicator
    from .incoming import Incoming

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
        self._reply_limit: Final = communicator.size_limit(operation.result)
        self._unpack: Final = operation.result.unpack_result
        self._unanswered: Final = Unanswered(communicator, target, requests)
        self._route: Final = route_for(
            communicator, target, operation, manner.replicas, manner.timeout, requests.priority
        )
        self._send: Final = self._route.send

    def invoke(self, arguments: tuple[Any, ...], context: Mapping[str, str] | None = None) -> object:
        """Call, wait for the answer, and return what the operation returns."""
        request = self._requests.make(arguments, context)
        started = time.monotonic()
        servant = self._local.get(self._target)
        if servant is not None:
            return self._invoke_local(servant, request)
        if self._hurried:
            replies = self._send_within(self._timeout, partial(self._send, **request._asdict()))
        else:
            try:
                replies = self._send(payload=request.payload, attachment=request.attachment)
            except zenoh.ZError as error:
                raise self._requests.closed(error) from error
        return self.interpret(first_reply(replies), request, started)

    def begin(
        self,
        arguments: tuple[Any, ...],
        future: InvocationFuture[Any],
        context: Mapping[str, str] | None = None,
    ) -> None:
        """Call, and let the future tell the outcome; does not wait for that."""
        # A servant of this process is called by way of the session, too: its timer ends the call in time.
        try:
            exchange = _Exchange(self, self._requests.make(arguments, context), self._timeout)
            if self._hurried:
                self._requests.submit(partial(self._begin_in_time, exchange, future))
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
            data = sample.payload
            if len(data) > self._reply_limit:
                raise MarshalException(
                    f"{self.what}: a reply of {len(data)} bytes where at most {self._reply_limit} are taken"
                )
            return self._unpack(data.to_bytes(), self.what, self._communicator)
        error = reply.err
        if error is None or str(error.encoding) != ERROR_ENCODING:  # Zenoh's own: its timer ran out
            raise self._unanswered.in_time()
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
        lost, reason = self._unanswered.explain(started)
        if not lost or again or not self._operation.idempotent:
            raise reason
        presence = self._communicator.presence
        left = self._timeout - (time.monotonic() - started)
        if not presence.wait_for_return(self._target, min(_RETRY_WAIT, left)):
            raise self._unanswered.absence()
        left = self._timeout - (time.monotonic() - started)
        if left <= 0:
            raise reason
        _logger.debug("%s: sent once more after the connection was lost", self.what)
        # What is left of the call's time is shorter than the route's own limit.
        replies = self._send_within(left, partial(self._route.send_within, left, **request._asdict()))
        return self.interpret(first_reply(replies), request, started, again=True)
