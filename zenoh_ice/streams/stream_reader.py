"""What a stream brings to a client: the newest sample, kept for whoever asks or waits for it."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

import zenoh

from ..exceptions import (
    AccessDeniedException,
    CommunicatorDestroyedException,
    ConnectionLostException,
    TimeoutException,
)
from ..identity import Target
from ..operation import Operation
from .refusal import is_refused
from .sample import Gaps, Sample
from .stream_source import StreamSource

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["LINGER", "Sample", "StreamReader"]

V = TypeVar("V")

LINGER = 10.0
"""Seconds after which a stream that nobody asks for is no longer listened to."""

_JOIN_LIMIT: Final = 2.0
_WORTH_ASKING: Final = 0.1  # s of silence after which the servant is asked whether it hears of a listener


_logger = logging.getLogger(__name__)


class StreamReader(Generic[V]):
    """Keep the newest sample of one stream, and listen to it only while somebody wants it.

    Asking for a sample makes it listen. When nobody has asked for `LINGER` s it stops, so that the servant
    need not publish any longer, and forgets the sample, which would be stale when somebody asks again.

    Until somebody waits, samples stay in Zenoh's ring of one, undecoded, and cost this process nothing. The
    first wait starts a thread that takes them out and wakes whoever waits.
    """

    def __init__(
        self,
        communicator: Communicator,
        target: Target,
        operation: Operation[..., V],
        listening: set[StreamReader[Any]],
    ) -> None:
        """Make a reader, which is in a set of its makers' as long as it listens."""
        self.source: Final = StreamSource(communicator, target, operation)
        self.what: Final = self.source.what
        self._communicator: Final = communicator
        self._target: Final = target
        self._changed = threading.Condition()
        self._subscriber: zenoh.Subscriber[zenoh.Handler[zenoh.Sample]] | None = None
        self._try_receive: Callable[[], zenoh.Sample | None] = self._take_pending
        self._pending: zenoh.Sample | None = None
        self._sample: Sample[V] | None = None
        self._gaps = Gaps()
        self._pump: threading.Thread | None = None
        self._waiting = 0  # threads
        self._watchers: set[Callable[[], object]] = set()
        self._asked = False  # since `let_go_if_unwanted` last looked
        self._asked_at = -math.inf
        self._end: Final = threading.Event()
        self._listening: Final = listening
        communicator.presence.watch(target.realm)

    def latest(self) -> Sample[V] | None:
        """Return the newest sample, or None before the first.

        Raises MarshalException, once, for a sample that does not fit the operation, and
        InterfaceMismatchException for one of a servant with another version of the interface.
        """
        with self._changed:
            self._asked = True
            if self._subscriber is None:
                self._listen()
            return self._newest()

    def wait(self, after: Sample[V] | None, timeout: float) -> Sample[V]:
        """Return the newest sample as soon as there is one newer than `after`.

        Raises ConnectionLostException, or its like, when the servant goes away meanwhile or is absent at the
        end; TimeoutException when it is there and sends nothing; AccessDeniedException when it hears of no
        listener; MarshalException as `latest` does.
        """
        started = time.monotonic()
        deadline = started + timeout
        with self._changed:
            self._asked = True
            self._start_pump()
            self._waiting += 1
        try:
            with self._changed:
                while True:
                    sample = self._newest()
                    if sample is not None and sample.follows(after):
                        return sample
                    left = deadline - time.monotonic()
                    if left <= 0 or self.lost_since(started):
                        break
                    self._changed.wait(left)
            raise self.explain_silence(timeout)
        finally:
            with self._changed:
                self._waiting -= 1

    @property
    def closed(self) -> bool:
        """Whether no sample will come any more, as the communicator was destroyed."""
        return self._end.is_set() or self._communicator.destroyed

    def lost_since(self, moment: float) -> bool:
        """Return whether the servant went away after a moment of the monotonic clock, and is away."""
        presence = self._communicator.presence
        return presence.lost_since(self._target, moment) and not presence.interfaces(self._target)

    def explain_silence(self, timeout: float) -> Exception:
        """Return why no sample came within `timeout` s."""
        presence = self._communicator.presence
        if self._communicator.destroyed:
            return CommunicatorDestroyedException(f"{self.what}: the communicator was destroyed")
        if presence.interfaces(self._target):
            if timeout >= _WORTH_ASKING and self._sample is None and self._is_refused():
                return AccessDeniedException(
                    f"{self.what}: {self._target} is there and hears of no listener: access control does not "
                    "let this component read it; `security` in the settings of the router says who may"
                )
            return TimeoutException(f"no new sample of {self.what} within {timeout:g} s")
        return presence.explain_absence(self._target)

    def _is_refused(self) -> bool:
        return is_refused(self._communicator, self._target, self.source.name)

    def rest(self, seconds: float) -> None:
        """Wait for some time, or until no sample will come any more."""
        self._end.wait(seconds)

    def add_watcher(self, watcher: Callable[[], object]) -> None:
        """Call a function of ours, which does not wait, whenever servants come or go or this closes."""
        with self._changed:
            self._watchers.add(watcher)

    def remove_watcher(self, watcher: Callable[[], object]) -> None:
        """Call a function no longer."""
        with self._changed:
            self._watchers.discard(watcher)

    def let_go_if_unwanted(self) -> None:
        """Stop listening if nobody waits or has asked for a while."""
        with self._changed:
            now = time.monotonic()
            if self._asked:
                self._asked, self._asked_at = False, now
            elif self._waiting == 0 and now - self._asked_at >= LINGER:
                self._stop_listening()

    def close(self) -> None:
        """Stop listening for ever; whoever waits is told."""
        with self._changed:
            self._end.set()
            self._changed.notify_all()
            pump = self._pump
            self._stop_listening()
        if pump is not None and pump is not threading.current_thread():
            pump.join(_JOIN_LIMIT)

    def wake(self) -> None:
        """Let those who wait look again."""
        with self._changed:
            self._changed.notify_all()
            watchers = list(self._watchers)
        for watcher in watchers:
            watcher()

    # Whoever calls these holds the lock.

    def _newest(self) -> Sample[V] | None:
        if self._communicator.destroyed:
            self._check_open()
        raw = self._try_receive()
        if raw is not None:
            samples = self.source.samples
            about = samples.about(raw)
            try:
                data = samples.read(raw)
            except ConnectionLostException as error:  # the next counts it among those that were lost
                _logger.debug("%s", error)
            else:
                self._sample = samples.decode(data, about, self._gaps.before(about))
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
        self._subscriber = self.source.listen()
        self._listening.add(self)
        # Kept apart: the subscriber can be undeclared while a thread waits in the handler.
        self._try_receive = self._subscriber.handler.try_recv
        return self._subscriber

    def _stop_listening(self) -> None:
        subscriber, self._subscriber = self._subscriber, None
        self._try_receive = self._take_pending
        self._pump = self._pending = self._sample = None
        self._gaps = Gaps()
        self._listening.discard(self)
        if subscriber is not None:
            subscriber.undeclare()  # ends the pump: its channel is closed

    def _check_open(self) -> None:
        if self.closed:
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
            del raw  # it may be large, and the next may be long in coming
