"""The neighbors of a process: others of its machine and user, whose servants it calls through their doors."""

from __future__ import annotations

import logging
import math
import os
import re
import select
import socket
import threading
import time
from collections import deque
from contextlib import suppress
from typing import Final

from .._codec import DECODE_ERRORS
from .._memory import ArenaView
from .._pool import Pool
from ..exceptions import MarshalException
from ..limits import LIMITS, Limits
from ..transport import NoAnswer, Outcome
from .channel import Channel, NotSent, Outgoing, send_call
from .messages import (
    LARGEST_MESSAGE,
    RETURN,
    VERSION,
    Answer,
    Part,
    Parts,
    decode_hello,
    decode_to_client,
    encode,
    limit_sending,
    outcome_of_answer,
    owner_of,
    receive_with_file,
)

_ADDRESS: Final = re.compile(r"([0-9a-f]{16})\.([0-9]{1,10})\.([0-9]{1,10})")
_RETRY_PAUSE: Final = 5.0  # s after a vain attempt in which a neighbor is called over the network
_LARGEST_KEPT: Final = 1 << 20  # bytes of the last answer that an idle connection does not give back
_MOST_IDLE: Final = 8  # connections kept for calls that wait

_logger = logging.getLogger(__name__)


class Neighbor:
    """Another process of this machine, with the connections to it; thread-safe.

    A call that waits has a connection for itself, so that its thread reads the answer; calls in flight share
    one, the channel, which keeps their order.
    """

    def __init__(self, pool: Pool, address: str, server: str, limits: Limits = LIMITS) -> None:
        self.pool: Final = pool
        self.limits: Final = limits
        self._address: Final = address
        self._server: Final = server
        self._lock: Final = threading.Lock()
        self._opening: Final = threading.Lock()  # of the channel, which may take a while
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

    def call(self, call: Outgoing, payload: bytes, attachment: bytes) -> Outcome:
        """Call and wait for the answer.

        Raises NotSent, NoAnswer, or MarshalException for an unreadable one.
        """
        while True:
            try:
                line = self._idle.pop()
            except IndexError:
                line = self._open_line(call.timeout)
                fresh = True
            else:
                fresh = False
            try:
                line.send(call, payload, attachment)
            except OSError as error:
                self._drop(line)
                if isinstance(error, BlockingIOError):
                    raise NoAnswer(timed_out=True) from None
                if fresh:
                    raise NotSent(str(error)) from None
                continue  # it ended while it was idle
            break
        try:
            outcome = line.receive(call, self._view)
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
        with self._opening:
            channel = self._channel
            if channel is None or channel.ended:
                channel = Channel(self.pool, self._connect(timeout), self._view, self.limits)
                with self._lock:
                    self._channel, closed = channel, self._closed
                if closed:
                    channel.close()
            return channel

    def close(self) -> None:
        """End all connections for good: running calls end without an answer."""
        if (channel := self.shut()) is not None:
            channel.close()

    def shut(self) -> Channel | None:
        """End all connections for good, once what has arrived is read; return a channel that then ends."""
        self._absent_until = math.inf
        with self._lock:
            self._closed = True
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
                made.settimeout(min(self.limits.hello, self.limits.hello_share * timeout))
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
        self._parts: Final = Parts()

    def send(self, call: Outgoing, payload: bytes, attachment: bytes) -> None:
        """Send a call; raises OSError if it was not sent, BlockingIOError of these when there was no room."""
        if call.timeout != self._timeout:
            limit_sending(self._socket, call.timeout)
            self._timeout = call.timeout
        send_call(self._send, 0, call, payload, attachment)

    def receive(self, call: Outgoing, view: ArenaView | None) -> Outcome:
        """Wait for the answer."""
        deadline = time.monotonic() + call.timeout
        while True:
            if not self._wait(1000.0 * max(0.0, deadline - time.monotonic())):
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
                raise MarshalException(f"{call.what}: {error}") from None
            match answer:
                case Answer(number=0):
                    answer.payload = self._parts.complete(answer.payload)
                    outcome = outcome_of_answer(answer, view, call.limit, call.what)
                    if answer.extent is not None and sum(answer.extent.sizes) > _LARGEST_KEPT:
                        self._give_back(answer.extent.start)
                    return outcome
                case Part():
                    self._parts.add(answer.payload)
                case _:
                    raise MarshalException(f"{call.what}: an answer to another call")

    def shut(self) -> None:
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self._socket.close()

    def _send(self, message: bytes) -> None:
        self._socket.send(message, socket.MSG_NOSIGNAL)

    def _give_back(self, start: int) -> None:
        with suppress(OSError):  # the next call will notice
            self._send(encode((RETURN, 0, start)))
