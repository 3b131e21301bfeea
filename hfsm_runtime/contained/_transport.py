"""The transport of a component at the far end: each call and each stream goes through the near end."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from functools import partial
from typing import Any, Final

from zenoh_ice import Communicator, Settings
from zenoh_ice.exceptions import SystemException
from zenoh_ice.in_process import InProcessTransport, Pool
from zenoh_ice.interface import Operation
from zenoh_ice.limits import LIMITS
from zenoh_ice.streams import LOOKS
from zenoh_ice.transport import (
    Arrived,
    Caller,
    Inlet,
    Outcome,
    Parted,
    Target,
    decode_attachment,
    outcome_of,
)

from . import protocol
from ._link import Link
from .protocol import Answered, Poll, Push, Sample, Subscribe, Unsubscribe, Wait


class FarTransport(InProcessTransport):
    """Carry calls and samples through a link; the near end finds the servants."""

    def __init__(self, link: Link) -> None:
        pool = Pool(0, "contained")
        super().__init__(pool)
        self.relay = self
        self.clock = link.clock
        self._link: Final = link
        self._numbers: Final = itertools.count(1)
        self.inlets: Final[dict[int, FarInlet]] = {}
        self.communicator: Final = Communicator(
            Settings(clock="sim"), pool=pool, transport=lambda _: self, clock=link.clock
        )
        link.clock.call_every(LIMITS.linger / LOOKS, self.communicator.streams.close_unwanted)

    def caller(
        self,
        target: Target,
        operation: Operation[..., Any],
        *,
        timeout: float,
        fingerprint: str | None = None,  # noqa: ARG002
    ) -> Caller:
        return _FarCaller(self._link, target, operation.name, timeout)

    def subscribe(self, target: Target, operation: Operation[..., Any], queue: int = 1) -> Inlet:
        number = next(self._numbers)
        self._link.ask(Subscribe(number, *target, operation.name, queue), Answered)
        inlet = self.inlets[number] = FarInlet(self._link, number, partial(self.inlets.pop, number, None))
        return inlet

    def find(self, target: Target, type_id: str, timeout: float) -> Mapping[str, str]:  # noqa: ARG002
        return self._link.ask(protocol.Find(*target, type_id), protocol.Found).fingerprints

    def wait(self, future: Future[Any], timeout: float | None) -> None:
        """Return at once: a call has its outcome when it has begun."""


class _FarCaller:
    def __init__(self, link: Link, target: Target, operation: str, timeout: float) -> None:
        self.timeout: Final = timeout
        self._link: Final = link
        self._target: Final = target
        self._operation: Final = operation

    def call(self, payload: bytes) -> Outcome:
        request = protocol.Call(*self._target, self._operation, payload)
        outcome = self._link.ask(request, protocol.Outcome)
        return outcome.ok, _payload(outcome.result)

    def begin(
        self, payload: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        done(outcome_of(partial(self.call, payload)))
        return lambda: None


class FarInlet:
    """The listening end of a stream, whose samples are at the near end until they are asked for."""

    def __init__(self, link: Link, number: int, forget: Callable[[], object]) -> None:
        self._link: Final = link
        self._number: Final = number
        self._forget: Final = forget
        self._holds: Callable[[], bool] = lambda: False
        self._callback: Callable[[Any], object] = lambda _: None

    def poll(self) -> Sample | None:
        return self._link.ask(Poll(self._number), protocol.Polled).sample

    def wait(self, changed: threading.Condition, holds: Callable[[], bool], timeout: float) -> bool:  # noqa: ARG002
        self._holds = holds
        return self._link.ask(Wait(self._number, max(0.0, timeout)), Answered).value

    def deliver(self, callback: Callable[[Any], object], rate: float | None = None) -> None:
        self._callback = callback
        self._link.ask(Push(self._number, rate), Answered)

    def open(self, sample: Sample) -> Arrived:
        assert sample.attachment is not None
        sent_at, now = decode_attachment(sample.attachment).wall_time, self._link.clock.now
        return Arrived(_payload(sample), sample.attachment, lambda: now() - sent_at)

    def close(self, timeout: float = 0.0) -> bool:  # noqa: ARG002
        if self._forget() is not None:
            self._link.ask(Unsubscribe(self._number), Answered)
        return True

    def holds(self) -> bool:
        """Return whether what is waited for has happened."""
        return bool(self._holds())

    def push(self, sample: Sample) -> None:
        """Call the function of a subscription."""
        self._callback(sample)


def _payload(sample: Sample) -> bytes | Parted:
    if sample.places is None:
        return sample.rest
    return Parted(sample.rest, tuple(sample.places), sample.large)
