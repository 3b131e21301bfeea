"""Calls without an answer: sent at once, or when their batch is flushed."""

from __future__ import annotations

import itertools
import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import zenoh

from ..exceptions import SystemException, TwowayOnlyException
from ..identity import Target
from ..object import ICE_PING
from ..operation import OBJECT_TYPE_ID, Interface, Operation
from .invocation import InvocationFuture, settle
from .manner import Manner, Replicas
from .request import Requests

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["BatchedCall", "OnewayBatch", "OnewayCall"]

# A batch that grows beyond this is flushed by itself, as in Ice.
_MOST_BATCHED: Final = 1024
_LARGEST_BATCH: Final = 1 << 20  # bytes

_logger = logging.getLogger(__name__)


class _SentCall(ABC):
    """A call without an answer: its outcome is known when it was sent, or taken into a batch."""

    @abstractmethod
    def invoke(self, arguments: tuple[Any, ...], context: Mapping[str, str] | None = None) -> None:
        """Call; raises what says that the call cannot arrive."""

    def begin(
        self,
        arguments: tuple[Any, ...],
        future: InvocationFuture[Any],
        context: Mapping[str, str] | None = None,
    ) -> None:
        """Call; the future tells whether that was possible."""
        settle(future, partial(self.invoke, arguments, context))


class OnewayCall(_SentCall):
    """Call one operation of one servant without waiting for more than that the call was sent."""

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
        if not operation.oneway:
            raise TwowayOnlyException(
                f"{self.what} returns something or declares exceptions, which a oneway call would never hear "
                "of: call it by a twoway proxy"
            )
        self.encode: Final = requests.encode
        self._requests: Final = requests
        self._communicator: Final = communicator
        self._target: Final = target
        self._name: Final = operation.name
        self._spread: Final = manner.replicas is Replicas.SPREAD
        self._is_ping: Final = operation is ICE_PING
        self._turns: Final = itertools.count()
        self._known: Mapping[str, str] | None = None
        self._keys: list[str] = []

    def invoke(self, arguments: tuple[Any, ...], context: Mapping[str, str] | None = None) -> None:
        """Send a call; raises what says that it cannot arrive."""
        self.send(self.encode(arguments), context)

    def send(self, payload: bytes, context: Mapping[str, str] | None) -> None:
        """Send a call whose arguments are encoded; raises as `invoke` does."""
        requests = self._requests
        key = self._key()
        if self._is_ping:  # a servant hears of it only if somebody waits for the answer
            return
        payload, attachment = requests.make(payload, context)
        put = partial(
            self._communicator.session.put,
            key,
            payload,
            attachment=attachment,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=requests.priority,
        )
        if requests.hurried:
            requests.submit(partial(self._send_later, put))
            return
        try:
            put()
        except zenoh.ZError as error:
            raise requests.closed(error) from error

    def _key(self) -> str:
        """Return where to send the next call; raises SystemException when nobody is there."""
        communicator, target = self._communicator, self._target
        communicator.check()
        known = communicator.presence.reachable(target)
        if not known:
            if target not in communicator.local_servants:
                raise communicator.presence.explain_absence(target)
            return target.prefix + self._name
        if known is not self._known:  # it is replaced whenever somebody comes or goes
            if communicator.presence.serving(target) != target and known.keys() == {OBJECT_TYPE_ID}:
                raise TwowayOnlyException(
                    f"{self.what}: a servant locator finds the servant, which takes twoway calls alone"
                )
            self._keys = self._addresses()
            self._known = known
        keys = self._keys  # which another thread may replace by fewer
        return keys[next(self._turns) % len(keys)]

    def _addresses(self) -> list[str]:
        """Return the keys of those of whom each call is for one."""
        servers = [
            info.server for info in self._communicator.presence.servers(self._target) if info.replicated
        ]
        own = self._communicator.client_id
        if servers and not self._spread:
            servers = [own] if own in servers else servers[:1]
        return [f"{self._target.prefix}~{server}/{self._name}" for server in servers] or [
            self._target.prefix + self._name
        ]

    def _send_later(self, put: Callable[[], None]) -> None:
        try:
            put()
        except zenoh.ZError as error:
            _logger.warning("%s", self._requests.closed(error))


class OnewayBatch:
    """Calls that are sent together, in the order in which they were made."""

    def __init__(self) -> None:
        self._lock: Final = threading.Lock()
        self._sending: Final = threading.Lock()
        self._calls: list[tuple[OnewayCall, bytes, Mapping[str, str] | None]] = []
        self._size = 0

    def add(self, call: OnewayCall, payload: bytes, context: Mapping[str, str] | None) -> None:
        """Add a call; a batch of 1024 calls or 1 MiB is flushed."""
        with self._lock:
            self._calls.append((call, payload, context))
            self._size += len(payload)
            full = len(self._calls) >= _MOST_BATCHED or self._size >= _LARGEST_BATCH
        if full:
            self.flush()

    def flush(self) -> None:
        """Send what was added; raises what says that a call cannot arrive, after the others were sent."""
        with self._sending:
            with self._lock:
                calls, self._calls, self._size = self._calls, [], 0
            errors: list[SystemException] = []
            for call, payload, context in calls:
                try:
                    call.send(payload, context)
                except SystemException as error:
                    errors.append(error)
        if errors:
            _logger.warning("%d of a batch of %d calls could not be sent", len(errors), len(calls))
            raise errors[0]


class BatchedCall(_SentCall):
    """Add the calls of one operation of one servant to a batch."""

    def __init__(self, call: OnewayCall, batch: OnewayBatch) -> None:
        self._call: Final = call
        self._batch: Final = batch

    def invoke(self, arguments: tuple[Any, ...], context: Mapping[str, str] | None = None) -> None:
        """Add a call."""
        self._batch.add(self._call, self._call.encode(arguments), context)
