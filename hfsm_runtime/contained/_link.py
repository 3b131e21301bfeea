"""The far end's way to the near one: it serves requests, each as code that may ask for something itself."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any, Final, TypeVar

import msgspec

from zenoh_ice import exceptions, typed
from zenoh_ice.clock import VirtualClock
from zenoh_ice.exceptions import SystemException, UnknownException

from .._code import Code, current_code
from ..errors import EventError
from .protocol import (
    ENDS,
    NUMBER,
    Answered,
    AskHolds,
    Begin,
    Deliver,
    Failed,
    ListVariables,
    Pipe,
    RunCode,
    Sleep,
    ToFar,
)

_POLL_PERIOD: Final = 0.01
"""Seconds between two looks at an event that code waits for."""

M = TypeVar("M")


class Link:
    """Ask the near end, in the thread that made this object.

    `serve` answers its requests, each as a `Code`, which waits where it asks for something.
    """

    def __init__(self, pipe: Pipe) -> None:
        self.clock: Final = FarClock(self)
        self.serve: Callable[[Any], object] = _nobody
        self._pipe: Final = pipe
        self._thread: Final = threading.get_ident()
        self._waiting: Final[dict[int, Code]] = {}
        self._encoder: Final = msgspec.msgpack.Encoder()
        self._decode: Final = typed.msgpack_decoder(ToFar)

    def run(self) -> None:
        """Serve until the near end closes the pipe, which raises PipeError."""
        while True:
            data = self._pipe.receive()
            (number,) = NUMBER.unpack_from(data)
            message: Any = self._decode(data[NUMBER.size :])
            self.clock.follow(message.now)
            code = self._waiting.pop(number, None)
            if code is None:
                code = Code(f"piece {number}", partial(self._answer, message))
                message = None
            code.go(message)
            if not code.ended:
                self._waiting[number] = code

    def ask(self, request: object, answer: type[M]) -> M:
        """Return the answer to a request. Raises SystemException, EventError, and what ends a cycle."""
        code = current_code() if threading.get_ident() == self._thread else None
        if code is None:
            raise RuntimeError("other threads than that of the automata cannot use the robot and its time")
        self._pipe.send(self._encoder.encode(request))
        message = code.wait()
        if isinstance(message, Failed):
            raise _failure(message)
        assert isinstance(message, answer)
        return message

    def _answer(self, message: object) -> None:
        assert isinstance(message, Begin | RunCode | Deliver | AskHolds | ListVariables)
        self._pipe.send(self._encoder.encode(self.serve(message)))


class FarClock(VirtualClock):
    """The clock of the near end: it says what time it is with each message."""

    def __init__(self, link: Link) -> None:
        super().__init__()
        self._link: Final = link

    def follow(self, now: int) -> None:
        """Move to a time in ns."""
        if now > self._now:
            self._move_to(now)

    def advance(self, seconds: float) -> None:
        """Let a duration in s pass."""
        if seconds < 0:
            raise ValueError(f"a clock does not run backwards: advance({seconds})")
        self._link.ask(Sleep(float(seconds), ends=False), Answered)

    def sleep_in_cycle(self, seconds: float) -> None:
        """Let a duration in s pass; raises what ends the cycle when it has to end."""
        self._link.ask(Sleep(max(0.0, float(seconds))), Answered)

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Let time pass until an event is set, at most `timeout` s; return whether it is set."""
        end = self.now() + timeout
        while not event.is_set() and self.now() < end:
            self.advance(min(_POLL_PERIOD, end - self.now()))
        return event.is_set()


def _failure(message: Failed) -> BaseException:
    if message.error in ENDS:
        return ENDS[message.error](message.text)
    if message.error == EventError.__name__:
        return EventError(message.text)
    known = getattr(exceptions, message.error, None)
    if isinstance(known, type) and issubclass(known, SystemException):
        return known(message.text)
    return UnknownException(message.text)


def _nobody(message: object) -> object:
    raise NotImplementedError(type(message).__name__)
