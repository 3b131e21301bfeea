"""Streams: publishers at the servant; the newest sample, loops and callbacks at its clients."""

from __future__ import annotations

import itertools
import logging
import math
import secrets
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Generic, NamedTuple, Protocol, Self, TypeVar, cast
from weakref import WeakValueDictionary

from ._presence import Presence
from ._values import Resolve
from ._wire import NO_ATTACHMENT, Attachment, decode_attachment, encode_sample_attachment
from .exceptions import (
    AccessDeniedException,
    CommunicatorDestroyedException,
    ConfigurationException,
    ConnectionLostException,
    InterfaceMismatchException,
    MarshalException,
    SystemException,
    TimeoutException,
)
from .interface import Operation
from .transport import Inlet, Outlet, Pacer, Served, Target, Transport

__all__ = [
    "Channel",
    "Delivery",
    "Publisher",
    "Sample",
    "Samples",
    "StreamReader",
    "Streams",
    "Subscription",
    "Timing",
    "WallTiming",
]

V = TypeVar("V")

LINGER: Final = 10.0
"""Seconds after which a stream that nobody asks for is no longer listened to."""

# s after which who waits looks anyway: Zenoh does not report a listener that comes right after the last one
# left, and a coroutine is not woken when its servant goes.
_LOOK_AGAIN: Final = 0.1
_LOOKS: Final = 4  # for readers that nobody wants, in the time that they linger
_JOIN_LIMIT: Final = 2.0  # s
_WORTH_ASKING: Final = 0.1  # s of silence after which the servant is asked whether it knows of a listener
_LONGEST_QUEUE: Final = 10_000
_LOWEST_RATE: Final = 1e-6  # samples a second: one every eleven days

_logger = logging.getLogger(__name__)


# At the servant.


class Publisher(Generic[V]):
    """Publish the values of a streamed operation to those who listen.

    It may be used from any thread. Samples are dropped rather than queued when the network is slower than
    the servant: a listener wants the newest.
    """

    def __init__(self, operation: Operation[..., V]) -> None:
        self.operation: Final = operation
        self.stream: Final = secrets.token_hex(8)
        """Another after each restart, so that the numbers of samples can begin again."""
        self._numbers = itertools.count(1)
        # A listener that gets a sample at once, in a test without a network, may publish in turn.
        self._turn = threading.RLock()
        self._channels: tuple[Channel, ...] = ()
        self._changed = threading.Condition()
        self._changes = 0

    @property
    def listening(self) -> bool:
        """Return whether anybody listens; takes less than a microsecond."""
        return any(channel.outlet.listening for channel in self._channels)

    def publish(self, value: V, time: float = math.nan) -> None:
        """Send a value to all listeners; does nothing while there is none.

        `time` is the robot time of the value in s. Raises MarshalException for a value that does not fit the
        operation.
        """
        channels = [channel for channel in self._channels if channel.outlet.listening]
        if not channels:
            return
        what = f"sample of {self.operation.name}"
        payload = self.operation.result.gather_result(value, what)
        for channel in channels:
            if len(payload) > channel.limit:
                raise MarshalException(f"{what}: {len(payload)} bytes where at most {channel.limit} are sent")
        with self._turn:  # they travel in the order of their numbers
            number = next(self._numbers)
            for channel in channels:
                attachment = encode_sample_attachment(channel.fingerprint, number, time, self.stream)
                channel.outlet.put(payload, attachment)

    def wait_for_listener(self, timeout: float) -> bool:
        """Wait for at most `timeout` s until somebody listens; return whether that is so."""
        deadline = time.monotonic() + timeout
        while True:
            seen = self._changes
            # Asks the transport: not while we hold the lock that its thread takes in `wake`.
            if self.listening:
                return True
            left = deadline - time.monotonic()
            if left <= 0:
                return False
            with self._changed:
                if self._changes == seen:
                    self._changed.wait(min(left, _LOOK_AGAIN))

    def attach(self, channel: Channel) -> None:
        """Publish on a channel, too."""
        with self._changed:
            self._channels += (channel,)
        self.wake()

    def detach(self, channel: Channel) -> None:
        """Publish on a channel no longer."""
        with self._changed:
            self._channels = tuple(other for other in self._channels if other is not channel)

    def wake(self) -> None:
        """Let those who wait for a listener look again."""
        with self._changed:
            self._changes += 1
            self._changed.notify_all()


class Channel(NamedTuple):
    """A publisher's way out under one identity."""

    outlet: Outlet
    fingerprint: str
    limit: int
    """How many bytes a sample may have."""


# At the client.


class Timing(Protocol):
    """The time by which streams are read: that of the wall, or a virtual one in tests."""

    @property
    def delivers(self) -> bool:
        """Whether samples have to be delivered to one that waits; otherwise it polls."""

    def now(self) -> float:
        """Return a steady time in s."""

    def wall(self) -> float:
        """Return the time in s by which samples are stamped."""

    def wait_for(
        self, inlet: Inlet, changed: threading.Condition, holds: Callable[[], bool], timeout: float
    ) -> bool:
        """Wait until a function returns true, for at most `timeout` s; return whether it did.

        It polls the inlet, and is asked whenever `changed`, which the caller holds, is notified.
        """

    def repeat(self, period: float, job: Callable[[], object]) -> Served:
        """Run a job every `period` s until that is closed."""


class WallTiming:
    """The time of the wall."""

    delivers: bool = True
    now = staticmethod(time.monotonic)
    wall = staticmethod(time.time)

    def wait_for(
        self,
        inlet: Inlet,  # noqa: ARG002 - what it brings is delivered
        changed: threading.Condition,
        holds: Callable[[], bool],
        timeout: float,
    ) -> bool:
        """Wait until a function returns true, for at most `timeout` s; return whether it did."""
        return changed.wait_for(holds, timeout)

    def repeat(self, period: float, job: Callable[[], object]) -> Served:
        """Run a job every `period` s, on a thread that ends when that is closed."""
        end = threading.Event()

        def run() -> None:
            while not end.wait(period):
                job()

        thread = threading.Thread(target=run, name="zenoh_ice streams", daemon=True)
        thread.start()

        def close() -> None:
            end.set()
            if thread is not threading.current_thread():
                thread.join(_JOIN_LIMIT)

        return Served(close)


_WALL: Final = WallTiming()


class Sample(Generic[V]):
    """A value that a stream brought."""

    __slots__ = (
        "_age",
        "_now",
        "_read_at",
        "_transit",
        "lost",
        "sequence",
        "stream",
        "time",
        "value",
        "wall_time",
    )

    def __init__(
        self,
        value: V,
        sequence: int,
        time: float,
        wall_time: float,
        lost: int = 0,
        *,
        stream: str = "",
        timing: Timing = _WALL,
        age: Callable[[], float] | None = None,
    ) -> None:
        self.value: Final = value
        self.sequence: Final = sequence
        """Number of the sample in its stream; begins again when its servant does."""
        self.time: Final = time
        """Robot time of the value in s, nan when the servant gives none."""
        self.wall_time: Final = wall_time
        """Wall time of the servant's machine at which it was sent, in s since the epoch."""
        self.stream: Final = stream
        """Id of its stream, another after each restart of its servant; empty when that is not known."""
        self.lost = lost
        """How many samples there were between the one before and this one that did not come this far.

        Newer ones overtook them, as the reader is slower than the stream, or they were lost on the way.
        """

        self._age: Final = age
        # From here on by the steady clock: when the date is set back, old samples must not look fresh.
        self._now: Final = timing.now
        self._transit: Final = max(0.0, timing.wall() - wall_time)
        self._read_at: Final = timing.now()

    @property
    def age(self) -> float:
        """Wall seconds since it was sent; between machines as exact as their clocks agree."""
        return self._transit + self._now() - self._read_at if self._age is None else self._age()

    def follows(self, other: Sample[V] | None) -> bool:
        """Return whether it is newer than another one, or of another start of the servant."""
        if self is other:
            return False
        same_stream = other is not None and self.stream == other.stream != ""
        return not same_stream or other is None or self.sequence > other.sequence

    def __repr__(self) -> str:
        from rich.pretty import pretty_repr  # here: most programs never ask

        # An image of some megabytes must not be formatted to show its beginning.
        value = pretty_repr(self.value, max_width=1 << 16, max_length=8, max_string=40, max_depth=4)
        return f"<sample {self.sequence} at {self.time:.3f} s: {value:.200}>"


class _Gaps:
    """Find the samples of a stream that did not reach one reader, by their numbers."""

    def __init__(self) -> None:
        self.total = 0
        """How many were missing so far."""
        self._stream: str | None = None
        self._last = 0

    def before(self, about: Attachment) -> int:
        """Return how many are missing between the sample of the last time and this one.

        0 after a restart of the servant: how many it sent before is not known.
        """
        stream, last = self._stream, self._last
        self._stream, self._last = about.stream, about.sequence
        missing = max(0, about.sequence - last - 1) if about.stream == stream else 0
        self.total += missing
        return missing


@dataclass(frozen=True, slots=True)
class Delivery:
    """Which samples of a stream a subscription wants.

    Raises ConfigurationException for what makes no sense.
    """

    rate: float | None = None
    """Samples a second at most; none, as many as there are."""
    queue: int = 1
    """How many samples wait for a callback that is busy: with 1 the newest alone."""

    def __post_init__(self) -> None:
        if self.rate is not None and not _LOWEST_RATE <= self.rate < math.inf:
            raise ConfigurationException(
                f"a rate is a finite number of samples a second, {_LOWEST_RATE:g} or more, not {self.rate!r}"
            )
        if not isinstance(self.queue, int) or not 1 <= self.queue <= _LONGEST_QUEUE:
            raise ConfigurationException(
                f"queue is from 1 to {_LONGEST_QUEUE} samples, a whole number, not {self.queue!r}"
            )


class Streams:
    """The streams that a communicator reads: shared by its proxies, and closed when nobody wants them.

    `resolve` makes proxies of texts; `is_heard` returns whether a servant knows of a listener to one of its
    streams. Readers that nobody asked for a while are closed.
    """

    def __init__(
        self,
        transport: Transport,
        presence: Presence,
        *,
        resolve: Resolve,
        is_heard: Callable[[Target, str], bool],
        timing: Timing,
    ) -> None:
        self.transport: Final = transport
        self.presence: Final = presence
        self.resolve: Final = resolve
        self.is_heard: Final = is_heard
        self.closed = False
        self.listening: Final[set[StreamReader[Any]]] = set()
        self._lock: Final = threading.Lock()
        self._readers: WeakValueDictionary[tuple[Target, Operation[..., Any]], StreamReader[Any]] = (
            WeakValueDictionary()
        )
        self._subscriptions: Final[set[Subscription[Any]]] = set()
        self.timing: Final = timing
        self._looking: Served | None = None
        presence.add_listener(self._wake)

    def reader(self, target: Target, operation: Operation[..., V]) -> StreamReader[V]:
        """Return the reader of a stream; raises CommunicatorDestroyedException after `close`."""
        with self._lock:
            self.check_open(target, operation)
            reader = self._readers.get((target, operation))
            if reader is None:
                reader = self._readers[target, operation] = StreamReader(self, target, operation)
                if self._looking is None:
                    self._looking = self.timing.repeat(LINGER / _LOOKS, self._close_unwanted)
            return reader

    def subscribe(
        self, reader: StreamReader[V], callback: Callable[[Sample[V]], Any], delivery: Delivery
    ) -> Subscription[V]:
        """Return a callback on a stream."""
        with self._lock:
            self.check_open(reader.target, reader.operation)
            subscription = Subscription(reader, callback, delivery, self._subscriptions.discard)
            self._subscriptions.add(subscription)
            return subscription

    def check_open(self, target: Target, operation: Operation[..., Any]) -> None:
        """Raise CommunicatorDestroyedException after `close`."""
        if self.closed:
            what = f"{target.identity}.{operation.name}"
            raise CommunicatorDestroyedException(f"{what}: the communicator was destroyed")

    def close(self) -> None:
        """Close all readers and subscriptions."""
        with self._lock:
            self.closed = True
            readers, subscriptions = list(self._readers.values()), list(self._subscriptions)
        for subscription in subscriptions:
            subscription.close()
        for reader in readers:
            reader.close()
        if self._looking is not None:
            self._looking.close()

    def _wake(self) -> None:
        with self._lock:
            readers = list(self._readers.values())
        for reader in readers:
            reader.wake()

    def _close_unwanted(self) -> None:
        for reader in tuple(self.listening):
            reader.close_if_unwanted()


class StreamReader(Generic[V]):
    """Keep the newest sample of one stream, and listen to it only while somebody wants it.

    Asking for a sample makes it listen. When nobody has asked for `LINGER` s it stops, so that the servant
    need not publish any longer, and forgets the sample, which would be stale when somebody asks again.

    Until somebody waits, samples stay in the transport's queue of one, undecoded, and cost this process
    nothing. The first wait starts a thread that takes them out and wakes those who wait.
    """

    def __init__(self, streams: Streams, target: Target, operation: Operation[..., V]) -> None:
        self.target: Final = target
        self.operation: Final = operation
        self.what: Final = f"{target.identity}.{operation.name}"
        self._streams: Final = streams
        self._presence: Final = streams.presence
        self._accepted = ""  # fingerprint
        self._changed: Final = threading.Condition()
        self._inlet: Inlet | None = None
        self._poll: Callable[[], Any] = self._take_pending
        self._pending: Any = None
        self._sample: Sample[V] | None = None
        self._gaps = _Gaps()
        self._delivers = False
        self._waiting = 0  # threads
        self._asked = False  # since `close_if_unwanted` last looked
        self._asked_at = -math.inf
        self._end: Final = threading.Event()
        streams.presence.watch(target.realm)

    def latest(self) -> Sample[V] | None:
        """Return the newest sample, or None before the first.

        Raises MarshalException, once, for a sample that does not fit the operation, and
        InterfaceMismatchException for one of a servant with another version of the interface.
        """
        with self._changed:
            self._asked = True
            if self._inlet is None:
                self._listen()
            return self._newest()

    def wait(self, after: Sample[V] | None, timeout: float) -> Sample[V]:
        """Return the newest sample as soon as there is one newer than `after`.

        Raises ConnectionLostException, or its like, when the servant goes away meanwhile or is absent at the
        end; TimeoutException when it is there and sends nothing; AccessDeniedException when it hears of no
        listener; MarshalException as `latest` does.
        """
        started = time.monotonic()
        with self._changed:
            self._asked = True
            inlet = self._start_delivery()
            self._waiting += 1
        try:
            with self._changed:
                self._streams.timing.wait_for(
                    inlet, self._changed, lambda: self._has_newer(after) or self.lost_since(started), timeout
                )
                sample = self._sample
                if sample is not None and sample.follows(after):
                    return sample
            raise self.explain_silence(timeout)
        finally:
            with self._changed:
                self._waiting -= 1

    @property
    def closed(self) -> bool:
        """Whether no sample will come any more, as the communicator was destroyed."""
        return self._end.is_set() or self._streams.closed

    def lost_since(self, moment: float) -> bool:
        """Return whether the servant went away after a moment of the monotonic clock, and is away."""
        presence = self._presence
        return presence.lost_since(self.target, moment) and not presence.interfaces(self.target)

    def explain_silence(self, timeout: float) -> SystemException:
        """Return why no sample came within `timeout` s."""
        if self.closed:
            return CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")
        if not self._presence.interfaces(self.target):
            return self._presence.explain_absence(self.target)
        # A stream may be denied without a word; the servant knows whether it has heard of a listener.
        asked = timeout >= _WORTH_ASKING and self._sample is None
        if asked and not self._streams.is_heard(self.target, self.operation.name):
            return AccessDeniedException(
                f"{self.what}: {self.target} is there and knows of no listener: access control does not "
                "let this component read it; `security` in the settings of the router says who may"
            )
        return TimeoutException(f"no new sample of {self.what} within {timeout:g} s")

    def listen(self, queue: int = 1) -> Inlet:
        """Return a listening end of the stream; raises CommunicatorDestroyedException."""
        self._check_open()
        return self._streams.transport.subscribe(self.target, self.operation, queue)

    def decode(self, inlet: Inlet, raw: object, gaps: _Gaps) -> Sample[V]:
        """Return a sample that came.

        Raises ConnectionLostException for one that was lost, MarshalException for one that does not fit the
        operation, InterfaceMismatchException for one of a servant whose interface is another one.
        """
        arrived = inlet.open(raw)
        about = NO_ATTACHMENT if arrived.attachment is None else decode_attachment(arrived.attachment)
        lost = gaps.before(about)
        if about.fingerprint != self._accepted:
            self._check_fingerprint(about.fingerprint)
        what = f"sample of {self.what}"
        value = cast("V", self.operation.result.unpack_result(arrived.payload, what, self._streams.resolve))
        return Sample(
            value,
            about.sequence,
            about.robot_time,
            about.wall_time,
            lost,
            stream=about.stream,
            timing=self._streams.timing,
            age=arrived.age,
        )

    def rest(self, seconds: float) -> None:
        """Wait for some time, or until no sample will come any more."""
        self._end.wait(seconds)

    def close_if_unwanted(self) -> None:
        """Stop listening if nobody waits or has asked for a while."""
        with self._changed:
            now = self._streams.timing.now()
            if self._asked:
                self._asked, self._asked_at = False, now
            elif self._waiting == 0 and now - self._asked_at >= LINGER:
                self._stop_listening()

    def forget(self) -> None:
        """Forget the newest sample, as if listening began now."""
        with self._changed:
            self._pending = self._sample = None
            self._gaps = _Gaps()

    def close(self) -> None:
        """Stop listening for ever; those who wait wake up."""
        with self._changed:
            self._end.set()
            self._changed.notify_all()
            inlet = self._inlet
            self._stop_listening()
        if inlet is not None:
            inlet.close(_JOIN_LIMIT)

    def wake(self) -> None:
        """Let those who wait look again."""
        with self._changed:
            self._changed.notify_all()

    # The callers of these hold the lock.

    def _has_newer(self, after: Sample[V] | None) -> bool:
        sample = self._newest()
        return sample is not None and sample.follows(after)

    def _newest(self) -> Sample[V] | None:
        if self._streams.closed:
            self._check_open()
        raw, inlet = self._poll(), self._inlet
        if raw is not None and inlet is not None:
            try:
                self._sample = self.decode(inlet, raw, self._gaps)
            except ConnectionLostException as error:  # the next counts it among those that were lost
                _logger.debug("%s", error)
        return self._sample

    def _start_delivery(self) -> Inlet:
        """Let samples be taken out as they come, from now until the stream is closed; return their inlet."""
        self._check_open()
        inlet = self._inlet or self._listen()
        if self._streams.timing.delivers and not self._delivers:
            self._delivers = True
            self._poll = self._take_pending
            inlet.deliver(partial(self._on_sample, inlet))
        return inlet

    def _listen(self) -> Inlet:
        self._inlet = inlet = self.listen()
        self._streams.listening.add(self)
        self._poll = inlet.poll
        return inlet

    def _stop_listening(self) -> None:
        inlet, self._inlet = self._inlet, None
        self._poll = self._take_pending
        self._delivers = False
        self.forget()
        self._streams.listening.discard(self)
        if inlet is not None:
            inlet.close()

    def _check_open(self) -> None:
        if self.closed:
            raise CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")

    def _check_fingerprint(self, fingerprint: str) -> None:
        own = self.operation.interface
        if own is not None and own.fingerprint and fingerprint != own.fingerprint:
            # The sample has that of its servant's own interface, which may extend the one that we know.
            found = self._presence.interfaces(self.target).get(own.type_id, own.fingerprint)
            if found != own.fingerprint:
                raise InterfaceMismatchException(
                    f"sample of {self.what}: this component was generated from {own.fingerprint}, the "
                    f"servant's {own.type_id} from {found}; generate both from the same IDL",
                    expected=own.fingerprint,
                    found=found,
                )
        self._accepted = fingerprint

    def _take_pending(self) -> object:
        raw, self._pending = self._pending, None
        return raw

    def _on_sample(self, inlet: Inlet, raw: object) -> None:
        with self._changed:
            if self._inlet is inlet:  # or nobody listened any more when it came
                self._pending = raw
                self._changed.notify_all()


class Subscription(Generic[V]):
    """A callback on a stream; `close` ends it, also as the end of a `with` block.

    It has its own queue and thread: a slow callback holds up nobody else.
    """

    def __init__(
        self,
        reader: StreamReader[V],
        callback: Callable[[Sample[V]], Any],
        delivery: Delivery,
        ended: Callable[[Subscription[Any]], None],
    ) -> None:
        self.received = 0
        """How many samples the callback got."""
        self._reader: Final = reader
        self._callback: Final = callback
        self._ended: Final = ended
        self._gaps: Final = _Gaps()
        self._readable = True
        self._closed: Final = threading.Event()
        self._lock: Final = threading.Lock()
        self._inlet: Final = reader.listen(delivery.queue)
        self._inlet.deliver(self._deliver, delivery.rate)

    @property
    def lost(self) -> int:
        """How many it did not get: see `Sample.lost`. Those that a rate left out count, too."""
        return self._gaps.total

    def close(self) -> None:
        """End the calls; waits for one that runs, for at most 2 s, unless called from within it."""
        with self._lock:
            first = not self._closed.is_set()
            self._closed.set()
        if first:
            self._ended(self)
        if not self._inlet.close(_JOIN_LIMIT):
            _logger.error("the callback on %s still runs", self._reader.what)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _deliver(self, raw: object) -> None:
        """Call the callback with a sample."""
        if self._closed.is_set():
            return
        try:
            sample = self._reader.decode(self._inlet, raw, self._gaps)
        except ConnectionLostException as error:  # the next counts it among those that were lost
            _logger.debug("%s", error)
            return
        except (MarshalException, InterfaceMismatchException) as error:
            if self._readable:
                _logger.error("%s; the next that fits goes on", error)
            self._readable = False
            return
        self._readable = True
        self.received += 1
        try:
            self._callback(sample)
        except BaseException:
            _logger.exception("the callback on %s failed", self._reader.what)


class Samples(Generic[V]):
    """Sample after sample of a stream, always the newest, for `for` and for `async for`.

    Each is waited for for at most `timeout` s; raises as `StreamReader.wait` does.
    """

    def __init__(
        self,
        reader: StreamReader[V],
        timeout: float,
        rate: float | None,
        subscribe: Callable[[Callable[[Sample[V]], Any]], Subscription[V]],
    ) -> None:
        self._reader: Final = reader
        self._timeout: Final = timeout
        self._subscribe: Final = subscribe
        self._pacer: Final = Pacer(Delivery(rate).rate)  # which checks it
        self._sample: Sample[V] | None = None

    def __iter__(self) -> Iterator[Sample[V]]:
        return self

    def __next__(self) -> Sample[V]:
        if delay := self._pacer.delay():
            self._reader.rest(delay)
        self._sample = self._reader.wait(self._sample, self._timeout)
        self._pacer.count()
        return self._sample

    async def __aiter__(self) -> AsyncIterator[Sample[V]]:
        import asyncio

        loop = asyncio.get_running_loop()
        arrival = asyncio.Event()
        arrived: list[Sample[V]] = []  # the newest, or none

        def take(sample: Sample[V]) -> None:
            if arrived:
                sample.lost += arrived.pop().lost + 1
            arrived.append(sample)
            arrival.set()

        def notify(sample: Sample[V]) -> None:
            with suppress(RuntimeError):  # the loop was closed, and nobody looks any more
                loop.call_soon_threadsafe(take, sample)

        with self._subscribe(notify):
            while True:
                await asyncio.sleep(self._pacer.delay())
                started = time.monotonic()
                while not arrived:
                    left = started + self._timeout - time.monotonic()
                    if left <= 0 or self._reader.closed or self._reader.lost_since(started):
                        # On another thread: it may ask others for the reason.
                        raise await asyncio.to_thread(self._reader.explain_silence, self._timeout)
                    with suppress(TimeoutError):
                        await asyncio.wait_for(arrival.wait(), min(left, _LOOK_AGAIN))
                    arrival.clear()
                self._pacer.count()
                yield arrived.pop()
