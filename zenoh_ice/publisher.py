"""The servant's side of a stream."""

from __future__ import annotations

import itertools
import logging
import math
import threading
from time import monotonic
from typing import Any, Final, Generic, TypeVar

import zenoh
from zenoh.handlers import Callback

from .attachment import encode_sample_attachment
from .exceptions import MarshalException
from .operation import Operation
from .pieces import Pieces
from .shared_memory import SharedMemory
from .stop_signals import unbroken

__all__ = ["Channel", "Publisher"]

V = TypeVar("V")

# s after which who waits for a listener looks anyway: Zenoh does not tell of one that comes right after the
# last one left.
_LOOK_AGAIN: Final = 0.1

_logger = logging.getLogger(__name__)


class Publisher(Generic[V]):
    """Publish the values of a streamed operation to whoever listens.

    It may be used from any thread. Samples are dropped rather than queued when the network is slower than
    the servant: a listener wants the newest.
    """

    def __init__(self, operation: Operation[..., V]) -> None:
        self._operation: Final = operation
        self._numbers = itertools.count(1)
        self._channels: tuple[Channel, ...] = ()
        self._changed = threading.Condition()
        self._changes = 0

    @property
    def listening(self) -> bool:
        """Return whether anybody listens; takes less than a microsecond."""
        return any(channel.listening for channel in self._channels)

    def publish(self, value: V, time: float = math.nan) -> None:
        """Send a value to all listeners; does nothing while there is none.

        `time` is the robot time of the value in s. Raises MarshalException for a value that does not fit the
        operation.
        """
        channels = [channel for channel in self._channels if channel.listening]
        if not channels:
            return
        what = f"sample of {self._operation.name}"
        payload = self._operation.result.gather_result(value, what)
        number = next(self._numbers)
        for channel in channels:
            if len(payload) > channel.size_limit:
                raise MarshalException(
                    f"{what}: {len(payload)} bytes where at most {channel.size_limit} are sent"
                )
            channel.send(payload, number, time)

    def wait_for_listener(self, timeout: float) -> bool:
        """Wait for at most `timeout` s until somebody listens; return whether that is so."""
        deadline = monotonic() + timeout
        while True:
            seen = self._changes
            if self.listening:  # asks Zenoh: not while we hold the lock that its thread takes in `wake`
                return True
            left = deadline - monotonic()
            if left <= 0:
                return False
            with self._changed:
                if self._changes == seen:
                    self._changed.wait(min(left, _LOOK_AGAIN))

    def attach(self, channel: Channel) -> None:
        """Publish on a channel, too."""
        with self._changed:
            self._channels += (channel,)
        self.wake()

    def detach(self, channel: Channel) -> None:
        """Publish on a channel no longer."""
        with self._changed:
            self._channels = tuple(other for other in self._channels if other is not channel)

    def wake(self) -> None:
        """Let those who wait for a listener look again."""
        with self._changed:
            self._changes += 1
            self._changed.notify_all()


class Channel:
    """A publisher's way out under one identity."""

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        publisher: Publisher[Any],
        fingerprint: str,
        size_limit: int,
        *,
        shared_memory: SharedMemory | None = None,
    ) -> None:
        self.size_limit: Final = size_limit
        self._fingerprint: Final = fingerprint
        self._shared_memory: Final = shared_memory or SharedMemory(enabled=False)
        # A publisher that another thread is using cannot be undeclared: "Already borrowed".
        self._lock = threading.Lock()
        self._closed = False
        # Images must not delay states, and neither must delay calls.
        bulk = publisher._operation.result.holds_bytes
        self._publisher: Final = session.declare_publisher(
            key,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_LOW if bulk else zenoh.Priority.DATA,
        )

        def on_change(_: zenoh.MatchingStatus) -> None:  # on Zenoh's receiving thread: it only notifies
            publisher.wake()

        self._listener: Final = self._publisher.declare_matching_listener(
            Callback(unbroken(on_change), indirect=False)
        )

    @property
    def listening(self) -> bool:
        """Return whether anybody listens."""
        with self._lock:
            if self._closed:
                return False
            return self._publisher.matching_status.matching  # type: ignore[attr-defined,no-any-return]

    def send(self, payload: bytes | Pieces, number: int, robot_time: float) -> None:
        """Send a sample."""
        attachment = encode_sample_attachment(self._fingerprint, number, robot_time)
        with self._lock:
            if self._closed:
                return
            try:
                self._publisher.put(self._shared_memory.place(payload), attachment=attachment)
            except zenoh.ZError as error:
                # The session was closed meanwhile: there is nobody left to publish to.
                _logger.debug("sample dropped: %s", error)

    def close(self) -> None:
        """Give the key back."""
        self._listener.undeclare()  # first: it goes with the publisher
        with self._lock:
            self._closed = True
            self._publisher.undeclare()
