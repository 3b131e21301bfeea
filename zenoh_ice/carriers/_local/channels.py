"""Channels: connections to another process of this machine and user through Unix sockets.

A call has a channel for itself, so that its thread reads the answer; so has a stream of large values, with a
thread that takes its samples.
"""

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
from typing import Final, Protocol

import msgspec

from zenoh_ice.carriers._local import messages
from zenoh_ice.carriers._local.memory import ArenaView, Extent
from zenoh_ice.data.codec import DECODE_ERRORS, LARGEST_PAYLOAD
from zenoh_ice.data.exceptions import BusyException, ConnectionLostException, MarshalException
from zenoh_ice.threads._starting import start
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.transport import Arrived, NoAnswer, Outcome

RETRY_PAUSE: Final = 5.0
"""s after a vain attempt in which a server is called, and streams come, over the network."""

_ADDRESS: Final = re.compile(r"([0-9a-f]{16})\.([0-9]{1,10})\.([0-9]{1,10})")
_LARGEST_KEPT: Final = 1 << 20  # bytes of the last answer that an idle channel does not give back
_MOST_IDLE: Final = 8  # channels kept for calls that wait
_SENDING_LIMIT: Final = 1.0  # s that a server may take nothing of what concerns samples

_logger = logging.getLogger(__name__)


class NotSent(Exception):
    """A call did not reach its server: another route may carry it."""


class Outgoing(msgspec.Struct, eq=False):
    """The common part of all calls of one caller."""

    target: str
    operation: str
    timeout: float
    limit: int
    """Bytes that its result may have."""
    what: str


class Channels:
    """The channels to one server; thread-safe."""

    def __init__(self, address: str, server: str, limits: Limits = LIMITS) -> None:
        self._limits: Final = limits
        self._address: Final = address
        self._server: Final = server
        self._lock: Final = threading.Lock()
        self._idle: Final[deque[_Channel]] = deque()
        self._all: Final[set[_Channel | SampleChannel]] = set()
        self._view: ArenaView | None = None
        self._absent_until = -math.inf
        self._closed = False

    @property
    def is_absent(self) -> bool:
        """Return whether the server could not be reached a moment ago."""
        return time.monotonic() < self._absent_until

    def call(self, call: Outgoing, payload: bytes, attachment: bytes) -> Outcome:
        """Call and wait for the answer.

        Raises NotSent, NoAnswer, or MarshalException for an unreadable one.
        """
        while True:
            try:
                channel, fresh = self._idle.pop(), False
            except IndexError:
                channel, fresh = self._open(call.timeout), True
            try:
                outcome = channel.call(call, payload, attachment, self._view)
            except OSError as error:  # it was not sent
                self.drop(channel)
                if isinstance(error, BlockingIOError):
                    raise NoAnswer(timed_out=True) from None
                if fresh:
                    raise NotSent(str(error)) from None
                # It ended while it was idle.
            except BaseException:
                self.drop(channel)
                raise
            else:
                if len(self._idle) < _MOST_IDLE and not self._closed:
                    self._idle.append(channel)
                else:
                    self.drop(channel)
                return outcome

    def follow(self, target: str, operation: str, subscriber: Subscriber) -> SampleChannel:
        """Ask for the samples of a stream, until the channel is closed; raises NotSent."""
        connection = self._connect(math.inf)
        channel = SampleChannel(self, connection, self._view, subscriber)
        self._add(channel)
        try:
            messages.limit_sending(connection, _SENDING_LIMIT)
            connection.send(messages.encode((messages.SUBSCRIBE, target, operation)), socket.MSG_NOSIGNAL)
            channel.start()
        except (OSError, BusyException) as error:  # without a thread, too
            self.drop(channel)
            raise NotSent(str(error)) from None
        return channel

    def close(self) -> None:
        """End all channels for good: calls that wait end without an answer."""
        self._absent_until = math.inf
        with self._lock:
            self._closed = True
            channels = list(self._all)
        for channel in channels:
            channel.shut()
        while self._idle:
            with suppress(IndexError):
                self.drop(self._idle.pop())
        self._view = None  # it is unmapped once the last sample in it was dropped

    def drop(self, channel: _Channel | SampleChannel) -> None:
        """Close the file of a channel, which nobody uses any more."""
        with self._lock:
            self._all.discard(channel)
        channel.close()

    def _add(self, channel: _Channel | SampleChannel) -> None:
        with self._lock:
            self._all.add(channel)
        if self._closed:
            channel.shut()

    def _open(self, timeout: float) -> _Channel:
        channel = _Channel(self._connect(timeout))
        self._add(channel)
        return channel

    def _connect(self, timeout: float) -> socket.socket:
        """Return a connection for calls with a limit; raises NotSent, and is not tried again for a while."""
        if self.is_absent:
            raise NotSent("not reached before")
        match = _ADDRESS.fullmatch(self._address)
        assert match is not None  # parsed before
        try:
            made = messages.end_in_children(messages.new_socket)
            try:
                made.settimeout(min(self._limits.hello, self._limits.hello_share * timeout))
                self._reach(made, f"/proc/{match[2]}/fd/{match[3]}")
            except BaseException:
                made.close()
                raise
        except (OSError, *DECODE_ERRORS) as error:
            self._absent_until = time.monotonic() + RETRY_PAUSE
            _logger.info("process %s of this machine is called over the network: %s", match[2], error)
            raise NotSent(str(error)) from None
        return made

    def _reach(self, connection: socket.socket, path: str) -> None:
        """Connect, and keep the memory that the server lends, if it is the right one."""
        connection.connect(path)
        if messages.owner_of(connection) != os.geteuid():
            raise PermissionError("its user is another one")
        message, file = messages.receive_with_file(connection)
        view = None if file is None else ArenaView(file)
        hello = messages.decode_hello(message)
        if (hello.version, hello.server) != (messages.VERSION, self._server):
            raise ConnectionRefusedError("it is another process, or of another release")
        self._view = self._view or view
        connection.settimeout(None)


class _Channel:
    """A channel for one call at a time."""

    def __init__(self, connection: socket.socket) -> None:
        self._socket: Final = connection
        # Not SO_RCVTIMEO: that begins again after each signal.
        answers = select.poll()
        answers.register(connection, select.POLLIN)
        self._wait: Final = answers.poll
        self._timeout = 0.0
        self._parts: Final = messages.Parts()

    def call(self, call: Outgoing, payload: bytes, attachment: bytes, view: ArenaView | None) -> Outcome:
        """Send a call and wait for its answer; raises as `Channels.call`, but OSError if it was not sent.

        That is a BlockingIOError where there was no room for it within its limit.
        """
        deadline = time.monotonic() + call.timeout
        if call.timeout != self._timeout:
            messages.limit_sending(self._socket, call.timeout)
            self._timeout = call.timeout
        if len(payload) > messages.LARGEST_INLINE:
            payload = messages.send_parts(self._send, payload)
        request = messages.encode((messages.REQUEST, call.target, call.operation, attachment, payload))
        self._socket.send(request, socket.MSG_NOSIGNAL)
        while True:
            if not self._wait(1000.0 * max(0.0, deadline - time.monotonic())):
                raise NoAnswer(timed_out=True)
            try:
                message = self._socket.recv(messages.LARGEST_MESSAGE)
            except OSError:
                message = b""
            if not message:
                raise NoAnswer(timed_out=False, broken=True)
            try:
                answer = messages.decode_to_client(message)
            except DECODE_ERRORS as error:
                raise MarshalException(f"{call.what}: {error}") from None
            match answer:
                case messages.Response(ok, payload, extent=None) if (
                    not self._parts and len(payload) <= call.limit
                ):
                    return ok, payload
                case messages.Response():
                    return self._outcome(answer, call, view)
                case messages.Part():
                    self._parts.append(answer.payload)
                case _:
                    raise MarshalException(f"{call.what}: an answer to another call")

    def _outcome(self, answer: messages.Response, call: Outgoing, view: ArenaView | None) -> Outcome:
        """Return what an answer says; raises MarshalException for a result that is too large."""
        if self._parts:
            answer.payload = self._parts.complete(answer.payload)
        limit = call.limit if answer.ok else LARGEST_PAYLOAD
        result = messages.collect(answer, view, limit, call.what)
        if answer.extent is not None and sum(answer.extent.sizes) > _LARGEST_KEPT:
            with suppress(OSError):  # the next call will notice
                self._send(messages.encode((messages.RETURN, answer.extent.start)))
        return answer.ok, result

    def shut(self) -> None:
        """End the call that waits, and begin none of those that the server has not read."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close its file, which nobody uses any more."""
        self._socket.close()

    def _send(self, message: bytes) -> None:
        self._socket.send(message, socket.MSG_NOSIGNAL)


class Subscriber(Protocol):
    """The reader of a channel of samples, called on the channel's thread, where it must not wait."""

    def confirm(self, channel: SampleChannel) -> None:
        """Note that samples come, or that the channel has ended."""

    def keep(self, sample: LentSample) -> None:
        """Take a sample, to read it or to give it back."""


class SampleChannel:
    """A channel with the samples of one stream, and the thread that takes them."""

    def __init__(
        self,
        all_channels: Channels,
        connection: socket.socket,
        view: ArenaView | None,
        subscriber: Subscriber,
    ) -> None:
        self.view: Final = view
        self.ended = False
        """Its samples are no longer lent."""
        self.has_samples = False
        """Its server has said that samples come, or sent one, which may be faster."""
        self._all: Final = all_channels
        self._socket: Final = connection
        self._sending: Final = threading.Lock()  # also held while it is closed
        self._subscriber: Final = subscriber

    def start(self) -> None:
        """Start the thread; raises BusyException where the system gives this process none."""
        start(threading.Thread(target=self._receive_all, name="zenoh_ice samples", daemon=True))

    def give_back(self, extent: Extent) -> None:
        """Let memory be used again that was lent for a sample."""
        with self._sending, suppress(OSError):  # it has ended
            self._socket.send(messages.encode((messages.RETURN, extent.start)), socket.MSG_NOSIGNAL)

    def shut(self) -> None:
        """Let it end; what it was lent is written again soon."""
        self.ended = True
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)  # ends a wait to send, too

    def close(self) -> None:
        """Close its file."""
        self._socket.close()

    def _receive_all(self) -> None:
        try:
            while message := self._socket.recv(messages.LARGEST_MESSAGE):
                match messages.decode_to_client(message):
                    case messages.Sample() as sample:
                        self.has_samples = True
                        self._subscriber.keep(LentSample(self, sample))
                    case messages.Subscribed():
                        self.has_samples = True
                        self._subscriber.confirm(self)
                    case _:
                        raise MarshalException("an answer to no call")
        except OSError as error:
            _logger.debug("samples end: %s", error)
        except (*DECODE_ERRORS, MarshalException) as error:
            _logger.warning("a malformed message from this machine ends its channel: %s", str(error))
        finally:
            self.shut()
            with self._sending:
                self._all.drop(self)
            self._subscriber.confirm(self)


class LentSample:
    """A sample in memory that its sender lends, until it is read or given back, which happens once."""

    def __init__(self, channel: SampleChannel, sample: messages.Sample) -> None:
        self._channel: Final = channel
        self._sample: Final = sample
        self._arrived: Arrived | None = None

    @property
    def size(self) -> int:
        """Bytes in lent memory."""
        return 0 if self._sample.extent is None else sum(self._sample.extent.sizes)

    @property
    def is_lost(self) -> bool:
        """Return whether its memory may have been written again before it was read."""
        return self._sample.extent is not None and self._arrived is None and self._channel.ended

    def read(self, limit: int, what: str) -> Arrived:
        """Return its contents; raises MarshalException, or ConnectionLostException when they are gone."""
        if self._arrived is None:
            what = f"sample of {what}"
            try:
                payload = messages.collect(self._sample, self._channel.view, limit, what)
            finally:
                self.give_back()
            if self.is_lost:
                raise ConnectionLostException(f"{what} was lost with its sender")
            self._arrived = Arrived(payload, self._sample.attachment)
        return self._arrived

    def give_back(self) -> None:
        """Let its memory be used again without reading it."""
        if self._arrived is None and self._sample.extent is not None:
            self._channel.give_back(self._sample.extent)
