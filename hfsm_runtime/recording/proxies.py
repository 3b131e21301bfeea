"""Proxies that are recorded: of the same classes as those that they stand for, with the same behaviour."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any, ClassVar, TypeVar, cast

from zenoh_ice import ObjectPrx, Sample, Subscription
from zenoh_ice.interface import Operation
from zenoh_ice.proxy import fail
from zenoh_ice.streams import Delivery, StreamReader

from ..component import Component, proxies_of
from .recorder import Recorder
from .results import AgedSample, Outcome, Results

__all__ = ["record_proxies"]

V = TypeVar("V")


def record_proxies(component: Component, recorder: Recorder) -> None:
    """Let a component see recorded proxies in place of those that it is connected by."""
    for name in proxies_of(component):
        proxy = vars(component).get(name)
        if isinstance(proxy, ObjectPrx) and not isinstance(proxy, _Recorded):
            results = Results(recorder, name)
            members = {"_recorder": recorder, "_results": results}
            recorded: Any = type(type(proxy).__name__, (_Recorded, type(proxy)), members)
            vars(component)[name] = recorded.uncheckedCast(proxy)


class _Recorded(ObjectPrx):
    """A proxy whose outcomes are recorded: mixed into the proxy's class, for one attribute of a component."""

    _recorder: ClassVar[Recorder]
    _results: ClassVar[Results]
    _tickets: ClassVar[itertools.count[int]] = itertools.count(1)

    def ice_invoke(self, operation: Operation[..., V], *args: Any, **kwargs: Any) -> V:  # noqa: ANN401
        """Call, and record the outcome."""
        turns = self._recorder.turns
        context = turns.context
        if context is None:
            return super().ice_invoke(operation, *args, **kwargs)
        outcome = Outcome(operation, "call", args)
        try:
            with turns.waiting():
                value = super().ice_invoke(operation, *args, **kwargs)
            outcome.take(value)
        except BaseException as error:
            outcome.error = error
            raise
        finally:
            self._results.put(outcome, context)
        return value

    def ice_invokeAsync(self, operation: Operation[..., V], *args: Any, **kwargs: Any) -> Future[V]:  # noqa: ANN401
        """Call, and record the outcome when it arrives."""
        genuine = super().ice_invokeAsync(operation, *args, **kwargs)
        context = self._recorder.turns.context
        if context is None:
            return genuine
        ticket = next(self._tickets)
        self._results.put(Outcome(operation, "begin", args, extra={"ticket": ticket}), context)
        visible: Future[V] = _RecordedFuture(self._recorder)
        visible.set_running_or_notify_cancel()
        genuine.add_done_callback(partial(self._arrived, operation, ticket, visible))
        return visible

    def ice_stream(self, operation: Operation[..., V]) -> StreamReader[V]:
        """Return a reader whose samples are recorded."""
        reader = super().ice_stream(operation)
        return cast("StreamReader[V]", _RecordedReader(reader, operation, self._recorder, self._results))

    def ice_subscribe(
        self, reader: StreamReader[V], callback: Callable[[Sample[V]], Any], delivery: Delivery
    ) -> Subscription[V]:
        """Subscribe, and record each sample that the callback gets."""
        recorder, results, recorded = self._recorder, self._results, cast("object", reader)
        if not isinstance(recorded, _RecordedReader) or recorder.turns.context is None:
            return super().ice_subscribe(reader, callback, delivery)
        ticket = next(self._tickets)
        operation = recorded.operation
        results.put(Outcome(operation, "subscribe", extra={"ticket": ticket}), recorder.turns.context)

        def deliver(sample: Sample[V]) -> None:
            context = f"subscription {ticket}"
            with recorder.turns.turn(context):
                results.put(sample_outcome(operation, "sample", sample, ticket=ticket), context)
                callback(AgedSample(sample, recorder))

        return super().ice_subscribe(cast("StreamReader[V]", recorded.genuine), deliver, delivery)

    def _arrived(
        self, operation: Operation[..., V], ticket: int, visible: Future[V], genuine: Future[V]
    ) -> None:
        context = f"future {ticket}"
        outcome = Outcome(operation, "async", extra={"ticket": ticket})
        with self._recorder.turns.turn(context):
            outcome.error = genuine.exception() if not genuine.cancelled() else None
            if outcome.error is not None:
                self._results.put(outcome, context)
                fail(visible, outcome.error)
            else:
                value = genuine.result()
                self._results.put(outcome.take(value), context)
                visible.set_result(value)


class _RecordedFuture(Future[V]):
    """A future whose waits let others have their turns."""

    def __init__(self, recorder: Recorder) -> None:
        super().__init__()
        self._recorder = recorder

    def result(self, timeout: float | None = None) -> V:
        """Wait for the outcome."""
        self._wait(timeout)
        return super().result(0.0)

    def exception(self, timeout: float | None = None) -> BaseException | None:
        """Wait for the outcome."""
        self._wait(timeout)
        return super().exception(0.0)

    def _wait(self, timeout: float | None) -> None:
        turns = self._recorder.turns
        if turns.context is None or self.done():
            if turns.context is None and not self.done():
                _settled(self, timeout)
            return
        with turns.waiting():
            _settled(self, timeout)
        self._recorder.reading("future", self.done())


def _settled(future: Future[Any], timeout: float | None) -> None:
    """Wait until a future is settled, or for so long."""
    with contextlib.suppress(TimeoutError):
        Future.exception(future, timeout)


class _RecordedReader:
    """A reader of a stream whose samples are recorded: what `StreamedCall` and `Subscription` ask of one."""

    def __init__(
        self, genuine: StreamReader[Any], operation: Operation[..., Any], recorder: Recorder, results: Results
    ) -> None:
        self.genuine = genuine
        self.operation = operation
        self._recorder = recorder
        self._results = results

    def latest(self) -> Sample[Any] | None:
        """Return the newest sample."""
        context = self._recorder.turns.context
        if context is None:
            return self.genuine.latest()
        return self._record("latest", context, self.genuine.latest)

    def wait(self, after: Sample[Any] | None, timeout: float) -> Sample[Any]:
        """Wait for a newer sample."""
        context = self._recorder.turns.context
        if context is None:
            return self.genuine.wait(_genuine(after), timeout)

        def wait() -> Sample[Any]:
            with self._recorder.turns.waiting():
                return self.genuine.wait(_genuine(after), timeout)

        return cast("Sample[Any]", self._record("wait", context, wait))

    def _record(self, kind: str, context: str, read: Callable[[], Sample[Any] | None]) -> Sample[Any] | None:
        try:
            sample = read()
        except BaseException as error:
            self._results.put(Outcome(self.operation, kind, error=error), context)
            raise
        if sample is None:
            self._results.put(Outcome(self.operation, kind), context)
            return None
        shown = self._results.newest.get(self.operation.name)
        if shown is not None and shown.genuine is sample:
            same = Outcome(self.operation, kind, extra={"same": True, "sequence": sample.sequence})
            self._results.put(same, context)
            return shown
        self._results.put(sample_outcome(self.operation, kind, sample), context)
        shown = self._results.newest[self.operation.name] = AgedSample(sample, self._recorder)
        return shown


def _genuine(sample: Sample[Any] | None) -> Sample[Any] | None:
    return sample.genuine if isinstance(sample, AgedSample) else sample


def sample_outcome(operation: Operation[..., Any], kind: str, sample: Sample[Any], **extra: Any) -> Outcome:  # noqa: ANN401
    """Return the outcome that a sample is."""
    time = None if math.isnan(sample.time) else sample.time  # which JSON lacks
    extra |= {"sequence": sample.sequence, "time": time, "wall_time": sample.wall_time, "age": sample.age}
    return Outcome(operation, kind, extra=extra).take(sample.value)
