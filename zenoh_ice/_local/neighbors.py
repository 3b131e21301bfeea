"""The neighbors of a process: others of its machine and user, whose servants it calls through their doors."""

from __future__ import annotations

import itertools
import logging
import math
import os
import re
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Final, Protocol
from weakref import WeakSet

import msgspec

from .._codec import DECODE_ERRORS, LARGEST_PAYLOAD, Parted
from .._memory import ArenaView
from .._presence import parse_servant_token
from .._threads import Job, Pool, Source
from ..exceptions import MarshalException, SystemException
from ..transport import NoAnswer, Outcome, Target
from .door import memory_space
from .messages import (
    CANCEL,
    LARGEST_INLINE,
    LARGEST_MESSAGE,
    REQUEST,
    RETURN,
    SUBSCRIBE,
    VERSION,
    Answer,
    Answers,
    Part,
    Parts,
    Sample,
    Subscribed,
    collect,
    decode_hello,
    decode_to_client,
    encode,
    limit_waits,
    owner_of,
    receive_with_file,
    send_parts,
)

_ADDRESS: Final = re.compile(r"([0-9a-f]{16})\.([0-9]{1,10})\.([0-9]{1,10})")
_HELLO_LIMIT: Final = 0.5  # s
_HELLO_SHARE: Final = 0.1  # of a call's limit: after a vain attempt, it is made over the network
_READING_LIMIT: Final = 4.0  # s after the end of a connection in which nobody writes what it lent
_SENDING_LIMIT: Final = 1.0  # s that a server may take none of a channel's messages
_RETRY_PAUSE: Final = (
    5.0  # s after a vain attempt to reach a neighbor, in which it is called over the network
)
_LARGEST_KEPT: Final = 1 << 20  # bytes of the last answer that an idle connection does not give back
_MOST_IDLE: Final = 8  # connections kept for calls that wait
_MOST_NEIGHBORS: Final = 256
_MOST_TOKENS: Final = 64  # of one target

_logger = logging.getLogger(__name__)

Done = Callable[["Outcome | SystemException"], object]


class NotSent(Exception):
    """A call did not reach its server: another way may carry it."""


class Neighbor:
    """Another process of this machine, with the connections to it; thread-safe.

    A call that waits has a connection for itself, so that its thread reads the answer; calls in flight share
    one, the channel, which keeps their order.
    """

    def __init__(self, pool: Pool, address: str, server: str) -> None:
        self.pool: Final = pool
        self._address: Final = address
        self._server: Final = server
        self._lock: Final = threading.Lock()
        self._idle: Final[deque[_Line]] = deque()
        self._lines: Final[set[_Line]] = set()
        self._channel: Channel | None = None
        self._view: ArenaView | None = None
        self._absent_until = -math.inf
        self._closed = False

    @property
    def is_absent(self) -> bool:
        """Whether it could not be reached a moment ago."""
        return time.monotonic() < self._absent_until

    def call(
        self, request: tuple[object, ...], payload: bytes, timeout: float, limit: int, what: str
    ) -> Outcome:
        """Call and wait for the answer; raises NotSent, NoAnswer, or MarshalException for an unreadable one.

        The request is complete but for the payload.
        """
        while True:
            try:
                line = self._idle.pop()
            except IndexError:
                line = self._open_line(timeout)
                fresh = True
            else:
                fresh = False
            try:
                line.send(request, payload, timeout)
            except OSError as error:
                self._drop(line)
                if isinstance(error, BlockingIOError):
                    raise NoAnswer(timed_out=True) from None
                if fresh:
                    raise NotSent(str(error)) from None
                continue  # it ended while it was idle
            break
        try:
            outcome = line.receive(timeout, limit, what, self._view)
        except BaseException:
            self._drop(line)
            raise
        if len(self._idle) < _MOST_IDLE and not self._closed:
            self._idle.append(line)
        else:
            self._drop(line)
        return outcome

    def channel(self, timeout: float = math.inf) -> Channel:
        """Return the connection for calls in flight, of which one has this limit in s; raises NotSent."""
        channel = self._channel
        if channel is None or channel.ended:
            with self._lock:
                channel = self._channel
                if channel is None or channel.ended:
                    channel = self._channel = Channel(self.pool, self._connect(timeout), self._view)
                    if self._closed:
                        channel.close()
        return channel

    def close(self) -> None:
        """End all connections for good: running calls end without an answer."""
        if (channel := self.shut()) is not None:
            channel.close()

    def shut(self) -> Channel | None:
        """End all connections for good, once what has arrived is read; return a channel that then ends."""
        self._closed = True
        self._absent_until = math.inf
        with self._lock:
            lines = list(self._lines)
            channel, self._channel = self._channel, None
        for line in lines:
            line.shut()
        if channel is not None:
            channel.shut()
        while self._idle:
            with suppress(IndexError):
                self._drop(self._idle.pop())
        self._view = None  # it is unmapped once the last sample in it was dropped
        return channel

    def abandon(self) -> None:
        """Close all files in a forked child."""
        for line in self._lines:
            line.close()
        if self._channel is not None:
            self._channel.abandon()

    def _drop(self, line: _Line) -> None:
        with self._lock:
            self._lines.discard(line)
        line.close()

    def _open_line(self, timeout: float) -> _Line:
        line = _Line(self._connect(timeout))
        with self._lock:
            self._lines.add(line)
        if self._closed:
            line.shut()
        return line

    def _connect(self, timeout: float) -> socket.socket:
        """Return a connection for calls with a limit; raises NotSent, and is not tried again for a while."""
        if self.is_absent:
            raise NotSent("not reached before")
        match = _ADDRESS.fullmatch(self._address)
        assert match is not None  # parsed before
        try:
            made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            try:
                made.settimeout(min(_HELLO_LIMIT, _HELLO_SHARE * timeout))
                self._reach(made, f"/proc/{match[2]}/fd/{match[3]}")
            except BaseException:
                made.close()
                raise
        except (OSError, *DECODE_ERRORS) as error:
            self._absent_until = time.monotonic() + _RETRY_PAUSE
            _logger.info("process %s of this machine is called over the network: %s", match[2], error)
            raise NotSent(str(error)) from None
        return made

    def _reach(self, connection: socket.socket, path: str) -> None:
        """Connect, and keep the memory that the neighbor lends, if it is the right one."""
        connection.connect(path)
        if owner_of(connection) != os.geteuid():
            raise PermissionError("its user is another one")
        message, file = receive_with_file(connection)
        view = None if file is None else ArenaView(file)
        hello = decode_hello(message)
        if (hello.version, hello.server) != (VERSION, self._server):
            raise ConnectionRefusedError("it is another process, or of another release")
        self._view = self._view or view
        connection.settimeout(None)


class _Line:
    """A connection for one call at a time."""

    def __init__(self, connection: socket.socket) -> None:
        self._socket: Final = connection
        # Not SO_RCVTIMEO: that begins again after each signal.
        answers = select.poll()
        answers.register(connection, select.POLLIN)
        self._wait: Final = answers.poll
        self._timeout = 0.0

    def send(self, request: tuple[object, ...], payload: bytes, timeout: float) -> None:
        """Send a call; raises OSError if it was not sent, BlockingIOError of these when there was no room."""
        if timeout != self._timeout:
            limit_waits(self._socket, socket.SO_SNDTIMEO, timeout)
            self._timeout = timeout
        if len(payload) > LARGEST_INLINE:
            payload = send_parts(self._send_message, payload)
        self._send_message(encode((*request, payload)))

    def _send_message(self, message: bytes) -> None:
        self._socket.send(message, socket.MSG_NOSIGNAL)

    def receive(self, timeout: float, limit: int, what: str, view: ArenaView | None) -> Outcome:
        """Wait for the answer."""
        parts: Parts | None = None
        deadline = time.monotonic() + self._timeout
        while True:
            if not self._wait(1000.0 * timeout):
                raise NoAnswer(timed_out=True)
            try:
                message = self._socket.recv(LARGEST_MESSAGE)
            except OSError:
                message = b""
            if not message:
                raise NoAnswer(timed_out=False, broken=True)
            try:
                answer = decode_to_client(message)
            except DECODE_ERRORS as error:
                raise MarshalException(f"{what}: {error}") from None
            match answer:
                case Answer(number=0):
                    if parts is not None:
                        answer.payload = parts.complete(answer.payload)
                    outcome = outcome_of_answer(answer, limit, what, view)
                    if answer.extent is not None and sum(answer.extent.sizes) > _LARGEST_KEPT:
                        self._give_back(answer.extent.start)
                    return outcome
                case Part():
                    parts = parts or Parts()
                    parts.add(answer.payload)
                    self._limit_rest(deadline)
                case _:
                    raise MarshalException(f"{what}: an answer to another call")

    def shut(self) -> None:
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self._socket.close()

    def _give_back(self, start: int) -> None:
        with suppress(OSError):  # the next call will notice
            self._send_message(encode((RETURN, 0, start)))

    def _limit_rest(self, deadline: float) -> None:
        """Wait no longer for the next part than for all of the answer."""
        left = deadline - time.monotonic()
        if left <= 0.0:
            raise NoAnswer(timed_out=True)
        limit_waits(self._socket, socket.SO_RCVTIMEO, left)
        self._timeout = 0.0  # the next call sets it again


def outcome_of_answer(answer: Answer, limit: int, what: str, view: ArenaView | None) -> Outcome:
    """Return what an answer says; raises MarshalException for one that is too large."""
    if answer.ok and answer.extent is None and len(answer.payload) <= limit:
        return True, answer.payload
    limit = limit if answer.ok else LARGEST_PAYLOAD
    return answer.ok, collect(answer, view, limit, what)


class Subscriber(Protocol):
    """What a subscription of a channel calls, on a thread of the pool, where it must not wait."""

    def confirm(self, channel: Channel, number: int, *, ok: bool) -> None:
        """Note whether samples come, at first and whenever that changes."""

    def arrive(self, channel: Channel, sample: Sample) -> None:
        """Take a sample; its memory is to be given back."""


class Channel(Source):
    """A connection for calls in flight, and for streams of large values."""

    def __init__(self, pool: Pool, connection: socket.socket, view: ArenaView | None) -> None:
        self.ended = False
        self._ended_at = math.inf
        self._pool: Final = pool
        self._view: Final = view
        self._socket: Final = connection
        self._file: Final = connection.fileno()
        # Both are held while it is closed: nobody uses a file with the same number.
        self._receiving: Final = threading.Lock()
        self._sending: Final = threading.Lock()
        self._numbers: Final = itertools.count(1)
        self._pending: Final[dict[int, _Pending]] = {}
        self._subscribers: Final[dict[int, Subscriber]] = {}
        self._parts: Final = Parts()
        self._answers: Final[deque[Answer]] = deque()  # the rest of a message
        self._timeout = _SENDING_LIMIT
        limit_waits(connection, socket.SO_SNDTIMEO, self._timeout)
        self._kind: Final = pool.kind()
        pool.attach(self)

    def fileno(self) -> int:
        return self._file

    def read(self, received: Answer | Sample, limit: int, what: str) -> bytes | Parted:
        """Return the payload of a message, and give its memory back.

        Raises MarshalException for one of more than `limit` bytes, NoAnswer when the connection ended so long
        ago that the memory may have been written again.
        """
        try:
            payload = collect(received, self._view, limit, what)
        finally:
            self.give_back(received)
        if received.extent is not None and time.monotonic() > self._ended_at + _READING_LIMIT:
            raise NoAnswer(timed_out=False, broken=True)
        return payload

    def begin(self, call: Sent, payload: bytes, attachment: bytes, done: Done) -> None:
        """Send a call; `done` gets its outcome, once. Raises NotSent."""
        number = next(self._numbers)
        deadline = time.monotonic() + call.timeout
        self._pending[number] = _Pending(call, deadline, done)
        call.unanswered.add(number)
        try:
            self._send_call(number, call, payload, attachment)
        except BlockingIOError:  # no room for it, all the time
            if self._take(number) is not None:
                self._pool.submit(partial(done, NoAnswer(timed_out=True)))
        except OSError as error:
            self.shut()
            if self._take(number) is not None:
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

    @property
    def has_more(self) -> bool:
        return bool(self._answers)

    def take(self) -> Job | None:
        while True:
            while self._answers:
                if (job := self._end(self._answers.popleft())) is not None:
                    return job
            try:
                with self._receiving:
                    message = self._socket.recv(LARGEST_MESSAGE, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return None
            except OSError:
                message = b""
            if not message:
                self.close()
                return None
            try:
                received = decode_to_client(message)
                match received:
                    case Answer():
                        received.payload = self._parts.complete(received.payload)
                        if (job := self._end(received)) is not None:
                            return job
                    case Answers():
                        self._answers.extend(received.answers)
                    case Part():
                        self._parts.add(received.payload)
                    case Sample():
                        self._arrive(received)
                    case Subscribed():
                        if (subscriber := self._subscribers.get(received.number)) is not None:
                            subscriber.confirm(self, received.number, ok=received.ok)
            except (*DECODE_ERRORS, MarshalException) as error:
                _logger.warning("a malformed message from this machine ends its connection: %s", error)
                self.close()
                return None

    def look(self, now: float) -> None:
        for number, pending in list(self._pending.items()):
            if pending.deadline <= now and self._take(number) is not None:
                self._pool.submit(partial(pending.done, NoAnswer(timed_out=True)))

    def shut(self) -> None:
        """Let it end, on a thread of the pool."""
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

    def abandon(self) -> None:
        """Close its file in a forked child."""
        self._socket.close()

    def _take(self, number: int) -> _Pending | None:
        pending = self._pending.pop(number, None)
        if pending is not None:
            pending.call.unanswered.discard(number)
        return pending

    def _end(self, answer: Answer) -> Job | None:
        pending = self._take(answer.number)
        if pending is not None:
            return self._kind, partial(self._finish, pending, answer)
        self.give_back(answer)  # it came too late
        return None

    def _finish(self, pending: _Pending, answer: Answer) -> None:
        call = pending.call
        limit = call.limit if answer.ok else LARGEST_PAYLOAD
        try:
            outcome: Outcome | SystemException = answer.ok, self.read(answer, limit, call.what)
        except SystemException as error:
            outcome = error
        pending.done(outcome)

    def _fail_pending(self) -> None:
        for number in list(self._pending):
            # One by one: some are called again, which takes long.
            if (pending := self._take(number)) is not None:
                self._pool.submit(partial(pending.done, NoAnswer(timed_out=False, broken=True)))
        for number, subscriber in list(self._subscribers.items()):
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

    def _send_call(self, number: int, call: Sent, payload: bytes, attachment: bytes) -> None:
        """Send a call; raises OSError, of these BlockingIOError when there was no room within its limit."""
        if not self._sending.acquire(timeout=call.timeout):
            raise BlockingIOError
        try:
            if call.timeout != self._timeout:
                limit_waits(self._socket, socket.SO_SNDTIMEO, call.timeout)
                self._timeout = call.timeout
            last = send_parts(self._send_message, payload)
            request = (REQUEST, number, call.target, call.operation, attachment, last)
            self._send_message(encode(request))
        except BlockingIOError:
            if len(payload) > LARGEST_INLINE:  # a part of it may have been sent
                self.shut()
            raise
        finally:
            self._sending.release()


class Sent(msgspec.Struct, eq=False):
    """What all calls have in common that one caller sends."""

    target: str
    operation: str
    timeout: float
    limit: int
    """Bytes that its result may have."""
    what: str
    unanswered: set[int]
    """The numbers of the calls of its target that are not answered yet."""


class _Pending(msgspec.Struct, eq=False):
    call: Sent
    deadline: float
    done: Done


class Route:
    """The way to one target: through the door of its only server, or over the network.

    Calls of one client stay in order: none takes another way than those before it that are not answered.
    """

    def __init__(self, neighborhood: Neighborhood) -> None:
        self.neighbor: Neighbor | None = None
        self.of_channel: Neighbor | None = None
        """The one to which the calls in the channel went."""
        self.changed: Final[set[Callable[[], object]]] = set()
        """Called, where they must not wait, whenever the neighbor is another one, or none."""
        self.in_channel: Final[set[int]] = set()
        self.over_network: Final[dict[object, float]] = {}
        """Calls in flight, with the moments of the monotonic clock at which they end in any case."""
        self._neighborhood: Final = neighborhood
        self._doors: Final[dict[str, tuple[str, str]]] = {}

    def on_token(self, key: str, came: bool) -> None:
        """Note a token of the target: on the transport's thread."""
        if came and len(self._doors) < _MOST_TOKENS:
            token = parse_servant_token(key)
            if token is not None:
                self._doors[key] = token.server, token.door
        elif not came:
            self._doors.pop(key, None)
        self.choose()

    def choose(self) -> None:
        """Choose the neighbor again."""
        doors = set(self._doors.values())
        before = self.neighbor
        self.neighbor = self._neighborhood.neighbor(*doors.pop()) if len(doors) == 1 else None
        if self.neighbor is not before:
            for changed in tuple(self.changed):
                changed()

    @property
    def way(self) -> Neighbor | None:
        """The neighbor that the next call goes to; None if it goes over the network."""
        if not self.is_clear:
            return None
        return self.of_channel if self.in_channel else self.neighbor

    @property
    def is_clear(self) -> bool:
        """Whether no call over the network is unanswered."""
        if not self.over_network:
            return True
        now = time.monotonic()
        for call, end in list(self.over_network.items()):
            if end <= now:
                self.over_network.pop(call, None)
        return not self.over_network


class Neighborhood:
    """The neighbors of a process, and the routes to the targets that it calls."""

    def __init__(self, pool: Pool, watch: Callable[[str, Callable[[str, bool], object]], object]) -> None:
        self._pool: Final = pool
        self._watch: Final = watch
        self._space: Final = memory_space()
        self._lock: Final = threading.Lock()
        self._routes: Final[dict[Target, Route]] = {}
        self._neighbors: Final[dict[str, Neighbor]] = {}
        self._ending: Final[WeakSet[Channel]] = WeakSet()  # of lost neighbors, while the pool has them
        self._closed = False

    def route(self, target: Target) -> Route:
        """Return the route to a target."""
        with self._lock:
            if (known := self._routes.get(target)) is not None:
                return known
            route = self._routes[target] = Route(self)
        self._watch(f"@servant/{target.prefix}/**", route.on_token)
        return route

    def neighbor(self, server: str, door: str) -> Neighbor | None:
        """Return the neighbor that serves at a door; None if it is none."""
        if not self._space or not door.startswith(self._space):
            return None
        with self._lock:
            if self._closed:
                return None
            known = self._neighbors.get(server)
            if known is None:
                if len(self._neighbors) >= _MOST_NEIGHBORS:
                    self._neighbors.pop(next(iter(self._neighbors))).close()
                known = self._neighbors[server] = Neighbor(self._pool, door, server)
            return known

    def lost(self, server: str) -> None:
        """End the calls of a neighbor whose link was lost: it may be frozen."""
        with self._lock:
            neighbor = self._neighbors.pop(server, None)
            routes = list(self._routes.values())
        if neighbor is not None:
            for route in routes:
                if route.neighbor is neighbor:
                    route.choose()
            self._pool.submit(partial(self._let_end, neighbor))

    def close(self) -> None:
        """End all calls."""
        with self._lock:
            self._closed = True
            neighbors = list(self._neighbors.values())
            ending = list(self._ending)
        for each in neighbors:
            each.close()
        for channel in ending:
            channel.close()

    def abandon(self) -> None:
        """Close all files in a forked child."""
        for each in self._neighbors.values():
            each.abandon()
        for channel in self._ending:
            channel.abandon()

    def _let_end(self, neighbor: Neighbor) -> None:
        channel = neighbor.shut()
        with self._lock:
            if channel is not None:
                self._ending.add(channel)
