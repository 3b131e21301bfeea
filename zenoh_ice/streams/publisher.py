"""The servant's side of a stream."""

from __future__ import annotations

import itertools
import logging
import math
import re
import secrets
import threading
import time as wall
from collections import deque
from time import monotonic
from typing import TYPE_CHECKING, Any, Final, Generic, NamedTuple, TypeVar

import zenoh
from zenoh.handlers import Callback

from ..exceptions import ConfigurationException, MarshalException
from ..operation import Operation
from ..stop_signals import unbroken
from ..wire.attachment import encode_sample_attachment
from ..wire.errors import ERROR_ENCODING, encode_error
from ..wire.pieces import Pieces
from ..wire.text import printable
from .stream_source import MOST_HISTORY

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["Channel", "Kept", "Publisher"]

V = TypeVar("V")

# s after which who waits for a listener looks anyway: Zenoh does not tell of one that comes right after the
# last one left.
_LOOK_AGAIN: Final = 0.1

_COUNT: Final = re.compile("[0-9]{1,4}")

_logger = logging.getLogger(__name__)


class Kept(NamedTuple):
    """A sample of the past, encoded."""

    payload: bytes | Pieces
    number: int
    robot_time: float
    wall_time: float


class Publisher(Generic[V]):
    """Publish the values of a streamed operation to whoever listens.

    It may be used from any thread. Samples are dropped rather than queued when the network is slower than
    the servant: a listener wants the newest.
    """

    def __init__(self, operation: Operation[..., V]) -> None:
        self.operation: Final = operation
        self.stream: Final = secrets.token_hex(8)
        """Tells the numbers of its samples from those before a restart."""
        self._numbers = itertools.count(1)
        # Whoever hears of a sample at once, in a test without a network, may publish in turn.
        self._turn = threading.RLock()
        self._kept: deque[Kept] = deque(maxlen=0)
        self._channels: tuple[Channel, ...] = ()
        self._changed = threading.Condition()
        self._changes = 0

    @property
    def listening(self) -> bool:
        """Return whether anybody listens; takes less than a microsecond."""
        return any(channel.listening for channel in self._channels)

    def keep(self, count: int) -> None:
        """Keep the last `count` samples for those who subscribe with a history; 0, as at first, keeps none.

        From now on values are encoded and kept while nobody listens, too. Raises ConfigurationException for
        more than 1000.
        """
        if not 0 <= count <= MOST_HISTORY:
            raise ConfigurationException(f"a publisher keeps from 0 to {MOST_HISTORY} samples, not {count!r}")
        with self._changed:
            self._kept = deque(self._kept, maxlen=count)

    def kept(self, count: int) -> list[Kept]:
        """Return the last `count` samples that are kept, the oldest first."""
        with self._changed:
            kept = list(self._kept)
        return kept[-count:] if count > 0 else []

    def publish(self, value: V, time: float = math.nan) -> None:
        """Send a value to all listeners; does nothing while there is none, unless samples are kept.

        `time` is the robot time of the value in s. Raises MarshalException for a value that does not fit the
        operation.
        """
        channels = [channel for channel in self._channels if channel.listening]
        if not channels and not self._kept.maxlen:
            return
        what = f"sample of {self.operation.name}"
        payload = self.operation.result.gather_result(value, what)
        for channel in channels:
            if len(payload) > channel.size_limit:
                raise MarshalException(
                    f"{what}: {len(payload)} bytes where at most {channel.size_limit} are sent"
                )
        with self._turn:  # they travel in the order of their numbers
            number = next(self._numbers)
            if self._kept.maxlen:
                with self._changed:
                    self._kept.append(Kept(payload, number, time, wall.time()))
            for channel in channels:
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
        self, communicator: Communicator, key: str, publisher: Publisher[Any], fingerprint: str
    ) -> None:
        result = publisher.operation.result
        self.size_limit: Final = communicator.size_limit(result)
        self._what: Final = key
        self._fingerprint: Final = fingerprint
        self._ring: Final = communicator.shared_memory.ring()
        self._neighbors: Final = communicator.neighbors
        self._kept: Final = publisher.kept
        self._stream: Final = publisher.stream
        # A publisher that another thread is using cannot be undeclared: "Already borrowed".
        self._lock = threading.Lock()
        self._closed = False
        # Images must not delay states, and neither must delay calls.
        bulk = result.holds_bytes
        if bulk:
            self._neighbors.watch()
        self._publisher: Final = communicator.session.declare_publisher(
            key,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_LOW if bulk else zenoh.Priority.DATA,
            # One by one: of images that travel together all but the last would come for nothing.
            express=bulk,
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
        attachment = encode_sample_attachment(self._fingerprint, number, robot_time, self._stream)
        with self._lock:
            if self._closed:
                return
            try:
                self._publisher.put(self._placed(payload), attachment=attachment)
            except zenoh.ZError as error:
                # The session was closed meanwhile: there is nobody left to publish to.
                _logger.debug("sample dropped: %s", error)

    def answer(self, query: zenoh.Query, count: str) -> None:
        """Answer a query for the last samples, with as many replies as were asked for and are kept."""
        try:
            with query:
                if not _COUNT.fullmatch(count):
                    error = MarshalException(f"{self._what}: a history of {printable(count)} samples")
                    query.reply_err(encode_error(error), encoding=ERROR_ENCODING)
                    return
                for kept in self._kept(int(count)):
                    about = encode_sample_attachment(
                        self._fingerprint, kept.number, kept.robot_time, self._stream, kept.wall_time
                    )
                    query.reply(query.key_expr, bytes(kept.payload), attachment=about)
        except zenoh.ZError as error:  # the session was closed meanwhile
            _logger.debug("history of %s dropped: %s", self._what, error)

    def close(self) -> None:
        """Give the key back."""
        self._listener.undeclare()  # first: it goes with the publisher
        with self._lock:
            self._closed = True
            self._publisher.undeclare()
            self._ring.close()

    def _placed(self, payload: bytes | Pieces) -> bytes:
        """Return a payload as it is best sent: what is large in it in shared memory, if all can read that."""
        if isinstance(payload, Pieces) and self._neighbors.are_all():
            reference = self._ring.place(payload)
            if reference is not None:
                return reference
        return bytes(payload)
