"""What travels to a servant, and how it is sent within the limit of a call."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, Final, TypeVar

import zenoh

from ..exceptions import (
    CommunicatorDestroyedException,
    ConnectionLostException,
    MarshalException,
    SystemException,
    TimeoutException,
)
from ..identity import Target
from ..network.session import send_limit
from ..operation import Interface, Operation
from ..wire.attachment import encode_call_attachment
from .invocation import settle

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["Request", "Requests"]

T = TypeVar("T")


Request = tuple[bytes, bytes]
"""The arguments of a call as they travel, and what travels beside them."""


class Requests:
    """Make and send the requests of one operation of one servant."""

    def __init__(
        self,
        communicator: Communicator,
        target: Target,
        operation: Operation[..., Any],
        interface: Interface,
        timeout: float,
    ) -> None:
        self.what: Final = f"{target.object}.{operation.name}"
        bulk = operation.result.holds_bytes or operation.arguments.holds_bytes
        self.priority: Final = zenoh.Priority.DATA_HIGH if bulk else zenoh.Priority.INTERACTIVE_HIGH
        self.send_limit: Final = send_limit(communicator.settings)
        """Seconds for which sending may wait for the other side, before the link is closed."""
        self.hurried: Final = timeout < self.send_limit
        """Whether that is longer than a call may take: then it is sent from another thread than the caller's.

        The caller's own is fastest, and Zenoh takes no limit for one message.
        """
        self._communicator: Final = communicator
        self._target: Final = target
        self._timeout: Final = timeout
        self._fingerprint: Final = interface.fingerprint
        self._client: Final = communicator.client_id
        self._numbers: Final = communicator.call_numbers
        self._implicit: Final = communicator.getImplicitContext()
        self._pack: Final = operation.arguments.pack
        self._limit: Final = communicator.size_limit(operation.arguments)
        self._lane: Final = communicator.sending_lane(target) if self.hurried else None

    def encode(self, arguments: tuple[Any, ...]) -> bytes:
        """Return arguments as they travel; raises MarshalException."""
        payload = self._pack(arguments, self.what)
        if len(payload) > self._limit:
            raise MarshalException(
                f"{self.what}: a request of {len(payload)} bytes where at most {self._limit} are sent"
            )
        return payload

    def make(self, payload: bytes, context: Mapping[str, str] | None) -> Request:
        """Return the request of a new call, whose arguments are encoded."""
        if self._communicator.destroyed:
            raise CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")
        if self._implicit.context:
            context = self._implicit.merged(context)
        return payload, encode_call_attachment(
            self._fingerprint, next(self._numbers), self._client, self._timeout, context
        )

    def submit(self, send: Callable[[], object]) -> None:
        """Send from another thread, after what this target was sent before; raises BusyException."""
        assert self._lane is not None
        dispatcher = self._communicator.dispatcher

        def send_it() -> None:
            with dispatcher.blocked():
                send()

        self._lane.submit(send_it)

    def send_within(self, timeout: float, send: Callable[[], T]) -> T:
        """Send from another thread, so that a link that takes nothing holds nobody up beyond the limit.

        Raises TimeoutException, BusyException, ConnectionLostException.
        """
        sent: Future[T] = Future()

        def send_unless_late() -> None:
            if sent.set_running_or_notify_cancel():
                settle(sent, send)

        self._communicator.sending_lane(self._target).submit(send_unless_late)
        try:
            with self._communicator.dispatcher.blocked():
                return sent.result(timeout)
        except TimeoutError:
            sent.cancel()
            raise self.unsent(timeout) from None
        except zenoh.ZError as error:
            raise self.closed(error) from error

    def unsent(self, timeout: float) -> SystemException:
        """Return the exception of a request that could not be sent in time."""
        return TimeoutException(
            f"{self.what} could not be sent within {timeout:g} s: the link to {self._target} takes nothing"
        )

    def closed(self, error: zenoh.ZError) -> SystemException:
        """Return the exception of a request that Zenoh refused to send."""
        if self._communicator.destroyed:
            return CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")
        return ConnectionLostException(f"{self.what} could not be sent: {error}")
