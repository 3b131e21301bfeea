"""The far end's way to the near one: it asks, and serves what is asked meanwhile."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Final, TypeVar

import msgspec

from zenoh_ice import exceptions, typed
from zenoh_ice.clock import VirtualClock
from zenoh_ice.exceptions import SystemException, UnknownException

from ..errors import EventError
from .protocol import Answered, AskHolds, Begin, Deliver, Failed, ListVariables, Pipe, RunCode, Sleep, ToFar

_POLL_PERIOD: Final = 0.01
"""Seconds between two looks at an event that code waits for."""

M = TypeVar("M")


class Link:
    """Ask the near end, in the thread that made this object.

    `serve` answers its requests, also those that come while an answer is awaited.
    """

    def __init__(self, pipe: Pipe) -> None:
        self.clock: Final = FarClock(self)
        self.serve: Callable[[Any], object] = _nobody
        self._pipe: Final = pipe
        self._thread: Final = threading.get_ident()
        self._encoder: Final = msgspec.msgpack.Encoder()
        self._decode: Final = typed.msgpack_decoder(ToFar)

    def run(self) -> None:
        """Serve until the near end closes the pipe, which raises PipeError."""
        while True:
            self._answer(self._receive())

    def ask(self, request: object, answer: type[M]) -> M:
        """Return the answer to a request. Raises SystemException, EventError, and PipeError."""
        if threading.get_ident() != self._thread:
            raise RuntimeError("other threads than that of the automata cannot use the robot and its time")
        self._pipe.send(self._encoder.encode(request))
        while True:
            message = self._receive()
            if isinstance(message, answer):
                return message
            if isinstance(message, Failed):
                raise _failure(message)
            self._answer(message)

    def _receive(self) -> Any:  # noqa: ANN401 - a message
        message = self._decode(self._pipe.receive())
        self.clock.follow(message.now)
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
        self._link.ask(Sleep(float(seconds)), Answered)

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Let time pass until an event is set, at most `timeout` s; return whether it is set."""
        end = self.now() + timeout
        while not event.is_set() and self.now() < end:
            self.advance(min(_POLL_PERIOD, end - self.now()))
        return event.is_set()


def _failure(message: Failed) -> Exception:
    if message.error == EventError.__name__:
        return EventError(message.text)
    known = getattr(exceptions, message.error, None)
    if isinstance(known, type) and issubclass(known, SystemException):
        return known(message.text)
    return UnknownException(message.text)


def _nobody(message: object) -> object:
    raise NotImplementedError(type(message).__name__)
