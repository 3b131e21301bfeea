"""What stands for Zenoh in a test: servants of this process, called at once and in this thread.

The proxies are those that codegen generated, over this communicator: arguments and results are encoded,
validated and decoded as they would travel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

from zenoh_ice import (
    ConnectionLostException,
    Object,
    ObjectNotExistException,
    ObjectPrx,
    Sample,
    Settings,
)
from zenoh_ice.calls.invocation import InvocationFuture
from zenoh_ice.calls.manner import Manner
from zenoh_ice.identity import Target
from zenoh_ice.network.pulse import Pulse
from zenoh_ice.operation import Interface, Operation
from zenoh_ice.serving.incoming import Incoming
from zenoh_ice.streams.subscription import Delivery
from zenoh_ice.wire.codec import Codec

from .calls import CLIENT, CallLog, InlineCoroutines, InlineDispatcher, InProcessCall
from .clock import TaskClock
from .streams import InProcessChannel, InProcessReader, InProcessSubscription

if TYPE_CHECKING:
    from zenoh_ice import Communicator

__all__ = ["InProcessCommunicator"]

V = TypeVar("V")


class InProcessCommunicator:
    """Serve servants to the proxies of the same process. Stands for `zenoh_ice.Communicator`.

    `on_listening` is called when a stream finds its first listener.
    """

    destroyed: Final = False
    client_id: Final = CLIENT

    def __init__(self, clock: TaskClock) -> None:
        self.settings: Final = Settings(clock="sim")
        self.realm: Final = self.settings.realm
        self.clock: Final = clock
        self.calls: Final = CallLog(clock.now)
        self.dispatcher: Final = InlineDispatcher()
        self.coroutines: Final = InlineCoroutines()
        self.presence: Final = self
        self.pulse: Final = Pulse()  # which does not beat: no call waits
        self.on_listening: Callable[[], None] = _nothing
        self._servants: dict[str, Incoming] = {}
        self._polls: dict[str, dict[str, Callable[[], Any]]] = {}
        self._readers: dict[tuple[str, str], InProcessReader[Any]] = {}
        self._channels: dict[tuple[str, str], InProcessChannel] = {}
        self._away: set[str] = set()

    @property
    def as_communicator(self) -> Communicator:
        """Itself, by the type for which it stands."""
        return cast("Communicator", self)

    # -- for tests -----------------------------------------------------------------------------------------

    def serve(
        self, identity: str, servant: Object, polls: dict[str, Callable[[], Any]] | None = None
    ) -> None:
        """Serve a servant, in place of one that has the identity so far.

        `polls` returns the newest value of streams of which the servant publishes nothing, by operation.
        """
        self._servants[identity] = Incoming(self.as_communicator, Target(self.realm, identity), servant)
        self._polls[identity] = polls or {}
        for (owner, operation), reader in self._readers.items():
            if owner == identity:  # proxies hold it
                reader.poll = self._polls[identity].get(operation)
                channel = self._channels[identity, operation]
                channel.attach_to(servant.ice_publisher(servant.ice_interface.all_operations[operation]))

    def servant(self, identity: str) -> Object | None:
        """Return the servant of an identity, or None."""
        incoming = self._servants.get(identity)
        return incoming.servant if incoming else None

    @contextmanager
    def without(self, identities: list[str]) -> Iterator[None]:
        """Let servants be away, all without names: calls raise ConnectionLostException as over a cut link."""
        before, self._away = self._away, self._away | set(identities or self._servants)
        try:
            yield
        finally:
            self._away = before

    # -- for proxies ---------------------------------------------------------------------------------------

    def stringToProxy(self, text: str) -> ObjectPrx:
        """Return the proxy of an identity."""
        identity, _, realm = text.partition("@")
        return ObjectPrx(self.as_communicator, Target(realm or self.realm, identity), self.settings.timeout)

    def identities(self, realm: str | None = None) -> list[str]:  # noqa: ARG002
        """Return the identities that are served, sorted."""
        return sorted(self._servants.keys() - self._away)

    def find(
        self,
        target: Target,
        type_id: str | None,  # noqa: ARG002
        timeout: float,  # noqa: ARG002
        *,
        since: float | None = None,  # noqa: ARG002
    ) -> dict[str, str]:
        """Return the fingerprints of a servant's interfaces by type id; raises ObjectNotExistException."""
        return self._servant(target).fingerprints

    def knows(self, target: Target) -> bool:
        """Return whether a servant is there."""
        return target.identity in self._servants

    def searches(self, target: Target, limit: float) -> bool:  # noqa: ARG002
        """Return whether calls of a servant wait for it to be found: none does."""
        return False

    def search(self, target: Target, limit: float, find_and_call: Callable[[], object]) -> None:  # noqa: ARG002
        """Find a servant and call it, at once."""
        find_and_call()

    def is_lost(self, target: Target) -> bool:
        """Return whether a servant was there and is away."""
        return target.identity in self._away

    def outgoing_call(
        self, target: Target, operation: Operation[..., Any], interface: Interface, manner: Manner
    ) -> InProcessCall:
        """Return what calls an operation of a servant: of the one that is served when it is called.

        A oneway call is executed at once, too.
        """
        return InProcessCall(self, lambda: self._servant(target), operation, interface, manner.timeout)

    def stream_reader(self, target: Target, operation: Operation[..., V]) -> InProcessReader[V]:
        """Return the reader of a stream; proxies share it."""
        key = (target.identity, operation.name)
        if key not in self._readers:
            servant = self._servant(target).servant
            poll = self._polls[target.identity].get(operation.name)
            reader: InProcessReader[V] = InProcessReader(
                ".".join(key), operation, self.clock, self._wake, poll
            )
            self._channels[key] = InProcessChannel(reader)
            self._channels[key].attach_to(servant.ice_publisher(operation))
            self._readers[key] = reader
        return self._readers[key]

    def new_subscription(
        self,
        reader: InProcessReader[V],
        callback: Callable[[Sample[V]], Any],
        delivery: Delivery,  # noqa: ARG002 - in virtual time every sample is delivered at once
    ) -> InProcessSubscription[V]:
        """Return a callback on a stream."""
        return InProcessSubscription(reader, callback)

    def new_future(self, *, at_once: bool) -> InvocationFuture[Any]:  # noqa: ARG002
        """Return a future."""
        return InvocationFuture()

    def size_limit(self, codec: Codec[Any]) -> int:
        """Return how many bytes a payload may have."""
        settings = self.settings
        return settings.max_bulk_size if codec.holds_bytes else settings.max_message_size

    def check_timeout(self, seconds: float) -> float:
        """Return a limit for calls."""
        return seconds

    def _wake(self) -> None:
        self.on_listening()

    def _servant(self, target: Target) -> Incoming:
        servant = self._servants.get(target.identity)
        if servant is None:
            served = ", ".join(sorted(self._servants)) or "none: give robot= or stub()"
            raise ObjectNotExistException(f"there is no servant {target.identity}; there are {served}")
        if target.identity in self._away:
            raise ConnectionLostException(f"{target.identity} is away: the test says so")
        return servant


def _nothing() -> None:
    """Do nothing."""
