"""The ends of streams over Zenoh."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Any, Final

import zenoh
from zenoh.handlers import RingChannel

from zenoh_ice.carriers.zenoh.session import undeclare
from zenoh_ice.data.codec import Pieces, too_large
from zenoh_ice.threads._starting import UserCodeThread, start
from zenoh_ice.transport import Arrived, Pacer

Sample = zenoh.Sample

_logger = logging.getLogger(__name__)


class NetworkOutlet:
    """The publishing end of a stream."""

    def __init__(self, session: zenoh.Session, key: str, *, bulk: bool) -> None:
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
        with self._lock:
            return not self._closed and bool(self._publisher.matching_status.matching)  # type: ignore[attr-defined]

    def put(self, payload: bytes | Pieces, attachment: bytes) -> None:
        with self._lock:
            if self._closed:
                return
            try:
                self._publisher.put(bytes(payload), attachment=attachment)
            except zenoh.ZError as error:  # the session was closed meanwhile
                _logger.debug("sample dropped: %s", error)

    def close(self) -> None:
        with self._lock:
            self._closed = True
            self._publisher.undeclare()


class ThreadInlet(ABC):
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


class SmallInlet(ThreadInlet):
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
        return opened(sample, self._limit, self._what)

    def _receive(self) -> zenoh.Sample | None:
        try:
            return self._handler.recv()
        except zenoh.ZError:  # undeclared
            return None

    def _stop(self) -> None:
        undeclare(self._subscriber)  # its channel is closed


def opened(sample: Sample, limit: int, what: str) -> Arrived:
    """Return the contents of a sample that came over Zenoh; raises MarshalException for too large ones."""
    payload = bounded(sample.payload, limit, f"sample of {what}")
    attachment = sample.attachment
    return Arrived(payload, None if attachment is None else attachment.to_bytes())


def bounded(payload: zenoh.ZBytes, limit: int, what: str) -> bytes:
    """Return received bytes; raises MarshalException for more than `limit`, before they are copied."""
    if len(payload) > limit:
        raise too_large(len(payload), limit, what)
    return payload.to_bytes()
