"""Callbacks on streams."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final, Generic, Self, TypeVar

import zenoh

from ..dispatch import mark_thread
from ..exceptions import (
    CommunicatorDestroyedException,
    ConfigurationException,
    ConnectionLostException,
    InterfaceMismatchException,
    MarshalException,
)
from .pacing import Pacer
from .sample import Gaps, Sample
from .stream_source import MOST_HISTORY, StreamSource

__all__ = ["Delivery", "Subscription"]

V = TypeVar("V")

_JOIN_LIMIT: Final = 2.0  # s for which `close` waits for a callback that runs
_LONGEST_QUEUE: Final = 10_000
_LOWEST_RATE: Final = 1e-6  # samples a second: one every eleven days

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Delivery:
    """Which samples of a stream a subscription wants.

    Raises ConfigurationException for what makes no sense.
    """

    rate: float | None = None
    """Samples a second at most; none, as many as there are."""
    history: int = 0
    """How many samples from before the subscription come first, if the servant keeps so many."""
    queue: int = 1
    """How many samples wait for a callback that is busy: with 1 the newest alone."""
    timeout: float = 2.0
    """Seconds to wait for the history."""

    def __post_init__(self) -> None:
        if self.rate is not None and not _LOWEST_RATE <= self.rate < math.inf:
            raise ConfigurationException(
                f"a rate is a finite number of samples a second, {_LOWEST_RATE:g} or more, not {self.rate!r}"
            )
        for name, least, most in (("history", 0, MOST_HISTORY), ("queue", 1, _LONGEST_QUEUE)):
            value = getattr(self, name)
            if not isinstance(value, int) or not least <= value <= most:
                raise ConfigurationException(
                    f"{name} is from {least} to {most} samples, a whole number, not {value!r}"
                )


class Subscription(Generic[V]):
    """A callback on a stream; `close` ends it, also as the end of a `with` block.

    It has a queue and a thread of its own: a slow callback holds up nobody else.
    """

    def __init__(
        self,
        source: StreamSource[V],
        callback: Callable[[Sample[V]], Any],
        delivery: Delivery,
        ended: Callable[[Subscription[Any]], None],
    ) -> None:
        self.received = 0
        """How many samples the callback got."""
        self.lost = 0
        """How many it did not get: see `Sample.lost`. Those that a rate left out count, too."""
        self._source: Final = source
        self._callback: Final = callback
        self._delivery: Final = delivery
        self._ended: Final = ended
        self._gaps: Final = Gaps()
        self._readable = True
        self._closed: Final = threading.Event()
        self._lock: Final = threading.Lock()
        self._cancellation: Final = zenoh.CancellationToken()
        self._subscriber: Final = source.listen(delivery.queue)
        # Kept apart: the subscriber can be undeclared while the thread waits in the handler.
        self._thread: Final = threading.Thread(
            target=self._run,
            args=(self._subscriber.handler,),
            name=f"subscription {source.what}",
            daemon=True,
        )
        self._thread.start()

    def close(self) -> None:
        """End the calls; waits for one that runs, for at most 2 s, unless called from within it."""
        with self._lock:
            first = not self._closed.is_set()
            self._closed.set()
        if first:
            self._cancellation.cancel()
            try:
                self._subscriber.undeclare()  # ends the thread: its channel is closed
            except zenoh.ZError as error:  # the session was closed meanwhile
                _logger.debug("%s: %s", self._source.what, error)
            self._ended(self)
        if self._thread is not threading.current_thread():
            self._thread.join(_JOIN_LIMIT)
            if self._thread.is_alive():
                _logger.error("the callback on %s still runs", self._source.what)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self, handler: zenoh.Handler[zenoh.Sample]) -> None:
        mark_thread()
        newest: tuple[str, int] | None = None  # of those that came from the history
        for raw in self._history():
            if self._closed.is_set():
                return
            newest = self._deliver(raw, newest) or newest
        pacer = Pacer(self._delivery.rate)
        while True:
            if self._closed.wait(delay) if (delay := pacer.delay()) else self._closed.is_set():
                return
            try:
                raw = handler.recv()
            except zenoh.ZError:  # unsubscribed
                return
            if self._closed.is_set():
                return
            pacer.count()
            try:
                self._deliver(raw, newest)
            except CommunicatorDestroyedException:
                return
            del raw  # it may be large, and the next may be long in coming

    def _history(self) -> Iterator[zenoh.Sample]:
        if self._delivery.history:
            yield from self._source.history(
                self._delivery.history, self._delivery.timeout, self._cancellation
            )

    def _deliver(self, raw: zenoh.Sample, newest: tuple[str, int] | None) -> tuple[str, int] | None:
        """Call the callback with a sample, unless it was among those of the history; return which it was."""
        samples = self._source.samples
        try:
            about = samples.about(raw)
            if newest is not None and about.stream == newest[0] and about.sequence <= newest[1]:
                return None
            data = samples.read(raw)
            lost = self._gaps.before(about)
            self.lost += lost
            sample = samples.decode(data, about, lost)
        except ConnectionLostException as error:  # the next counts it among those that were lost
            _logger.debug("%s", error)
            return None
        except (MarshalException, InterfaceMismatchException) as error:
            if self._readable:
                _logger.error("%s; the next that fits goes on", error)
            self._readable = False
            return None
        self._readable = True
        self.received += 1
        try:
            self._callback(sample)
        except BaseException:
            _logger.exception("the callback on %s failed", self._source.what)
        return about.stream, about.sequence
