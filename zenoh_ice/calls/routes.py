"""The ways of a request to the servant, or to one or all of several that serve one identity."""

from __future__ import annotations

import itertools
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import zenoh

from ..identity import Target
from ..operation import Operation
from .invocation import Replies
from .manner import Manner, Replicas

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["Route", "route_for"]


class Route:
    """Where the requests of an operation go: to the servant, or the nearest of several."""

    def __init__(
        self,
        communicator: Communicator,
        target: Target,
        operation: Operation[..., Any],
        timeout: float,
        priority: zenoh.Priority,
    ) -> None:
        self._communicator: Final = communicator
        self._target: Final = target
        self._name: Final = operation.name
        self._quality: Final[dict[str, Any]] = {
            # One that answers is enough; replies are not compared with one another.
            "consolidation": zenoh.ConsolidationMode.NONE,
            # The reply travels as the request does. Dropping either where the link is busy would lose calls.
            # No express: it halves the calls in flight.
            "congestion_control": zenoh.CongestionControl.BLOCK,
            "priority": priority,
        }
        self._timeout: Final = timeout
        self.send: Final = self._declare()
        """Send `payload` and `attachment`, and return Replies; it may have a `cancellation_token`."""

    def send_within(self, timeout: float, **request: Any) -> Replies:  # noqa: ANN401 - those of `send`
        """Send with another limit, in s."""
        replies: Replies = self._get(self._target.prefix + self._name, timeout=timeout, **request)
        return replies

    def _declare(self) -> Any:  # noqa: ANN401 - a function of Zenoh's
        communicator = self._communicator
        if any(info.replicated for info in communicator.presence.servers(self._target)):
            # A querier that is declared while one of several leaves may never find the others (measured: in
            # one of thirty such moments), and nor does any other of its key until the last of them is gone.
            return partial(self.send_within, self._timeout)
        key = self._target.prefix + self._name
        return communicator.session.declare_querier(key, timeout=self._timeout, **self._quality).get

    def _get(self, key: str, **request: Any) -> Any:  # noqa: ANN401
        return self._communicator.session.get(key, **self._quality, **request)


class _SpreadRoute(Route):
    """To one replica after the other."""

    def _declare(self) -> Any:  # noqa: ANN401
        self._turns = itertools.count()
        # No querier for each: replicas come and go, and queriers would stay.
        return partial(self.send_within, self._timeout)

    def send_within(self, timeout: float, **request: Any) -> Replies:  # noqa: ANN401
        servers = [
            info.server for info in self._communicator.presence.servers(self._target) if info.replicated
        ]
        prefix = self._target.prefix
        if servers:
            prefix += f"~{servers[next(self._turns) % len(servers)]}/"
        replies: Replies = self._get(prefix + self._name, timeout=timeout, **request)
        return replies


class _FirstRoute(Route):
    """To all replicas."""

    def send_within(self, timeout: float, **request: Any) -> Replies:  # noqa: ANN401
        key = self._target.prefix + self._name
        return _FirstGood(self._get(key, target=zenoh.QueryTarget.ALL, timeout=timeout, **request))

    def _declare(self) -> Any:  # noqa: ANN401
        return partial(self.send_within, self._timeout)


class _FirstGood:
    """Of several replies the first that is no error; the first error if all are: Zenoh's own come last."""

    def __init__(self, replies: Replies) -> None:
        self._replies: Final = replies
        self._error: zenoh.Reply | None = None

    def recv(self) -> zenoh.Reply:
        while True:
            try:
                reply = self._replies.recv()
            except zenoh.ZError:
                return self._first_error()
            if reply.ok is not None:
                return reply
            self._error = self._error or reply

    def try_recv(self) -> zenoh.Reply | None:
        while True:
            try:
                reply = self._replies.try_recv()
            except zenoh.ZError:
                return self._first_error()
            if reply is None or reply.ok is not None:
                return reply
            self._error = self._error or reply

    def _first_error(self) -> zenoh.Reply:
        if self._error is None:
            raise zenoh.ZError("no reply")
        return self._error


def route_for(
    communicator: Communicator,
    target: Target,
    operation: Operation[..., Any],
    manner: Manner,
    priority: zenoh.Priority,
) -> Route:
    """Return the way of an operation's requests."""
    kind = Route
    # What is not idempotent must not be executed by several.
    if manner.replicas is Replicas.SPREAD:
        kind = _SpreadRoute
    elif manner.replicas is Replicas.FIRST and operation.idempotent:
        kind = _FirstRoute
    return kind(communicator, target, operation, manner.timeout, priority)
