"""Streams: publishers at the servant; the newest sample, loops and callbacks at its clients."""

from __future__ import annotations

import itertools
import logging
import math
import os
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final, Generic, Self, TypeVar, cast
from weakref import WeakValueDictionary

from zenoh_ice.data import exceptions
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.data.text import sentence
from zenoh_ice.data.values import Resolve
from zenoh_ice.data.wire import NO_ATTACHMENT, Attachment, decode_attachment, encode_sample_attachment
from zenoh_ice.objects._presence import Presence
from zenoh_ice.objects.callbacks import notify_of_failure
from zenoh_ice.threads._starting import repeat
from zenoh_ice.threads.clock import WALL, Clock
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.threads.pool import Pool
from zenoh_ice.transport import Inlet, Outlet, Pacer, Transport

V = TypeVar("V")

CHECKS: Final = 4
"""Calls of `Streams.close_unwanted` in `Limits.linger` s."""

# s after which a coroutine checks anyway: it is not woken when its servant disappears.
_CHECK_PERIOD: Final = 0.1  # s
_WORTH_ASKING: Final = 0.1  # s, the shortest wait in which the servant is asked whether it sees a listener
_INQUIRY_TIME: Final = 1.0  # s before the end of a wait at which it is asked
_ASKING_SHARE: Final = 0.75  # the same as a share of short waits
_EXPLAINING: Final = 0.05  # s after the end of a wait in which its failure may be explained
_LONGEST_QUEUE: Final = 10_000
_LOWEST_RATE: Final = 1e-6  # samples a second: one every eleven days

_logger = logging.getLogger(__name__)


# At the servant.


class Publisher(Generic[V]):
    """Publish the values of a streamed operation to its listeners.

    It may be used from any thread. Samples are dropped rather than queued when the network is slower than
    the servant: a listener wants the newest.
    """

    def __init__(self, operation: Operation[..., V], fingerprint: str) -> None:
        """Make the publisher of a servant whose interface has this fingerprint."""
        self.operation: Final = operation
        self._fingerprint: Final = fingerprint
        self.stream: Final = os.urandom(8).hex()
        """Different after each restart, so that the numbers of samples can begin again."""
        self.clock: Clock = WALL
        """That of a transport in virtual time stamps the samples."""
        self._numbers = itertools.count(1)
        # Reentrant: a listener that gets a sample at once, in a test without a network, may publish, too.
        self._sending = threading.RLock()
        self._lock = threading.Lock()
        self._outlets: tuple[Outlet, ...] = ()  # one for each identity of the servant

    @property
    def listening(self) -> bool:
        """Return whether anybody listens; takes less than a microsecond."""
        return any(outlet.listening for outlet in self._outlets)

    def publish(self, value: V, time: float = math.nan) -> None:
        """Send a value to all listeners; does nothing while there are none.

        `time` is the robot time of the value in s. Raises MarshalException for a value that does not fit the
        operation.
        """
        outlets = [outlet for outlet in self._outlets if outlet.listening]
        if not outlets:
            return
        what = f"sample of {self.operation.name}"
        result = self.operation.result
        payload = result.gather_result(value, what)
        if len(payload) > result.size_limit:
            raise exceptions.MarshalException(
                f"{what}: {len(payload)} bytes; at most {result.size_limit} are sent"
            )
        sent_at = None if self.clock is WALL else self.clock.now()
        with self._sending:  # they travel in the order of their numbers
            attachment = encode_sample_attachment(
                self._fingerprint, next(self._numbers), time, self.stream, sent_at
            )
            for outlet in outlets:
                outlet.put(payload, attachment)

    def attach(self, outlet: Outlet) -> None:
        """Publish through an outlet, too."""
        with self._lock:
            self._outlets += (outlet,)

    def detach(self, outlet: Outlet) -> None:
        """Stop publishing through an outlet."""
        with self._lock:
            self._outlets = tuple(other for other in self._outlets if other is not outlet)


# At the client.


@dataclass(slots=True, eq=False, repr=False)
class Sample(Generic[V]):
    """A value received from a stream."""

    value: V
    sequence: int
    """Number of the sample in its stream; begins again when its servant restarts."""
    time: float
    """Robot time of the value in s, nan when the servant gives none."""
    wall_time: float
    """Wall time of the servant's machine at which it was sent, in s since the epoch."""
    lost: int = 0
    """Number of samples lost between the previous one and this one.

    Newer ones replaced them because the reader is slower than the stream, or they were lost on the way.
    """
    stream: str = ""
    """Id of its stream, different after each restart of its servant; empty if it is not known."""
    _age: Callable[[], float] | None = None
    _sent_at: float = field(init=False)

    def __post_init__(self) -> None:
        # From here on by the steady clock: when the date is set back, old samples must not look fresh.
        self._sent_at = time.monotonic() - max(0.0, time.time() - self.wall_time)

    @property
    def age(self) -> float:
        """Wall seconds since it was sent; between machines as exact as their clocks agree."""
        return time.monotonic() - self._sent_at if self._age is None else self._age()

    def follows(self, other: Sample[V] | None) -> bool:
        """Return whether it is newer than another sample, or from a different run of the servant."""
        if other is None or not self.stream or self.stream != other.stream:
            return self is not other
        return self.sequence > other.sequence

    def __repr__(self) -> str:
        from rich.pretty import pretty_repr  # here: most programs never need it

        # An image of some megabytes must not be formatted to show its beginning.
        value = pretty_repr(self.value, max_width=1 << 16, max_length=8, max_string=40, max_depth=4)
        return f"<sample {self.sequence} at {self.time:.3f} s: {value:.200}>"


class Streams:
    """The streams that a communicator reads: shared by its proxies, and closed when nobody wants them.

    `resolve` makes proxies of texts; `sees_listener` returns whether a servant sees a listener to one of its
    streams, until a moment of the monotonic clock. If the pool has threads, one of them asks that, and
    another one calls `close_unwanted` from time to time.
    """

    def __init__(
        self,
        transport: Transport,
        presence: Presence,
        *,
        resolve: Resolve,
        sees_listener: Callable[[Target, str, float], bool],
        pool: Pool,
        limits: Limits = LIMITS,
    ) -> None:
        self.presence: Final = presence
        self.resolve: Final = resolve
        self.sees_listener: Final = sees_listener
        self.pool: Final = pool
        self.limits: Final = limits
        self.clock: Final = transport.clock
        """The clock by which readers pace themselves."""
        self.closed: Final = threading.Event()
        self.listening: Final[set[StreamReader[Any] | Subscription[Any]]] = set()
        self._transport: Final = transport
        self._lock: Final = threading.RLock()
        self._readers: Final = WeakValueDictionary[
            tuple[Target, Operation[..., Any], bool], StreamReader[Any]
        ]()
        self._repeating: Callable[[], object] | None = None
        presence.add_listener(self._wake)

    def reader(
        self, target: Target, operation: Operation[..., V], *, encoded: bool = False
    ) -> StreamReader[V]:
        """Return the reader of a stream; with `encoded`, the values of its samples are payloads.

        Raises CommunicatorDestroyedException after `close`, BusyException where there is no thread for it.
        """
        with self._lock:
            reader = self._readers.get((target, operation, encoded))
            if reader is None:
                reader = StreamReader(self, target, operation, encoded=encoded)
                self._check_open(reader)
                if self.pool.has_threads and self._repeating is None:
                    self._repeating = repeat(
                        self.limits.linger / CHECKS, self.close_unwanted, "zenoh_ice streams"
                    )
                self._readers[target, operation, encoded] = reader
            return reader

    def listen(self, listener: StreamReader[Any] | Subscription[Any], queue: int) -> Inlet:
        """Return a listening end for a listener; raises CommunicatorDestroyedException after `close`."""
        with self._lock:
            self._check_open(listener)
            inlet = self._transport.subscribe(listener.target, listener.operation, queue)
            listener.inlet = inlet  # before it is in the set, from which another thread may close it
            self.listening.add(listener)
            return inlet

    def close_unwanted(self) -> None:
        """Close readers that nobody asked for the last four calls."""
        for reader in self._all_readers():
            reader.close_if_unwanted()

    def end_subscriptions(self, target: Target) -> None:
        """Close the subscriptions to streams of a servant."""
        with self._lock:
            listening = tuple(self.listening)
        for listener in listening:
            if isinstance(listener, Subscription) and listener.target == target:
                listener.close()

    def close(self) -> None:
        """Close all readers and subscriptions."""
        with self._lock:
            self.closed.set()
            listening = tuple(self.listening)
        self._wake()
        for listener in listening:
            listener.close()
        if self._repeating is not None:
            self._repeating()

    def _check_open(self, listener: _Listener[Any]) -> None:
        if self.closed.is_set():
            raise exceptions.CommunicatorDestroyedException(
                f"{listener.what}: the communicator was destroyed"
            )

    def _wake(self) -> None:
        for reader in self._all_readers():
            reader.wake()

    def _all_readers(self) -> list[StreamReader[Any]]:
        with self._lock:
            return list(self._readers.values())


class _Listener(Generic[V]):
    """Listen to one stream, and decode its samples, unless the payload is to be their value."""

    def __init__(
        self, streams: Streams, target: Target, operation: Operation[..., V], *, encoded: bool
    ) -> None:
        self.streams: Final = streams
        self.target: Final = target
        self.operation: Final = operation
        self.encoded: Final = encoded
        self.what: Final = f"{target.identity}.{operation.name}"
        self.inlet: Inlet | None = None
        self._accepted = ""  # fingerprint
        self._last: Attachment | None = None  # of the sample before
        self.lost = 0
        """Number of samples that did not arrive: see `Sample.lost`. Those dropped for a rate count, too."""
        streams.presence.watch(target.realm)

    def _decode(self, inlet: Inlet, raw: object) -> Sample[V] | None:
        """Return a received sample; None for one that was lost, or received before.

        Raises MarshalException for one that does not fit the operation, InterfaceMismatchException for one of
        a servant with another interface.
        """
        try:
            arrived = inlet.open(raw)
        except exceptions.ConnectionLostException as error:  # the next sample counts it as lost
            _logger.debug("%s", error)
            return None
        about = NO_ATTACHMENT if arrived.attachment is None else decode_attachment(arrived.attachment)
        last = self._last
        lost = 0
        # After a restart of the servant it is not known how many it sent before.
        if last is not None and last.stream == about.stream:
            if about.stream and about.sequence <= last.sequence:  # it came over both routes
                return None
            lost = max(0, about.sequence - last.sequence - 1)
        self._last = about
        self.lost += lost
        if about.fingerprint != self._accepted:
            self._check_fingerprint(about.fingerprint)
        value: object = arrived.payload
        if not self.encoded:
            what = f"sample of {self.what}"
            value = self.operation.result.unpack_result(arrived.payload, what, self.streams.resolve)
        return Sample(
            cast("V", value),
            about.sequence,
            about.robot_time,
            about.wall_time,
            lost,
            about.stream,
            arrived.age,
        )

    def _check_fingerprint(self, fingerprint: str) -> None:
        own = self.operation.interface
        if own is not None and own.fingerprint and fingerprint != own.fingerprint:
            # The sample has the fingerprint of its servant's own interface, which may extend ours.
            found = self.streams.presence.interfaces(self.target).get(own.type_id, own.fingerprint)
            if found != own.fingerprint:
                what = f"sample of {self.what}"
                raise exceptions.InterfaceMismatchException.between(what, own.type_id, own.fingerprint, found)
        self._accepted = fingerprint


class _Inquiry:
    """The question to a servant, before a wait for its stream ends, whether it sees a listener.

    A stream may be denied silently, and only the servant knows. Another thread asks: the wait for samples
    goes on, and ends in time.
    """

    def __init__(self, reader: StreamReader[Any], started: float, timeout: float) -> None:
        self._reader: Final = reader
        self._end: Final = started + timeout
        self._worth_asking: Final = timeout >= _WORTH_ASKING
        self._unseen = False
        self._begun = False
        ahead = min(_INQUIRY_TIME, _ASKING_SHARE * timeout) if self._worth_asking else 0.0
        self.delay: Final = timeout - ahead if reader.streams.pool.has_threads else timeout
        """Seconds after the start of the wait when it is time to ask; those of the whole wait for never."""

    def begin(self) -> bool:
        """Ask, once, if it makes sense; return whether the wait goes on meanwhile.

        Without threads, in virtual time, it is over: the clock on the wall says nothing about that.
        """
        goes_on = self._reader.streams.pool.has_threads and self._end > time.monotonic()
        if goes_on and not self._begun and self._worth_asking and self._reader.has_none:
            self._begun = True
            self._reader.streams.pool.submit(self._ask)
        return goes_on

    def is_unseen(self) -> bool:
        """Return whether the servant said that it sees no listener."""
        if not self._reader.streams.pool.has_threads and self._worth_asking and self._reader.has_none:
            self._ask()  # in virtual time it takes none
        return self._unseen

    def _ask(self) -> None:
        reader = self._reader
        self._unseen = not reader.streams.sees_listener(reader.target, reader.operation.name, self._end)


class StreamReader(_Listener[V]):
    """Keep the newest sample of one stream, and listen to it only while it is used.

    Asking for a sample makes it listen. When nobody has asked for `linger` s it stops, so that the servant
    need not publish any more, and forgets the sample, which would be stale at the next request.

    Samples stay in the transport, undecoded, until they are read.
    """

    def __init__(
        self, streams: Streams, target: Target, operation: Operation[..., V], *, encoded: bool = False
    ) -> None:
        super().__init__(streams, target, operation, encoded=encoded)
        self._lock: Final = threading.RLock()
        self._changed: Final = threading.Condition(self._lock)
        self._sample: Sample[V] | None = None
        self._waiting = 0  # threads
        self._checks = 0  # of `close_if_unwanted`, since somebody asked

    def latest(self) -> Sample[V] | None:
        """Return the newest sample, or None before the first.

        Raises MarshalException, once, for a sample that does not fit the operation, and
        InterfaceMismatchException for one of a servant with another version of the interface.
        """
        with self._lock:
            self._checks = 0
            inlet = self.inlet or self.streams.listen(self, queue=1)
            raw = inlet.poll()
            if raw is not None:
                self._sample = self._decode(inlet, raw) or self._sample
            return self._sample

    def wait(self, after: Sample[V] | None, timeout: float) -> Sample[V]:
        """Return the newest sample once there is one newer than `after`.

        Raises ConnectionLostException, or its like, when the servant is lost meanwhile or is absent at the
        end; TimeoutException when it is present but sends nothing; AccessDeniedException when it said
        meanwhile that it sees no listener; MarshalException as `latest` does.
        """
        started = time.monotonic()
        inquiry = _Inquiry(self, started, timeout)

        def ended() -> bool:
            sample = self.latest()
            return (sample is not None and sample.follows(after)) or self.lost_since(started)

        with self._lock:
            self._waiting += 1
        try:
            with self._lock:
                inlet = self.inlet or self.streams.listen(self, queue=1)
                if not inlet.wait(self._changed, ended, inquiry.delay) and inquiry.begin():
                    inlet.wait(self._changed, ended, max(0.0, started + timeout - time.monotonic()))
                sample = self._sample
                if sample is not None and sample.follows(after):
                    return sample
            raise self.explain_silence(timeout, inquiry)
        finally:
            with self._lock:
                self._waiting -= 1
                self._checks = 0

    @property
    def has_none(self) -> bool:
        """Return whether no sample has arrived since it began to listen."""
        return self._sample is None

    def lost_since(self, moment: float) -> bool:
        """Return whether the servant was lost after a moment of the monotonic clock, and is offline."""
        presence = self.streams.presence
        return presence.lost_since(self.target, moment) and presence.is_lost(self.target)

    def explain_silence(self, timeout: float, inquiry: _Inquiry) -> exceptions.SystemException:
        """Return why no sample arrived within `timeout` s, at once."""
        streams, target = self.streams, self.target
        if streams.closed.is_set():
            return exceptions.CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")
        if not streams.presence.interfaces(target):
            return streams.presence.explain_absence(target, _EXPLAINING)
        if inquiry.is_unseen():
            return exceptions.AccessDeniedException(
                f"{self.what}: {target} exists but sees no listener: access control does not "
                "let this component read it; `security` in the settings of the router says who may"
            )
        return exceptions.TimeoutException(sentence(f"no new sample of {self.what} within {timeout:g} s"))

    def close_if_unwanted(self) -> None:
        """Stop listening if nobody waits for it, and nobody has used it for `linger` s."""
        with self._lock:
            self._checks += 1
            if self._waiting == 0 and self._checks > CHECKS:
                self._stop_listening()

    def forget(self) -> None:
        """Forget the newest sample, as if listening began now."""
        with self._lock:
            self._sample = self._last = None

    def close(self) -> None:
        """Stop listening; wake up the waiting threads."""
        with self._lock:
            inlet = self.inlet
            self._stop_listening()
            self._changed.notify_all()
        if inlet is not None:
            inlet.close(self.streams.limits.callback)  # without the lock, which its thread takes

    def wake(self) -> None:
        """Wake up the waiting threads."""
        with self._lock:
            self._changed.notify_all()

    def _stop_listening(self) -> None:  # with the lock
        inlet, self.inlet = self.inlet, None
        self.forget()
        self.streams.listening.discard(self)
        if inlet is not None:
            inlet.close()


class Subscription(_Listener[V]):
    """A callback on a stream; `close`, or leaving its `with` block, ends it.

    It has its own queue and thread: a slow callback delays nobody else. One that raises is called again; what
    it raises is logged, but not again while each sample makes it raise the same.
    """

    def __init__(
        self,
        reader: StreamReader[V],
        callback: Callable[[Sample[V]], Any],
        rate: float | None = None,
        queue: int = 1,
    ) -> None:
        """Subscribe.

        Raises ConfigurationException for options that make no sense, BusyException where there is no thread
        for it.
        """
        _check(rate, queue)
        super().__init__(reader.streams, reader.target, reader.operation, encoded=reader.encoded)
        self.received = 0
        """Number of samples that the callback got."""
        self._callback: Final = callback
        self._readable = True
        self._failing: type[BaseException] | None = None
        """What the callback raised at the last sample."""
        self._closed = False
        inlet = self.streams.listen(self, queue)
        try:
            inlet.deliver(partial(self._deliver, inlet), rate)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Stop calling; wait for a running call, for at most 2 s, unless called from within it."""
        self._closed = True
        self.streams.listening.discard(self)
        if self.inlet is not None and not self.inlet.close(self.streams.limits.callback):
            _logger.error("the callback on %s still runs", self.what)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _deliver(self, inlet: Inlet, raw: object) -> None:
        """Call the callback with a sample."""
        if self._closed:
            return
        try:
            sample = self._decode(inlet, raw)
        except (exceptions.MarshalException, exceptions.InterfaceMismatchException) as error:
            if self._readable:
                _logger.error("%s; continuing with the next valid sample", error)
            self._readable = False
            return
        if sample is None:
            return
        self._readable = True
        self.received += 1
        failing, self._failing = self._failing, None
        try:
            self._callback(sample)
        except BaseException as error:
            self._failing = type(error)
            if self._failing is not failing:  # a stream may have a hundred samples a second
                _logger.exception("the callback on %s failed; it is called again", self.what)
                notify_of_failure(error)


class Samples(Generic[V]):
    """An iterator over the samples of a stream, always the newest, for `for` and `async for`.

    Waits for each sample for at most `timeout` s; raises as `StreamReader.wait` does.
    """

    def __init__(self, reader: StreamReader[V], timeout: float, rate: float | None) -> None:
        _check(rate)
        self._reader: Final = reader
        self._timeout: Final = timeout
        self._rate: Final = rate
        self._clock: Final = reader.streams.clock
        self._pacer: Final = Pacer(rate, self._clock)
        self._sample: Sample[V] | None = None

    def __iter__(self) -> Iterator[Sample[V]]:
        return self

    def __next__(self) -> Sample[V]:
        if delay := self._pacer.delay():
            self._clock.wait(self._reader.streams.closed, delay)
        self._sample = self._reader.wait(self._sample, self._timeout)
        self._pacer.count()
        return self._sample

    async def __aiter__(self) -> AsyncIterator[Sample[V]]:
        import asyncio

        loop = asyncio.get_running_loop()
        pacer = Pacer(self._rate)  # by the clock of the loop, which sleeps
        arrival = asyncio.Event()
        arrived: list[Sample[V]] = []  # the newest, or none

        def keep(sample: Sample[V]) -> None:
            if arrived:
                sample.lost += arrived.pop().lost + 1
            arrived.append(sample)
            arrival.set()

        def notify(sample: Sample[V]) -> None:
            with suppress(RuntimeError):  # the loop was closed, and nobody waits any more
                loop.call_soon_threadsafe(keep, sample)

        with Subscription(self._reader, notify):
            while True:
                await asyncio.sleep(pacer.delay())
                started = time.monotonic()
                inquiry = _Inquiry(self._reader, started, self._timeout)
                while not arrived:
                    left = started + self._timeout - time.monotonic()
                    if self._timeout - left >= inquiry.delay:
                        inquiry.begin()
                    if left <= 0 or self._reader.streams.closed.is_set() or self._reader.lost_since(started):
                        # On another thread: it may look for the reason.
                        explain = self._reader.explain_silence
                        raise await asyncio.to_thread(explain, self._timeout, inquiry)
                    with suppress(TimeoutError):
                        await asyncio.wait_for(arrival.wait(), min(left, _CHECK_PERIOD))
                    arrival.clear()
                pacer.count()
                yield arrived.pop()


def _check(rate: float | None, queue: int = 1) -> None:
    """Raise ConfigurationException for a rate or a queue that makes no sense."""
    if rate is not None and not _LOWEST_RATE <= rate < math.inf:
        raise exceptions.ConfigurationException(
            f"a rate is a finite number of samples a second, {_LOWEST_RATE:g} or more, not {rate!r}"
        )
    if not isinstance(queue, int) or not 1 <= queue <= _LONGEST_QUEUE:
        raise exceptions.ConfigurationException(
            f"queue is from 1 to {_LONGEST_QUEUE} samples, a whole number, not {queue!r}"
        )
