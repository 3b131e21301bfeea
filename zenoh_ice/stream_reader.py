"""What a stream brings to a client: the newest sample, kept for whoever asks or waits for it."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, Generic, Self, TypeVar, cast

import zenoh
from zenoh.handlers import RingChannel

from .attachment import NO_ATTACHMENT, decode_attachment
from .dispatch import mark_thread
from .exceptions import (
    CommunicatorDestroyedException,
    ConnectionLostException,
    MarshalException,
    ObjectNotExistException,
    TimeoutException,
    ZenohIceError,
)
from .operation import Operation
from .presence import Target

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["Sample", "StreamReader", "Subscription"]

V = TypeVar("V")

_JOIN_LIMIT: Final = 2.0

_logger = logging.getLogger(__name__)


class Sample(Generic[V]):
    """A value that a stream brought."""

    __slots__ = ("sequence", "time", "value", "wall_time")

    def __init__(self, value: V, sequence: int, time: float, wall_time: float) -> None:
        self.value: Final = value
        self.sequence: Final = sequence
        """Number of the sample in its stream: a gap shows samples that were skipped."""
        self.time: Final = time
        """Robot time of the value in s, nan when the servant gives none."""
        self.wall_time: Final = wall_time
        """Wall time of the servant's machine at which it was sent, in s since the epoch."""

    @property
    def age(self) -> float:
        """Wall seconds since it was sent; between machines as exact as their clocks agree."""
        return max(0.0, time.time() - self.wall_time)

    def __repr__(self) -> str:
        return f"<sample {self.sequence} at {self.time:.3f} s: {self.value!r:.200}>"


class StreamReader(Generic[V]):
    """Keep the newest sample of one stream.

    Until somebody waits, samples stay in Zenoh's ring of one, undecoded, and cost this process nothing. The
    first wait starts a thread that takes them out and wakes whoever waits.
    """

    def __init__(self, communicator: Communicator, target: Target, operation: Operation[..., V]) -> None:
        self.what: Final = f"{target.identity}.{operation.name}"
        self._communicator: Final = communicator
        self._target: Final = target
        self._operation: Final = operation
        self._limit: Final = communicator.size_limit(operation.result)
        self._changed = threading.Condition()
        self._pending: zenoh.Sample | None = None
        self._sample: Sample[V] | None = None
        self._pump: threading.Thread | None = None
        self._closed = False
        communicator.presence.watch(target.realm)
        self._subscriber: Final = communicator.session.declare_subscriber(
            f"{target.realm}/{target.identity}/{operation.name}", RingChannel(1)
        )
        # Kept apart: the subscriber can be undeclared while a thread waits in the handler.
        self._handler: Final[zenoh.Handler[zenoh.Sample]] = self._subscriber.handler
        self._try_receive = self._handler.try_recv
        communicator.presence.add_listener(self.wake)

    def latest(self) -> Sample[V] | None:
        """Return the newest sample, or None before the first.

        Raises MarshalException, once, for a sample that does not fit the operation.
        """
        with self._changed:
            self._check_open()
            raw = self._try_receive()
            if raw is not None:
                self._sample = self._decode(raw)
            return self._sample

    def wait(
        self, after: Sample[V] | None, timeout: float, stopped: threading.Event | None = None
    ) -> Sample[V]:
        """Return the newest sample as soon as there is one other than `after`.

        Once `stopped` is set and `wake` called it ends with TimeoutException.

        Raises ConnectionLostException, or its like, when the servant goes away meanwhile or is absent at the
        end; TimeoutException when it is there and sends nothing; MarshalException as `latest` does.
        """
        started = time.monotonic()
        deadline = started + timeout
        presence = self._communicator.presence
        with self._changed:
            self._start_pump()
            while True:
                sample = self.latest()
                if sample is not None and sample is not after:
                    return sample
                left = deadline - time.monotonic()
                if stopped is not None and stopped.is_set():
                    raise TimeoutException(f"nobody waits for {self.what} any more")
                lost = presence.lost_since(self._target, started) and not presence.interfaces(self._target)
                if left <= 0 or lost:
                    break
                self._changed.wait(left)
        if presence.interfaces(self._target):
            raise TimeoutException(f"no new sample of {self.what} within {timeout:g} s")
        raise presence.explain_absence(self._target)

    def close(self) -> None:
        """Unsubscribe; whoever waits is told."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._subscriber.undeclare()
        pump = self._pump
        if pump is not None and pump is not threading.current_thread():
            pump.join(_JOIN_LIMIT)

    def wake(self) -> None:
        """Let those who wait look again."""
        with self._changed:
            self._changed.notify_all()

    def _decode(self, raw: zenoh.Sample) -> Sample[V]:
        payload = raw.payload
        what = f"sample of {self.what}"
        if len(payload) > self._limit:
            raise MarshalException(f"{what}: {len(payload)} bytes where at most {self._limit} are taken")
        attachment = NO_ATTACHMENT if raw.attachment is None else decode_attachment(raw.attachment.to_bytes())
        value = cast("V", self._operation.result.unpack_result(payload.to_bytes(), what, self._communicator))
        return Sample(value, attachment.sequence, attachment.robot_time, attachment.wall_time)

    def _check_open(self) -> None:
        if self._closed or self._communicator.destroyed:
            raise CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")

    def _start_pump(self) -> None:
        if self._pump is None and not self._closed:
            self._try_receive = self._take_pending
            self._pump = threading.Thread(target=self._run_pump, name=f"stream {self.what}", daemon=True)
            self._pump.start()

    def _take_pending(self) -> zenoh.Sample | None:
        raw, self._pending = self._pending, None
        return raw

    def _run_pump(self) -> None:
        receive = self._handler.recv
        while True:
            try:
                raw = receive()
            except zenoh.ZError:  # unsubscribed
                return
            with self._changed:
                self._pending = raw
                self._changed.notify_all()


class Subscription:
    """A callback on a stream; `close` ends it, also as the end of a `with` block."""

    def __init__(
        self,
        reader: StreamReader[V],
        callback: Callable[[Sample[V]], Any],
        timeout: float,
        ended: Callable[[Subscription], None],
    ) -> None:
        self._reader: Final = reader
        self._ended: Final = ended
        self._closed = threading.Event()
        self._thread = threading.Thread(
            target=self._run,
            args=(reader, callback, timeout),
            name=f"subscription {reader.what}",
            daemon=True,
        )
        self._thread.start()

    def close(self) -> None:
        """End the calls; waits for one that runs, unless called from within it."""
        self._closed.set()
        self._ended(self)
        self._reader.wake()
        if self._thread is not threading.current_thread():
            self._thread.join(_JOIN_LIMIT)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self, reader: StreamReader[V], callback: Callable[[Sample[V]], Any], timeout: float) -> None:
        mark_thread()
        sample: Sample[V] | None = None
        while not self._closed.is_set():
            try:
                sample = reader.wait(sample, timeout, self._closed)
            except CommunicatorDestroyedException:
                return
            except (TimeoutException, ConnectionLostException, ObjectNotExistException):
                continue  # until the servant is back
            except ZenohIceError as error:
                _logger.error("%s: %s", reader.what, error)
                continue
            if self._closed.is_set():
                return
            try:
                callback(sample)
            except Exception:
                _logger.exception("the callback on %s failed", reader.what)
