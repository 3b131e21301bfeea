"""The connection to a neighbor that calls in flight share, and streams of large values."""

from __future__ import annotations

import itertools
import math
import socket
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Final, Protocol

import msgspec

from .._codec import Parted
from .._memory import ArenaView
from .._pool import Job, Pool
from ..exceptions import SystemException
from ..limits import LIMITS, Limits
from ..transport import NoAnswer, Outcome, outcome_of
from .messages import (
    CANCEL,
    LARGEST_INLINE,
    REQUEST,
    RETURN,
    SUBSCRIBE,
    Answer,
    Answers,
    MessageSource,
    Part,
    Sample,
    Subscribed,
    collect,
    decode_to_client,
    encode,
    limit_sending,
    outcome_of_answer,
    send_parts,
)

_SENDING_LIMIT: Final = 1.0  # s that a server may take none of its messages

Done = Callable[[Outcome | SystemException], object]


class NotSent(Exception):
    """A call did not reach its server: another way may carry it."""


class Subscriber(Protocol):
    """What a subscription of a channel calls, on a thread of the pool, where it must not wait."""

    def confirm(self, channel: Channel, number: int, *, ok: bool) -> None:
        """Note whether samples come, at first and whenever that changes."""

    def arrive(self, channel: Channel, sample: Sample) -> None:
        """Take a sample; its memory is to be given back."""


class Channel(MessageSource):
    """A connection for calls in flight, and for streams of large values."""

    def __init__(
        self, pool: Pool, connection: socket.socket, view: ArenaView | None, limits: Limits = LIMITS
    ) -> None:
        super().__init__(connection, decode_to_client)
        self._reading_limit: Final = limits.reading
        self.ended = False
        self._ended_at = math.inf
        self._pool: Final = pool
        self._view: Final = view
        self._numbers: Final = itertools.count(1)
        self._pending: Final[dict[int, _Pending]] = {}
        self._subscribers: Final[dict[int, Subscriber]] = {}
        self._answers: Final[deque[Answer]] = deque()  # that came together
        self._timeout = _SENDING_LIMIT
        limit_sending(connection, self._timeout)
        self._kind: Final = pool.kind()
        pool.attach(self)

    def read(self, sample: Sample, limit: int, what: str) -> bytes | Parted:
        """Return the payload of a sample, and give its memory back; raises as `collect`.

        If the subscription has ended by then, the memory may have been written again.
        """
        try:
            return collect(sample, self._view, limit, what)
        finally:
            self.give_back(sample)

    def begin(self, call: Outgoing, payload: bytes, attachment: bytes, done: Done) -> None:
        """Send a call; `done` gets its outcome, once. Raises NotSent."""
        number = next(self._numbers)
        deadline = time.monotonic() + call.timeout
        self._pending[number] = _Pending(call, deadline, done)
        try:
            self._send_call(number, call, payload, attachment)
        except BlockingIOError:  # no room for it, all the time
            if self._pending.pop(number, None) is not None:
                self._pool.submit(partial(done, NoAnswer(timed_out=True)))
        except OSError as error:
            self.shut()
            if self._pending.pop(number, None) is not None:
                raise NotSent(str(error)) from None

    def subscribe(self, target: str, operation: str, subscriber: Subscriber) -> int:
        """Ask for the samples of a stream, and return the number of the subscription; raises NotSent."""
        number = next(self._numbers)
        self._subscribers[number] = subscriber
        if not self._send((SUBSCRIBE, number, target, operation)):
            self._subscribers.pop(number, None)
            raise NotSent("its connection ended")
        return number

    def carries(self, number: int) -> bool:
        """Whether a subscription has not ended: its samples are lent."""
        return number in self._subscribers and not self.ended

    def cancel(self, number: int) -> None:
        """End a subscription; what it was lent is written again soon."""
        if self._subscribers.pop(number, None) is not None:
            self._send((CANCEL, number))

    def give_back(self, received: Answer | Sample) -> None:
        """Let the memory be used again that was lent for a message."""
        if received.extent is not None:
            self._send((RETURN, received.number, received.extent.start))

    def look(self, now: float) -> None:
        if self._answers:  # who waits for the outcome of one of them may take long
            self._pool.submit(self._finish_all)
        for number, pending in self._pending.copy().items():
            if pending.deadline <= now and self._pending.pop(number, None) is not None:
                self._pool.submit(partial(pending.done, NoAnswer(timed_out=True)))

    def shut(self) -> None:
        """Let it end, on a thread of the pool; its server begins none of its calls any more."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """End it: pending calls end without an answer."""
        if not self.ended:
            self._ended_at = time.monotonic()
            self.ended = True
        self.shut()  # ends a wait to send, too
        self._pool.detach(self)
        with self._receiving, self._sending:
            self._socket.close()
        self._pool.submit(self._fail_pending)

    def _receive(self, message: Answer | Answers | Part | Sample | Subscribed) -> Job | None:
        match message:
            case Answer():
                message.payload = self._parts.complete(message.payload)
                return self._kind, partial(self._finish, message)
            case Answers():
                self._answers.extend(message.answers)
                return self._kind, self._finish_all
            case Part():
                self._parts.add(message.payload)
            case Sample():
                self._arrive(message)
            case Subscribed():
                if (subscriber := self._subscribers.get(message.number)) is not None:
                    subscriber.confirm(self, message.number, ok=message.ok)
        return None

    def _finish_all(self) -> None:
        while True:
            try:
                answer = self._answers.popleft()
            except IndexError:  # the last one may have been another thread's
                return
            self._finish(answer)

    def _finish(self, answer: Answer) -> None:
        pending = self._pending.pop(answer.number, None)
        if pending is None:  # it came too late
            self.give_back(answer)
            return
        call = pending.call
        outcome = outcome_of(partial(outcome_of_answer, answer, self._view, call.limit, call.what))
        self.give_back(answer)
        if answer.extent is not None and time.monotonic() > self._ended_at + self._reading_limit:
            outcome = NoAnswer(timed_out=False, broken=True)
        pending.done(outcome)

    def _fail_pending(self) -> None:
        for number in list(self._pending):
            # One by one: some are called again, which takes long.
            if (pending := self._pending.pop(number, None)) is not None:
                self._pool.submit(partial(pending.done, NoAnswer(timed_out=False, broken=True)))
        for number, subscriber in self._subscribers.copy().items():
            subscriber.confirm(self, number, ok=False)

    def _arrive(self, sample: Sample) -> None:
        subscriber = self._subscribers.get(sample.number)
        if subscriber is None:  # cancelled meanwhile
            self.give_back(sample)
        else:
            subscriber.arrive(self, sample)

    def _send(self, message: tuple[object, ...]) -> bool:
        """Send a message; return false when the connection has ended, or ends because there is no room."""
        try:
            with self._sending:
                self._send_message(encode(message))
        except OSError:
            self.shut()
            return False
        return True

    def _send_message(self, message: bytes) -> None:
        self._socket.send(message, socket.MSG_NOSIGNAL)

    def _send_call(self, number: int, call: Outgoing, payload: bytes, attachment: bytes) -> None:
        """Send a call; raises OSError, of these BlockingIOError when there was no room within its limit."""
        if not self._sending.acquire(timeout=call.timeout):
            raise BlockingIOError
        try:
            if call.timeout != self._timeout:
                limit_sending(self._socket, call.timeout)
                self._timeout = call.timeout
            send_call(self._send_message, number, call, payload, attachment)
        except BlockingIOError:
            if len(payload) > LARGEST_INLINE:  # a part of it may have been sent
                self.shut()
            raise
        finally:
            self._sending.release()


class Outgoing(msgspec.Struct, eq=False):
    """What all calls of one caller have in common."""

    target: str
    operation: str
    timeout: float
    limit: int
    """Bytes that its result may have."""
    what: str


class _Pending(msgspec.Struct, eq=False):
    call: Outgoing
    deadline: float
    done: Done


def send_call(
    send: Callable[[bytes], object], number: int, call: Outgoing, payload: bytes, attachment: bytes
) -> None:
    """Send a call as one message or several."""
    last = send_parts(send, payload)
    send(encode((REQUEST, number, call.target, call.operation, attachment, last)))
