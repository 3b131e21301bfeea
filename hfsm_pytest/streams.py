"""Streams within the process: what a servant publishes is there for who asks, in virtual time."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from types import TracebackType
from typing import Any, Final, Generic, Self, TypeVar

from zenoh_ice import Sample, TimeoutException
from zenoh_ice.operation import Operation
from zenoh_ice.streams.publisher import Publisher
from zenoh_ice.streams.stream_reader import LINGER
from zenoh_ice.wire.pieces import Pieces

from .clock import TaskClock

__all__ = ["InProcessChannel", "InProcessReader", "InProcessSubscription", "VirtualSample"]

V = TypeVar("V")

_logger = logging.getLogger(__name__)

_SIZE_LIMIT: Final = 1 << 30


class VirtualSample(Sample[V]):
    """A sample whose age counts virtual time."""

    __slots__ = ("_now",)

    def __init__(self, value: V, sequence: int, time: float, sent: float, now: Callable[[], float]) -> None:
        super().__init__(value, sequence, time, sent)
        self._now = now

    @property
    def age(self) -> float:
        """Virtual seconds since it was sent."""
        return self._now() - self.wall_time


class InProcessReader(Generic[V]):
    """The newest sample of a stream, kept for whoever asks or waits for it.

    As over the network, the first use begins to listen, and it stops when there is no subscription and nobody
    has asked for 10 s. `poll` takes samples where nobody publishes: from a stub; one that raises gives none.
    """

    def __init__(
        self,
        what: str,
        operation: Operation[..., V],
        clock: TaskClock,
        on_listening: Callable[[], None],
        poll: Callable[[], V] | None = None,
    ) -> None:
        self.what: Final = what
        self._operation: Final = operation
        self._clock: Final = clock
        self._on_listening: Final = on_listening
        self.poll: Callable[[], V] | None = poll
        self._asked_at = -math.inf
        self._raw: tuple[bytes, int, float, float] | None = None
        self._sample: VirtualSample[V] | None = None
        self._count = 0
        self._callbacks: list[Callable[[Sample[V]], Any]] = []

    @property
    def listening(self) -> bool:
        """Whether anybody wants the stream."""
        return bool(self._callbacks) or self._clock.now() - self._asked_at < LINGER

    def latest(self) -> Sample[V] | None:
        """Return the newest sample, or None before the first."""
        self._ask()
        return self._newest()

    def wait(self, after: Sample[V] | None, timeout: float) -> Sample[V]:
        """Move the time on until there is a sample other than `after`; raises TimeoutException."""
        self._ask()

        def arrived() -> bool:
            newest = self._newest()
            return newest is not None and newest is not after

        self._clock.wait_for(arrived, timeout)
        sample = self._newest()
        if sample is None or sample is after:
            raise TimeoutException(f"no new sample of {self.what} within {timeout:g} s")
        return sample

    def add(self, callback: Callable[[Sample[V]], Any]) -> None:
        """Call a function with every sample."""
        self._callbacks.append(callback)
        self._on_listening()

    def remove(self, callback: Callable[[Sample[V]], Any]) -> None:
        """Call a function no longer."""
        self._callbacks.remove(callback)

    def receive(self, payload: bytes, number: int, robot_time: float) -> None:
        """Take a sample as it would travel; it is decoded when somebody looks."""
        self._raw = (payload, number, robot_time, self._clock.now())
        self._count += 1
        for callback in tuple(self._callbacks):
            sample = self._newest()
            if sample is not None:
                callback(sample)

    def _ask(self) -> None:
        began = not self.listening
        self._asked_at = self._clock.now()
        if began:
            self._raw = self._sample = None  # what came before it stopped is stale
            self._on_listening()

    def _newest(self) -> VirtualSample[V] | None:
        if self.poll is not None:
            self._take_from_stub(self.poll)
        if self._raw is not None:
            payload, number, robot_time, sent = self._raw
            self._raw = None
            value: Any = self._operation.result.unpack_result(payload, f"sample of {self.what}")
            self._sample = VirtualSample(value, number, robot_time, sent, self._clock.now)
        return self._sample

    def _take_from_stub(self, poll: Callable[[], V]) -> None:
        now = self._clock.now()
        self._raw = None
        if self._sample is None or self._sample.wall_time < now:
            try:
                value = poll()
            except Exception as error:  # noqa: BLE001 - a servant that fails has nothing to publish
                _logger.debug("no sample of %s: %s", self.what, error)
            else:
                self._count += 1
                self._sample = VirtualSample(value, self._count, now, now, self._clock.now)


class InProcessChannel:
    """A publisher's way to the reader of one stream. Stands for `zenoh_ice.streams.publisher.Channel`."""

    size_limit: Final = _SIZE_LIMIT

    def __init__(self, reader: InProcessReader[Any]) -> None:
        self._reader: Final = reader
        self._publisher: Publisher[Any] | None = None

    @property
    def listening(self) -> bool:
        """Whether anybody listens."""
        return self._reader.listening

    def send(self, payload: bytes | Pieces, number: int, robot_time: float) -> None:
        """Hand over a sample."""
        self._reader.receive(bytes(payload), number, robot_time)

    def attach_to(self, publisher: Publisher[Any]) -> None:
        """Let a servant publish here, and no longer the one before."""
        if publisher is not self._publisher:
            if self._publisher is not None:
                self._publisher.detach(self)  # type: ignore[arg-type]
            publisher.attach(self)  # type: ignore[arg-type]
            self._publisher = publisher


class InProcessSubscription(Generic[V]):
    """A callback on a stream; `close` ends it, also as the end of a `with` block."""

    def __init__(self, reader: InProcessReader[V], callback: Callable[[Sample[V]], Any]) -> None:
        self._reader: Final = reader
        self._callback: Final = callback
        self._closed = False
        reader.add(callback)

    def close(self) -> None:
        """End the calls."""
        if not self._closed:
            self._closed = True
            self._reader.remove(self._callback)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
