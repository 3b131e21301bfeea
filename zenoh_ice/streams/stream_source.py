"""Where the samples of one stream come from: what subscribes to it, and what is kept of its past."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from itertools import islice
from typing import TYPE_CHECKING, Final, Generic, TypeVar

import zenoh
from zenoh.handlers import FifoChannel, RingChannel

from ..exceptions import CommunicatorDestroyedException
from ..identity import Target
from ..operation import Operation
from .sample import SampleDecoder

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["HISTORY_PARAMETER", "MOST_HISTORY", "StreamSource"]

V = TypeVar("V")

HISTORY_PARAMETER: Final = "history"
"""The parameter by which a query at an operation's key asks for the last samples instead of calling it."""
MOST_HISTORY: Final = 1000
"""Samples that a publisher keeps at most."""

_LARGEST_HISTORY: Final = 512 << 20  # bytes: 140 images of 1280x960

_logger = logging.getLogger(__name__)


class StreamSource(Generic[V]):
    """One stream of one servant, as a communicator gets at it."""

    def __init__(self, communicator: Communicator, target: Target, operation: Operation[..., V]) -> None:
        self.name: Final = operation.name
        self.what: Final = f"{target.object}.{operation.name}"
        self.communicator: Final = communicator
        self.target: Final = target
        self.samples: Final = SampleDecoder(communicator, target, operation, self.what)
        self._key: Final = target.prefix + operation.name
        communicator.appear_in(target.realm)

    def listen(self, queue: int = 1) -> zenoh.Subscriber[zenoh.Handler[zenoh.Sample]]:
        """Subscribe with a queue that the oldest samples fall out of; raises CommunicatorDestroyedException.

        Nothing but such a queue: one that is full and keeps what it has would hold up the whole session.
        """
        self.check_open()
        try:
            return self.communicator.session.declare_subscriber(self._key, RingChannel(queue))
        except zenoh.ZError:
            self.check_open()
            raise

    def history(
        self, count: int, timeout: float, cancellation: zenoh.CancellationToken
    ) -> list[zenoh.Sample]:
        """Return at most the last `count` samples that the servant keeps, the oldest first.

        It keeps none if it does not answer within `timeout` s.
        """
        try:
            replies = self.communicator.session.get(
                f"{self._key}?{HISTORY_PARAMETER}={count}",
                FifoChannel(MOST_HISTORY + 1),
                timeout=timeout,
                consolidation=zenoh.ConsolidationMode.NONE,
                priority=zenoh.Priority.DATA_HIGH,
                cancellation_token=cancellation,
            )
            return self._first(count, replies)
        except zenoh.ZError as error:  # the session was closed meanwhile
            _logger.debug("no history of %s: %s", self.what, error)
            return []

    def _first(self, count: int, replies: Iterable[zenoh.Reply]) -> list[zenoh.Sample]:
        """Return at most so many samples, whatever else a servant sends that does not know when to end."""
        samples: list[zenoh.Sample] = []
        size = 0
        for reply in islice(replies, count):
            if reply.ok is not None:
                size += len(reply.ok.payload)
                if size > _LARGEST_HISTORY:
                    _logger.error("a history of %s of more than %d bytes: cut", self.what, _LARGEST_HISTORY)
                    break
                samples.append(reply.ok)
        return samples

    def check_open(self) -> None:
        """Raise CommunicatorDestroyedException when the communicator was destroyed."""
        if self.communicator.destroyed:
            raise CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")
