"""What a communicator does for the other modules of the package."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, TypeVar

from .calls.invocation import InvocationFuture
from .calls.manner import Manner
from .calls.oneway import OnewayBatch
from .calls.outgoing_calls import AnyCall, OutgoingCalls
from .dispatch import Lane
from .exceptions import CommunicatorDestroyedException, ConfigurationException
from .identity import Target
from .network.presence import Presence
from .operation import Interface, Operation
from .serving.local_servants import LocalServants
from .settings import LONGEST_TIMEOUT, Settings
from .streams.sample import Sample
from .streams.stream_reader import StreamReader
from .streams.stream_readers import StreamReaders
from .streams.subscription import Delivery, Subscription
from .wire.codec import Codec

__all__ = ["CommunicatorServices"]

V = TypeVar("V")


class CommunicatorServices:
    """The part of a communicator that users do not see."""

    settings: Settings
    destroyed: bool
    local_servants: LocalServants
    presence: Presence
    _lock: threading.RLock
    _calls: OutgoingCalls
    _readers: StreamReaders
    _subscriptions: set[Subscription[Any]]

    def find(
        self, target: Target, type_id: str | None, timeout: float, *, since: float | None = None
    ) -> dict[str, str]:
        """Wait until a servant is there; return the fingerprints of its interfaces by type id.

        The interface asked for is missing from them if the servant does not have it. `since` is the moment of
        the monotonic clock when it was asked for, now by default.
        """
        self.check()
        local = self.local_servants.get(target)
        if local is not None:
            return local.fingerprints
        self.presence.wait_for(target, type_id, timeout, since=since)
        found = self.presence.reachable(target)
        if not found:
            raise self.presence.explain_absence(target)
        return found

    def knows(self, target: Target) -> bool:
        """Return whether `find` would return at once."""
        return self.local_servants.get(target) is not None or bool(self.presence.reachable(target))

    def searches(self, target: Target, limit: float) -> bool:
        """Return whether calls with a limit, in s, wait for a servant to be found."""
        return self._calls.searches.under_way(target, limit)

    def search(self, target: Target, limit: float, find_and_call: Callable[[], object]) -> None:
        """Run what finds a servant and calls it, after what was asked for before; raises BusyException."""
        self._calls.searches.submit(target, limit, find_and_call)

    def outgoing_call(
        self, target: Target, operation: Operation[..., Any], interface: Interface, manner: Manner
    ) -> AnyCall:
        """Return what calls an operation of a servant; proxies share it."""
        self.check()
        return self._calls.get(target, operation, interface, manner)

    def sending_lane(self, target: Target) -> Lane:
        """Return the lane in which calls of a servant are sent that must not be sent by their callers."""
        return self._calls.sending_lane(target)

    def stream_reader(self, target: Target, operation: Operation[..., V]) -> StreamReader[V]:
        """Return the reader of a stream; proxies share it."""
        self.check()
        return self._readers.get(target, operation)

    def new_subscription(
        self, reader: StreamReader[V], callback: Callable[[Sample[V]], Any], delivery: Delivery
    ) -> Subscription[V]:
        """Return a subscription that ends with the communicator."""
        with self._lock:
            self.check()
            subscription = Subscription(reader.source, callback, delivery, self._subscriptions.discard)
            self._subscriptions.add(subscription)
            return subscription

    def new_future(self, *, at_once: bool) -> InvocationFuture[Any]:
        """Return the future of a call that is sent at once, or as soon as its servant was found."""
        self.check()
        return InvocationFuture(self._calls.receiver) if at_once else self._calls.new_future()

    def new_batch(self) -> OnewayBatch:
        """Return a batch that `flushBatchRequests` flushes."""
        return self._calls.new_batch()

    def size_limit(self, codec: Codec[Any]) -> int:
        """Return how many bytes a payload may have: more where its type holds byte sequences."""
        settings = self.settings
        return settings.max_bulk_size if codec.holds_bytes else settings.max_message_size

    def check_timeout(self, seconds: float) -> float:
        """Return a limit for calls; raises ConfigurationException for one that is none."""
        if not 0 < seconds <= LONGEST_TIMEOUT:
            raise ConfigurationException(
                f"a call's limit is above 0 and at most {LONGEST_TIMEOUT:g} s, not {seconds:g} s"
            )
        return seconds

    def check(self) -> None:
        """Raise CommunicatorDestroyedException after the end."""
        if self.destroyed:
            raise CommunicatorDestroyedException("the communicator was destroyed, or inherited by a fork")
