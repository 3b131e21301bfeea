"""The transport of a recorded component: it writes down everything that passes through.

It calls and listens through the communicator that connected the component, and passes payloads unchanged.
Presence, the reasons of failures and retries are decided below it: only the outcome is recorded, and a replay
does not decide anything again.
"""

from __future__ import annotations

import itertools
import math
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, Final

from zenoh_ice import Clock, Communicator, ObjectPrx, Sample, Settings, Subscription, UserException
from zenoh_ice.data.codec import Parted
from zenoh_ice.data.exceptions import SystemException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.data.wire import encode_error, encode_sample_attachment
from zenoh_ice.objects.proxy import Call
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Arrived, Caller, Inlet, Outcome

from ..component import Component, proxies_of
from .clocks import InterceptedClock
from .recorder import Recorder
from .results import Exchange, Results


class ObservedTransport(InProcessTransport):
    """The base class of transports that decide what a component sees, and when: each is its own relay."""

    def __init__(self, settings: Settings, clock: Clock | None = None) -> None:
        pool = Pool(0, "observed")
        super().__init__(pool)
        self.relay = self
        self.communicator: Final = Communicator(settings, pool=pool, transport=lambda _: self, clock=clock)

    def caller(
        self,
        target: Target,
        operation: Operation[..., Any],
        *,
        timeout: float,
        fingerprint: str | None = None,  # noqa: ARG002
    ) -> Caller:
        return self.call_through(target, operation, timeout)

    def call_through(self, target: Target, operation: Operation[..., Any], timeout: float) -> Caller:
        """Return the caller of an operation; `timeout` is the limit of a call in s."""
        raise NotImplementedError

    def find(self, target: Target, type_id: str, timeout: float) -> Mapping[str, str]:
        """Return the fingerprints of a servant's interfaces by type id, as `Communicator.find` does."""
        raise NotImplementedError

    def wait(self, future: Future[Any], timeout: float | None) -> None:
        """Wait until a future is done, for at most this many s."""
        raise NotImplementedError

    def forget(self, target: Target, operation: Operation[..., Any]) -> None:
        """Let the reader of a stream forget its sample."""
        self.communicator.streams.reader(target, operation).forget()


def target_of(proxy: ObjectPrx) -> Target:
    """Return the target of a proxy."""
    return Target(proxy.ice_getRealm(), proxy.ice_getIdentity())


def encoded_sample(
    operation: Operation[..., Any], payload: bytes | Parted, about: dict[str, Any], age: Callable[[], float]
) -> Arrived:
    """Return a sample as a transport delivers it; `about` has the fields of a `Result` about a sample."""
    time = math.nan if about["time"] is None else about["time"]
    fingerprint = operation.interface.fingerprint if operation.interface else ""
    attachment = encode_sample_attachment(
        fingerprint, about["sequence"], time, about["stream"], about["wall_time"]
    )
    return Arrived(payload, attachment, age)


@contextmanager
def released(lock: threading.Condition) -> Iterator[None]:
    """Release a lock that is held, in a `with` block that waits."""
    lock.release()
    try:
        yield
    finally:
        lock.acquire()


@contextmanager
def recorded_proxies(component: Component, recorder: Recorder) -> Iterator[None]:
    """Replace the proxies of a component by recorded ones, in a `with` block."""
    declared = {name: vars(component).get(name) for name in proxies_of(component)}
    proxies = {name: proxy for name, proxy in declared.items() if isinstance(proxy, ObjectPrx)}
    if not proxies:
        yield
        return
    with _RecordingTransport(recorder, proxies).communicator as communicator:
        for name, proxy in proxies.items():
            recorded = type(proxy).uncheckedCast(communicator.stringToProxy(proxy.ice_toWire()))
            vars(component)[name] = recorded.ice_invocationTimeout(proxy.ice_getInvocationTimeout())
        try:
            yield
        finally:
            vars(component).update(proxies)


class _RecordingTransport(ObservedTransport):
    """Call and listen through the communicator of proxies, and record what a component's own code sees."""

    def __init__(self, recorder: Recorder, proxies: Mapping[str, ObjectPrx]) -> None:
        self.below: Final = next(iter(proxies.values())).ice_getCommunicator()
        self.lock: Final = recorder.lock
        self.recorder: Final = recorder
        self.tickets: Final = itertools.count(1)
        self._proxies: Final = [(name, target_of(proxy), proxy) for name, proxy in proxies.items()]
        self._results: Final[dict[Target, Results]] = {}
        self.clock = InterceptedClock(self.below.streams.clock, recorder.ask)
        super().__init__(self.below.settings)

    def call_through(self, target: Target, operation: Operation[..., Any], timeout: float) -> Caller:
        proxies = [proxy for _, known, proxy in self._proxies if known == target]
        fitting = (p for p in proxies if p.ice_interface.all_operations.get(operation.name) is operation)
        proxy = next(fitting, proxies[0] if proxies else self.below.stringToProxy(str(target)))
        proxy = proxy.ice_invocationTimeout(1000 * timeout)
        return _RecordedCaller(self, target, operation, proxy)

    def subscribe(self, target: Target, operation: Operation[..., Any], queue: int = 1) -> Inlet:
        return _RecordedInlet(self, target, operation, queue)

    def find(self, target: Target, type_id: str, timeout: float) -> Mapping[str, str]:
        with self.lock.released():
            return self.below.find(target, type_id, timeout)

    def wait(self, future: Future[Any], timeout: float | None) -> None:
        """Wait for a future while other threads run code."""
        with self.lock.released(), suppress(TimeoutError, CancelledError):
            Future.exception(future, timeout)
        self.recorder.reading("future", future.done())

    def results(self, target: Target) -> Results:
        """Return the recorder of the exchanges with a servant."""
        names = (name for name, known, _ in self._proxies if known == target)
        made = Results(self.recorder, next(names, str(target)), self.below.stringToProxy)
        return self._results.setdefault(target, made)


class _Recorded:
    """One operation of a servant. Only calls by code that holds the lock are recorded."""

    def __init__(
        self, transport: _RecordingTransport, target: Target, operation: Operation[..., Any]
    ) -> None:
        self._transport: Final = transport
        self._lock: Final = transport.lock
        self._target: Final = target
        self._operation: Final = operation
        self._results: Final = transport.results(target)

    @contextmanager
    def _recorded(self, kind: str, arguments: bytes | None = None) -> Iterator[Exchange]:
        """Record an exchange at the end of a `with` block, including any exception."""
        exchange = Exchange(self._operation, kind, arguments)
        context = self._lock.context
        try:
            yield exchange
        except BaseException as error:
            exchange.error = error
            raise
        finally:
            if context is not None:
                self._results.put(exchange, context)

    def _begin(self, kind: str, arguments: bytes | None = None) -> int:
        """Record the beginning of an exchange whose result arrives later; return its ticket."""
        if self._lock.context is None:
            return 0
        with self._recorded(kind, arguments) as exchange:
            ticket = exchange.extra["ticket"] = next(self._transport.tickets)
        return ticket

    def _arrive(self, context: str, ticket: int, exchange: Exchange, deliver: Callable[[], object]) -> None:
        """Record an arriving result, and deliver it under the lock."""
        if not ticket:
            deliver()
            return
        exchange.extra["ticket"] = ticket
        with self._lock.held(f"{context} {ticket}"):
            self._results.put(exchange, f"{context} {ticket}")
            deliver()


class _RecordedCaller(_Recorded):
    """Call an operation, and record its outcome."""

    def __init__(
        self, transport: _RecordingTransport, target: Target, operation: Operation[..., Any], proxy: ObjectPrx
    ) -> None:
        super().__init__(transport, target, operation)
        self.timeout: Final = proxy.ice_getInvocationTimeout() / 1000
        self._call: Final = Call(proxy, operation)

    def call(self, payload: bytes) -> Outcome:
        """Call and wait for the answer, while other threads run code."""
        with self._recorded("call", payload) as exchange, self._lock.released():
            return _outcome_of(exchange, partial(self._call.call_encoded, payload))

    def begin(
        self, payload: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        """Call without waiting; `done`, and what it causes, runs under the lock."""
        future = self._call.begin_encoded(payload)
        ticket = self._begin("begin", payload)

        def answered(future: Future[bytes | Parted]) -> None:
            exchange = Exchange(self._operation, "async")
            outcome: Outcome | SystemException
            try:
                outcome = _outcome_of(exchange, future.result)
            except CancelledError:
                return
            except SystemException as error:
                exchange.error = outcome = error
            self._arrive("future", ticket, exchange, partial(done, outcome))

        future.add_done_callback(answered)
        return future.cancel


def _outcome_of(exchange: Exchange, call: Callable[[], bytes | Parted]) -> Outcome:
    """Return the outcome of a call, and note it."""
    try:
        exchange.packed = result = call()
    except UserException as error:
        exchange.error = error
        return False, encode_error(error)
    return True, result


class _RecordedInlet(_Recorded):
    """The listening end of a stream: records which sample is read, and when.

    Samples are those of the reader below, with payloads as values.
    """

    def __init__(
        self, transport: _RecordingTransport, target: Target, operation: Operation[..., Any], queue: int
    ) -> None:
        super().__init__(transport, target, operation)
        self._queue: Final = queue
        self._reader: Final = transport.below.streams.reader(target, operation, encoded=True)
        self._newest: Sample[Any] | None = None  # that the reader above has
        self._last_recorded: Sample[Any] | None = None
        self._subscription: Subscription[Any] | None = None

    def poll(self) -> Sample[Any] | None:
        """Return the newest sample if it has changed since the last call."""
        with self._recorded("latest") as exchange:
            before, self._newest = self._newest, self._reader.latest()
            if self._lock.context is not None:
                self._show(exchange)
        if self._newest is before:
            return None
        if self._newest is None:  # nobody had read the stream for long
            self._transport.forget(self._target, self._operation)
        return self._newest

    def wait(self, changed: threading.Condition, holds: Callable[[], bool], timeout: float) -> bool:
        """Wait, while other threads run code, until a function that polls returns true."""
        now = self._transport.below.streams.clock.now
        deadline = now() + timeout
        while not holds():
            with self._recorded("wait"), released(changed), self._lock.released():
                self._reader.wait(self._newest, max(0.0, deadline - now()))
        return True

    def deliver(self, callback: Callable[[Any], object], rate: float | None = None) -> None:
        """Call a function with each sample, under the lock."""
        ticket = self._begin("subscribe")

        def deliver(sample: Sample[Any]) -> None:
            exchange = Exchange(self._operation, "sample", None, sample.value, extra=_describe(sample))
            self._arrive("subscription", ticket, exchange, partial(callback, sample))

        self._subscription = Subscription(self._reader, deliver, rate, self._queue)

    def open(self, sample: Sample[Any]) -> Arrived:
        """Return what a sample holds; its age is recorded each time it is read."""
        return encoded_sample(self._operation, sample.value, _describe(sample), partial(self._age, sample))

    def close(self, timeout: float = 0.0) -> bool:  # noqa: ARG002 - that of the subscription below
        if self._subscription is not None:
            self._subscription.close()
        return True

    def _show(self, exchange: Exchange) -> None:
        """Record which sample is the newest."""
        sample = self._newest
        if sample is not None and sample is self._last_recorded:
            exchange.extra = {"same": True, "sequence": sample.sequence}
        elif sample is not None:
            exchange.packed, exchange.extra = sample.value, _describe(sample)
            self._last_recorded = sample

    def _age(self, sample: Sample[Any]) -> float:
        age = sample.age
        self._transport.recorder.reading("age", age)
        return age


def _describe(sample: Sample[Any]) -> dict[str, Any]:
    time = None if math.isnan(sample.time) else sample.time  # which JSON lacks
    about = {"sequence": sample.sequence, "time": time, "wall_time": sample.wall_time}
    return about | {"age": sample.age, "stream": sample.stream}
