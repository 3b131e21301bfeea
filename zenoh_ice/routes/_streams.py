"""The ends of streams: over Zenoh, and those of large values also through channels on one machine."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import zenoh
from zenoh.handlers import Callback, RingChannel

from zenoh_ice.carriers._local.channels import LentSample, NotSent, SampleChannel
from zenoh_ice.carriers._local.listeners import most_unread
from zenoh_ice.carriers._local.server import LocalServer
from zenoh_ice.carriers.zenoh.session import undeclare
from zenoh_ice.data.codec import Pieces, too_large
from zenoh_ice.data.exceptions import ConnectionLostException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.threads._starting import UserCodeThread, start
from zenoh_ice.transport import Arrived, Pacer

if TYPE_CHECKING:
    from zenoh_ice.routes._transport import ZenohTransport

_logger = logging.getLogger(__name__)


class Outlet:
    """The publishing end of a stream."""

    def __init__(self, session: zenoh.Session, key: str, server: LocalServer | None, *, bulk: bool) -> None:
        self._key: Final = key
        self._server: Final = server
        self._listeners: Final = None if server is None else server.publish(key)
        # A publisher that another thread is using cannot be undeclared: "Already borrowed".
        self._lock: Final = threading.Lock()
        self._closed = False
        self._publisher: Final = session.declare_publisher(
            key,
            congestion_control=zenoh.CongestionControl.DROP,
            # Images must not delay states, and neither must delay calls.
            priority=zenoh.Priority.DATA_LOW if bulk else zenoh.Priority.DATA,
            # Not batched: if images were sent together, all but the last would be useless.
            express=bulk,
        )

    @property
    def listening(self) -> bool:
        if self._listeners:
            return True
        with self._lock:
            return not self._closed and self._is_matched

    def put(self, payload: bytes | Pieces, attachment: bytes) -> None:
        if self._listeners:
            self._listeners.put(payload, attachment)
        with self._lock:
            if self._closed or (self._listeners is not None and not self._is_matched):
                return
            try:
                self._publisher.put(bytes(payload), attachment=attachment)
            except zenoh.ZError as error:  # the session was closed meanwhile
                _logger.debug("sample dropped: %s", error)

    def close(self) -> None:
        with self._lock:
            self._closed = True
            self._publisher.undeclare()
        if self._server is not None:
            self._server.unpublish(self._key)

    @property
    def _is_matched(self) -> bool:
        return bool(self._publisher.matching_status.matching)  # type: ignore[attr-defined]


class _Inlet(ABC):
    """A listening end, which a separate thread empties where somebody is to be called."""

    poll: Callable[[], Any]

    def __init__(self, what: str, limit: int) -> None:
        self._what: Final = what
        self._limit: Final = limit
        self._closed: Final = threading.Event()
        self._thread: threading.Thread | None = None

    @abstractmethod
    def _receive(self) -> Any:  # noqa: ANN401
        """Wait for the next sample; return None at the end."""

    @abstractmethod
    def _stop(self) -> None:
        """Receive no more; `_receive` ends."""

    def _discard(self, sample: Any) -> None:  # noqa: ANN401, B027 - most cost nothing
        """Drop a sample that nobody reads."""

    def wait(self, changed: threading.Condition, holds: Callable[[], bool], timeout: float) -> bool:
        if self._thread is None:  # until then, samples that arrive cost this process nothing
            newest: deque[Any] = deque()

            def keep(sample: Any) -> None:  # noqa: ANN401
                with changed:
                    while newest:
                        self._discard(newest.pop())
                    newest.append(sample)
                    changed.notify_all()

            self.deliver(keep)
            self.poll = lambda: newest.pop() if newest else None
        return changed.wait_for(holds, timeout)

    def deliver(self, callback: Callable[[Any], object], rate: float | None = None) -> None:
        thread = UserCodeThread(
            target=self._run, args=(callback, Pacer(rate)), name=f"stream {self._what}", daemon=True
        )
        start(thread)
        self._thread = thread  # not earlier: a thread that Ctrl-C kept from starting cannot be joined

    def close(self, timeout: float = 0.0) -> bool:
        self._closed.set()
        self._stop()
        if (thread := self._thread) is None or thread is threading.current_thread():
            return True
        thread.join(timeout)
        return not thread.is_alive()

    def _run(self, callback: Callable[[Any], object], pacer: Pacer) -> None:
        while not (self._closed.wait(delay) if (delay := pacer.delay()) else self._closed.is_set()):
            sample = self._receive()
            if sample is None:
                return
            pacer.count()
            callback(sample)
            del sample  # it may be large, and the next one may be a long time coming


class SmallInlet(_Inlet):
    """The listening end of a stream of small values: a ring that Zenoh fills without Python."""

    def __init__(self, session: zenoh.Session, key: str, limit: int, queue: int) -> None:
        super().__init__(key, limit)
        # A ring: a full queue that keeps its contents would block the whole session.
        ring: RingChannel[zenoh.Sample] = RingChannel(queue)
        self._subscriber: Final = session.declare_subscriber(key, ring)
        # Kept apart: the subscriber can be undeclared while a thread waits in the handler.
        self._handler: Final = self._subscriber.handler
        self.poll = self._handler.try_recv

    def open(self, sample: zenoh.Sample) -> Arrived:
        return _opened(sample, self._limit, self._what)

    def _receive(self) -> zenoh.Sample | None:
        try:
            return self._handler.recv()
        except zenoh.ZError:  # undeclared
            return None

    def _stop(self) -> None:
        undeclare(self._subscriber)  # its channel is closed


class BulkInlet(_Inlet):
    """The listening end of a stream of large values.

    It listens through a channel to the servant's only server if that is near and publishes the stream there,
    and otherwise over Zenoh. While it changes from one to the other it listens on both, and the reader
    of the samples drops the second of two.
    """

    def __init__(
        self, transport: ZenohTransport, target: Target, operation: Operation[..., Any], queue: int
    ) -> None:
        super().__init__(target.key(operation.name), operation.result.size_limit)
        self.poll = self._poll
        self._transport: Final = transport
        self._target: Final = target.prefix
        self._operation: Final = operation.name
        self._route: Final = transport.route(target)
        self._queue: Final = queue
        self._samples: Final[deque[zenoh.Sample | LentSample]] = deque()
        self._arrived: Final = threading.Condition(threading.Lock())
        self._choosing: Final = threading.Lock()
        self._subscriber: zenoh.Subscriber[Any] | None = None
        self._channel: SampleChannel | None = None
        self._confirmed = False  # whether samples come through the channel
        self._route.changed.add(self._choose_later)
        try:
            self._choose()
        except BaseException:
            self.close()
            raise

    def confirm(self, channel: SampleChannel) -> None:
        self._transport.pool.submit(lambda: self._settle(channel))

    def open(self, sample: zenoh.Sample | LentSample) -> Arrived:
        if isinstance(sample, LentSample):
            return sample.read(self._limit, self._what)
        return _opened(sample, self._limit, self._what)

    def keep(self, sample: zenoh.Sample | LentSample) -> None:
        dropped = None
        if isinstance(sample, LentSample) and self._queue > most_unread(sample.size):
            try:  # its memory is not for so many
                sample.read(self._limit, self._what)
            except ConnectionLostException:
                return
        with self._arrived:
            if self._closed.is_set():
                dropped = sample
            else:
                if len(self._samples) >= self._queue:
                    dropped = self._samples.popleft()
                self._samples.append(sample)
                self._arrived.notify()
        if dropped is not None:
            self._discard(dropped)

    def _poll(self) -> zenoh.Sample | LentSample | None:
        with self._arrived:
            return self._samples.popleft() if self._samples else None

    def _receive(self) -> zenoh.Sample | LentSample | None:
        with self._arrived:
            self._arrived.wait_for(lambda: self._samples or self._closed.is_set())
            return self._samples.popleft() if self._samples else None

    def _discard(self, sample: zenoh.Sample | LentSample) -> None:
        if isinstance(sample, LentSample):
            sample.give_back()

    def _stop(self) -> None:
        self._route.changed.discard(self._choose_later)
        with self._choosing:
            if self._channel is not None:
                self._leave(self._channel)
                self._channel = None
            self._leave_network()
        with self._arrived:
            self._samples.clear()
            self._arrived.notify_all()

    def _choose_later(self) -> None:
        self._transport.pool.submit(self._choose)

    def _choose(self) -> None:
        with self._choosing:
            self._enter()

    def _enter(self) -> None:
        """Listen where the samples are."""
        if self._closed.is_set():
            return
        before, self._channel, self._confirmed = self._channel, None, False
        channels = self._route.channels
        if channels is not None:
            with suppress(NotSent):
                self._channel = channels.follow(self._target, self._operation, self)
        if self._channel is None:
            self._enter_network()
        if before is not None:
            self._leave(before)

    def _settle(self, channel: SampleChannel) -> None:
        with self._choosing:
            if self._closed.is_set() or self._channel is not channel:
                return
            if not channel.ended:
                self._confirmed = True
                self._leave_network()
            elif self._confirmed:  # its server may still be there
                self._enter()
            else:
                self._channel = None
                self._enter_network()

    def _enter_network(self) -> None:
        if self._subscriber is None:
            keep = Callback(self.keep, indirect=False)
            self._subscriber = self._transport.session.declare_subscriber(self._what, keep)

    def _leave_network(self) -> None:
        if self._subscriber is not None:
            undeclare(self._subscriber)
            self._subscriber = None

    def _leave(self, channel: SampleChannel) -> None:
        """End a channel, and drop what is unread of it: its memory is written again soon."""
        channel.shut()
        with self._arrived:
            lost = [sample for sample in self._samples if isinstance(sample, LentSample) and sample.is_lost]
            for sample in lost:
                self._samples.remove(sample)
        for sample in lost:
            sample.give_back()


def _opened(sample: zenoh.Sample, limit: int, what: str) -> Arrived:
    """Return the contents of a sample that came over Zenoh; raises MarshalException for too large ones."""
    payload = bounded(sample.payload, limit, f"sample of {what}")
    attachment = sample.attachment
    return Arrived(payload, None if attachment is None else attachment.to_bytes())


def bounded(payload: zenoh.ZBytes, limit: int, what: str) -> bytes:
    """Return received bytes; raises MarshalException for more than `limit`, before they are copied."""
    if len(payload) > limit:
        raise too_large(len(payload), limit, what)
    return payload.to_bytes()
