"""What a stream brings to a client: the newest sample, kept for whoever asks or waits for it."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from time import monotonic as _monotonic
from time import time as _wall_time
from typing import TYPE_CHECKING, Final, Generic, TypeVar, cast

import zenoh
from zenoh.handlers import RingChannel

from .attachment import NO_ATTACHMENT, decode_attachment
from .exceptions import (
    CommunicatorDestroyedException,
    MarshalException,
    TimeoutException,
)
from .identity import Target
from .operation import Operation
from .shared_memory import read_payload

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["LINGER", "Sample", "StreamReader"]

V = TypeVar("V")

LINGER = 10.0
"""Seconds after which a stream without a subscription that nobody asks for is no longer listened to."""

_JOIN_LIMIT: Final = 2.0


class Sample(Generic[V]):
    """A value that a stream brought."""

    __slots__ = ("_read_at", "_transit", "sequence", "time", "value", "wall_time")

    def __init__(self, value: V, sequence: int, time: float, wall_time: float) -> None:
        self.value: Final = value
        self.sequence: Final = sequence
        """Number of the sample in its stream: a gap shows samples that were skipped."""
        self.time: Final = time
        """Robot time of the value in s, nan when the servant gives none."""
        self.wall_time: Final = wall_time
        """Wall time of the servant's machine at which it was sent, in s since the epoch."""
        # From here on by the steady clock: when the date is set back, old samples must not look fresh.
        self._transit: Final = max(0.0, _wall_time() - wall_time)
        self._read_at: Final = _monotonic()

    @property
    def age(self) -> float:
        """Wall seconds since it was sent; between machines as exact as their clocks agree."""
        return self._transit + _monotonic() - self._read_at

    def __repr__(self) -> str:
        from rich.pretty import pretty_repr  # here: most programs never ask

        # An image of some megabytes must not be formatted to show its beginning.
        value = pretty_repr(self.value, max_width=1 << 16, max_length=8, max_string=40, max_depth=4)
        return f"<sample {self.sequence} at {self.time:.3f} s: {value:.200}>"


class StreamReader(Generic[V]):
    """Keep the newest sample of one stream, and listen to it only while somebody wants it.

    Asking for a sample makes it listen, and so does a subscription. When the last subscription has ended and
    nobody has asked for `LINGER` s it stops, so that the servant need not publish any longer, and forgets the
    sample, which would be stale when somebody asks again.

    Until somebody waits, samples stay in Zenoh's ring of one, undecoded, and cost this process nothing. The
    first wait starts a thread that takes them out and wakes whoever waits.
    """

    def __init__(self, communicator: Communicator, target: Target, operation: Operation[..., V]) -> None:
        self.what: Final = f"{target.identity}.{operation.name}"
        self._communicator: Final = communicator
        self._target: Final = target
        self._operation: Final = operation
        self._limit: Final = communicator.size_limit(operation.result)
        self._key: Final = target.prefix + operation.name
        self._changed = threading.Condition()
        self._subscriber: zenoh.Subscriber[zenoh.Handler[zenoh.Sample]] | None = None
        self._try_receive: Callable[[], zenoh.Sample | None] = self._take_pending
        self._pending: zenoh.Sample | None = None
        self._sample: Sample[V] | None = None
        self._pump: threading.Thread | None = None
        self._users = 0  # subscriptions, and threads that wait
        self._asked = False  # since `let_go_if_unwanted` last looked
        self._asked_at = -math.inf
        self._closed = False
        communicator.presence.watch(target.realm)
        communicator.presence.add_listener(self.wake)

    def latest(self) -> Sample[V] | None:
        """Return the newest sample, or None before the first.

        Raises MarshalException, once, for a sample that does not fit the operation.
        """
        with self._changed:
            self._asked = True
            if self._subscriber is None:
                self._listen()
            return self._newest()

    def wait(self, after: Sample[V] | None, timeout: float) -> Sample[V]:
        """Return the newest sample as soon as there is one other than `after`.

        Raises ConnectionLostException, or its like, when the servant goes away meanwhile or is absent at the
        end; TimeoutException when it is there and sends nothing; MarshalException as `latest` does.
        """
        started = time.monotonic()
        deadline = started + timeout
        presence = self._communicator.presence
        with self._changed:
            self._asked = True
            self._start_pump()
            self._users += 1
            try:
                while True:
                    sample = self._newest()
                    if sample is not None and sample is not after:
                        return sample
                    left = deadline - time.monotonic()
                    lost = presence.lost_since(self._target, started)
                    if left <= 0 or (lost and not presence.interfaces(self._target)):
                        break
                    self._changed.wait(left)
            finally:
                self._users -= 1
        if presence.interfaces(self._target):
            raise TimeoutException(f"no new sample of {self.what} within {timeout:g} s")
        raise presence.explain_absence(self._target)

    def wait_until_stopped(self, after: Sample[V] | None, stopped: threading.Event) -> Sample[V] | None:
        """Return the newest sample other than `after`, or None once `stopped` is set and `wake` called.

        It waits for an absent servant to come back. Raises MarshalException as `latest` does.
        """
        with self._changed:
            if not stopped.is_set():
                self._start_pump()
            while not stopped.is_set():
                sample = self._newest()
                if sample is not None and sample is not after:
                    return sample
                self._changed.wait()
        return None

    def join(self) -> None:
        """Count one subscription more."""
        with self._changed:
            self._check_open()
            self._users += 1
            if self._subscriber is None:
                self._listen()

    def leave(self) -> None:
        """Count one subscription less, and stop listening when nobody else wants the stream."""
        with self._changed:
            self._users -= 1
        self.let_go_if_unwanted()

    def let_go_if_unwanted(self) -> None:
        """Stop listening if there is no subscription and nobody has asked for a while."""
        with self._changed:
            now = time.monotonic()
            if self._asked:
                self._asked, self._asked_at = False, now
            elif self._users == 0 and now - self._asked_at >= LINGER:
                self._stop_listening()

    def close(self) -> None:
        """Stop listening for ever; whoever waits is told."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
            pump = self._pump
            self._stop_listening()
        if pump is not None and pump is not threading.current_thread():
            pump.join(_JOIN_LIMIT)

    def wake(self) -> None:
        """Let those who wait look again."""
        with self._changed:
            self._changed.notify_all()

    # Whoever calls these holds the lock.

    def _newest(self) -> Sample[V] | None:
        if self._closed or self._communicator.destroyed:
            self._check_open()
        raw = self._try_receive()
        if raw is not None:
            self._sample = self._decode(raw)
        return self._sample

    def _start_pump(self) -> None:
        """Have a thread that tells of samples, from now until the stream is let go."""
        self._check_open()
        subscriber = self._subscriber or self._listen()
        if self._pump is None:
            self._try_receive = self._take_pending
            pump = threading.Thread(
                target=self._run_pump, args=(subscriber.handler,), name=f"stream {self.what}", daemon=True
            )
            pump.start()
            self._pump = pump

    def _listen(self) -> zenoh.Subscriber[zenoh.Handler[zenoh.Sample]]:
        self._check_open()
        self._subscriber = self._communicator.session.declare_subscriber(self._key, RingChannel(1))
        # Kept apart: the subscriber can be undeclared while a thread waits in the handler.
        self._try_receive = self._subscriber.handler.try_recv
        return self._subscriber

    def _stop_listening(self) -> None:
        subscriber, self._subscriber = self._subscriber, None
        self._try_receive = self._take_pending
        self._pump = self._pending = self._sample = None
        if subscriber is not None:
            subscriber.undeclare()  # ends the pump: its channel is closed

    def _decode(self, raw: zenoh.Sample) -> Sample[V]:
        payload = raw.payload
        what = f"sample of {self.what}"
        if len(payload) > self._limit:
            raise MarshalException(f"{what}: {len(payload)} bytes where at most {self._limit} are taken")
        attachment = NO_ATTACHMENT if raw.attachment is None else decode_attachment(raw.attachment.to_bytes())
        data = read_payload(payload, what)
        value = cast("V", self._operation.result.unpack_result(data, what, self._communicator))
        return Sample(value, attachment.sequence, attachment.robot_time, attachment.wall_time)

    def _check_open(self) -> None:
        if self._closed or self._communicator.destroyed:
            raise CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")

    def _take_pending(self) -> zenoh.Sample | None:
        raw, self._pending = self._pending, None
        return raw

    # The thread.

    def _run_pump(self, handler: zenoh.Handler[zenoh.Sample]) -> None:
        while True:
            try:
                raw = handler.recv()
            except zenoh.ZError:  # unsubscribed
                return
            with self._changed:
                if self._pump is not threading.current_thread():  # nobody listened any more when it came
                    return
                self._pending = raw
                self._changed.notify_all()
