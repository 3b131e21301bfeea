"""The far end's way to the near one: it serves requests, each as code that may ask for something itself.

Each call and each stream of the component goes through it, too.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from functools import partial
from typing import Any, Final

import msgspec

from hfsm_runtime.coroutine import Coroutine, current_coroutine
from hfsm_runtime.errors import EventError
from hfsm_runtime.plugins import ObservedTransport
from visualhfsm_classes.contained import _protocol as protocol
from zenoh_ice import Settings
from zenoh_ice.data import exceptions, typed
from zenoh_ice.data.codec import Parted
from zenoh_ice.data.exceptions import SystemException, UnknownException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.data.wire import decode_attachment
from zenoh_ice.objects.streams import CHECKS
from zenoh_ice.threads.clock import VirtualClock
from zenoh_ice.threads.limits import LIMITS
from zenoh_ice.transport import Arrived, Caller, Inlet, Outcome, outcome_of

_POLL_PERIOD: Final = 0.01
"""Seconds between two looks at an event that code waits for."""

_OUTCOME: Final = tuple[bool, bytes | Parted]


class Link:
    """Ask the near end, in the thread that made this object.

    `serve` answers its requests, each as a `Coroutine`, which waits where it asks for something.
    """

    def __init__(self, pipe: protocol.Pipe) -> None:
        self.clock: Final = FarClock(self)
        self.serve: Callable[[Any], object] = _nobody
        self._pipe: Final = pipe
        self._thread: Final = threading.get_ident()
        self._waiting: Final[dict[int, Coroutine]] = {}
        self._encoder: Final = msgspec.msgpack.Encoder()
        self._decode: Final = typed.msgpack_decoder(protocol.ToFar)

    def run(self) -> None:
        """Serve until the near end closes the pipe, which raises PipeError."""
        while True:
            data = self._pipe.receive()
            (number,) = protocol.NUMBER.unpack_from(data)
            message: Any = self._decode(data[protocol.NUMBER.size :])
            self.clock.follow(message.now)
            code = self._waiting.pop(number, None)
            if code is None:
                code = Coroutine(f"piece {number}", partial(self._answer, message))
                message = None
            code.go(message)
            if not code.ended:
                self._waiting[number] = code

    def ask(self, request: object, answer: Any = None) -> Any:  # noqa: ANN401 - a value of that type
        """Return the answer to a request. Raises SystemException, EventError, and what ends a cycle."""
        code = current_coroutine() if threading.get_ident() == self._thread else None
        if code is None:
            raise RuntimeError("other threads than that of the automata cannot use the robot and its time")
        self._pipe.send(self._encoder.encode(request))
        message = code.wait()
        if isinstance(message, protocol.Failed):
            raise _failure(message)
        assert isinstance(message, protocol.Answered)
        return None if answer is None else typed.convert(message.value, answer)

    def _answer(self, message: object) -> None:
        assert isinstance(message, protocol.Task)
        self._pipe.send(self._encoder.encode(self.serve(message)))


class FarClock(VirtualClock):
    """The clock of the near end: it says what time it is with each message."""

    def __init__(self, link: Link) -> None:
        super().__init__()
        self._link: Final = link

    def follow(self, now: int) -> None:
        """Move to a time in ns."""
        if now > self.moment:
            self.move_to(now)

    def advance(self, seconds: float) -> None:
        """Let a duration in s pass."""
        if seconds < 0:
            raise ValueError(f"a clock does not run backwards: advance({seconds})")
        self._link.ask(protocol.Sleep(float(seconds), ends=False))

    def sleep_in_cycle(self, seconds: float) -> None:
        """Let a duration in s pass; raises what ends the cycle when it has to end."""
        self._link.ask(protocol.Sleep(max(0.0, float(seconds))))

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Let time pass until an event is set, at most `timeout` s; return whether it is set."""
        end = self.now() + timeout
        while not event.is_set() and self.now() < end:
            self.advance(min(_POLL_PERIOD, end - self.now()))
        return event.is_set()


def _failure(message: protocol.Failed) -> BaseException:
    if message.error in protocol.ENDS:
        return protocol.ENDS[message.error](message.text)
    if message.error == EventError.__name__:
        return EventError(message.text)
    known = getattr(exceptions, message.error, None)
    if isinstance(known, type) and issubclass(known, SystemException):
        return known(message.text)
    return UnknownException(message.text)


def _nobody(message: object) -> object:
    raise NotImplementedError(type(message).__name__)


class FarTransport(ObservedTransport):
    """Carry calls and samples through a link; the near end finds the servants."""

    def __init__(self, link: Link) -> None:
        self.clock = link.clock
        super().__init__(Settings(clock="sim"), link.clock)
        self._link: Final = link
        self._numbers: Final = itertools.count(1)
        self.inlets: Final[dict[int, FarInlet]] = {}
        link.clock.call_every(LIMITS.linger / CHECKS, self.communicator.streams.close_unwanted)

    def call_through(self, target: Target, operation: Operation[..., Any], timeout: float) -> Caller:
        return _FarCaller(self._link, target, operation.name, timeout)

    def subscribe(self, target: Target, operation: Operation[..., Any], queue: int = 1) -> Inlet:
        number = next(self._numbers)
        self._link.ask(protocol.Subscribe(number, *target, operation.name, queue))
        inlet = self.inlets[number] = FarInlet(self._link, number, partial(self.inlets.pop, number, None))
        return inlet

    def find(self, target: Target, type_id: str, timeout: float) -> Mapping[str, str]:  # noqa: ARG002
        found: dict[str, str] = self._link.ask(protocol.Find(*target, type_id), dict[str, str])
        return found

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
        outcome: Outcome = self._link.ask(request, _OUTCOME)
        return outcome

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

    def poll(self) -> protocol.Sample | None:
        sample: protocol.Sample | None = self._link.ask(protocol.Poll(self._number), protocol.Sample | None)
        return sample

    def wait(self, changed: threading.Condition, holds: Callable[[], bool], timeout: float) -> bool:  # noqa: ARG002
        self._holds = holds
        return bool(self._link.ask(protocol.Wait(self._number, max(0.0, timeout)), bool))

    def deliver(self, callback: Callable[[Any], object], rate: float | None = None) -> None:
        self._callback = callback
        self._link.ask(protocol.Push(self._number, rate))

    def open(self, sample: protocol.Sample) -> Arrived:
        sent_at, now = decode_attachment(sample.attachment).wall_time, self._link.clock.now
        return Arrived(sample.payload, sample.attachment, lambda: now() - sent_at)

    def close(self, timeout: float = 0.0) -> bool:  # noqa: ARG002
        if self._forget() is not None:
            self._link.ask(protocol.Unsubscribe(self._number))
        return True

    def holds(self) -> bool:
        """Return whether what is waited for has happened."""
        return bool(self._holds())

    def push(self, sample: protocol.Sample) -> None:
        """Call the function of a subscription."""
        self._callback(sample)
