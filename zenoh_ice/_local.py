"""Calls between processes of one machine and one user, over Unix sockets."""

from __future__ import annotations

import logging
import os
import socket
import struct
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Final

import msgspec
from msgspec import Meta

from ._codec import DECODE_ERRORS, Pieces
from ._threads import Job, Kind, Pool, Source
from ._wire import encode_error
from .exceptions import ObjectNotExistException, SystemException
from .transport import NoAnswer, Outcome, Receiver

_LARGEST_MESSAGE: Final = 1 << 16
_encode: Final = msgspec.msgpack.Encoder().encode
_DONT_WAIT: Final = socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL
_logger = logging.getLogger(__name__)


class _Request(msgspec.Struct, array_like=True):
    number: int
    target: str
    operation: str
    attachment: bytes
    payload: bytes


class _Answer(msgspec.Struct, array_like=True):
    number: int
    ok: bool
    payload: bytes


_decode_request: Final = msgspec.msgpack.Decoder(_Request).decode
_decode_answer: Final = msgspec.msgpack.Decoder(_Answer).decode


class Door(Source):
    """The socket at which a process takes connections."""

    def __init__(self, pool: Pool, receivers: Mapping[str, Receiver], own_id: str) -> None:
        self._pool = pool
        self._receivers = receivers
        self._id = own_id
        self._kind = Kind()
        self._connections: set[_Connection] = set()
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        folder = tempfile.mkdtemp()
        path = Path(folder, "door")
        try:
            self._socket.bind(str(path))
            self._handle = os.open(path, os.O_PATH)
        finally:
            path.unlink(missing_ok=True)
            Path(folder).rmdir()
        self._socket.listen()
        self._socket.setblocking(False)
        self.address = f"{os.getpid()}.{self._handle}"
        pool.attach(self)

    def fileno(self) -> int:
        return self._socket.fileno()

    def take(self) -> Job | None:
        try:
            connection, _ = self._socket.accept()
        except OSError:
            return None
        return self._kind, partial(self._open, connection)

    def _open(self, connection: socket.socket) -> None:
        connection.setblocking(True)
        connection.send(_encode(self._id))
        opened = _Connection(self, connection)
        self._connections.add(opened)
        self._pool.attach(opened)

    def close(self) -> None:
        self._pool.detach(self)
        self._socket.close()
        os.close(self._handle)
        for each in list(self._connections):
            each.close()


class _Connection(Source):
    def __init__(self, door: Door, connection: socket.socket) -> None:
        self._door = door
        self._socket = connection
        self._file = connection.fileno()
        self._receivers = door._receivers
        self._lock = threading.Lock()
        self._closed = False

    def fileno(self) -> int:
        return self._file

    def take(self) -> Job | None:
        try:
            message = self._socket.recv(_LARGEST_MESSAGE, socket.MSG_DONTWAIT)
        except BlockingIOError:
            return None
        except OSError:
            self.close()
            return None
        if not message:
            self.close()
            return None
        request = _decode_request(message)
        receiver = self._receivers.get(request.target)
        reply = partial(self._reply, request.number)
        if receiver is None:
            error = ObjectNotExistException(f"{request.target} is no longer served")
            return self._door._kind, partial(reply, False, encode_error(error))
        return receiver.admit(request.operation, request.payload, request.attachment or None, reply)

    def _reply(self, number: int, ok: bool, answer: bytes | Pieces) -> None:
        message = _encode((number, ok, bytes(answer)))
        with self._lock:
            if not self._closed:
                try:
                    self._socket.send(message, socket.MSG_NOSIGNAL)
                except OSError as error:
                    _logger.debug("%s", error)

    def close(self) -> None:
        self._door._pool.detach(self)
        with self._lock:
            self._closed = True
            self._socket.close()
        self._door._connections.discard(self)


class Neighbor:
    """Another process of this machine, and the connections to its door."""

    def __init__(self, pool: Pool, address: str, its_id: str) -> None:
        self._pool = pool
        self._address = address
        self._id = its_id
        self.idle: deque[Line] = deque()
        self._lock = threading.Lock()
        self.channel: Channel | None = None

    def connect(self) -> socket.socket:
        pid, file = self._address.split(".")
        made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        made.connect(f"/proc/{pid}/fd/{file}")
        made.recv(1000)
        return made

    def line(self) -> Line:
        try:
            return self.idle.pop()
        except IndexError:
            return Line(self.connect())

    def open_channel(self) -> Channel:
        with self._lock:
            if self.channel is None:
                self.channel = Channel(self._pool, self.connect())
            return self.channel


class Line:
    def __init__(self, connection: socket.socket) -> None:
        self._socket = connection
        self._timeout = 0.0
        self._number = 0
        self._send = connection.send
        self._receive = connection.recv

    def call(self, prefix: str, operation: str, payload: bytes, attachment: bytes, timeout: float) -> Outcome:
        if timeout != self._timeout:
            limit = struct.pack("ll", int(timeout), int(timeout % 1.0 * 1e6))
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, limit)
            self._timeout = timeout
        self._send(_encode((0, prefix, operation, attachment, payload)), socket.MSG_NOSIGNAL)
        SPIN = _SPIN
        if SPIN:
            until = time.perf_counter() + SPIN
            while True:
                try:
                    message = self._receive(_LARGEST_MESSAGE, socket.MSG_DONTWAIT)
                    break
                except BlockingIOError:
                    if time.perf_counter() > until:
                        message = self._receive(_LARGEST_MESSAGE)
                        break
        else:
            message = self._receive(_LARGEST_MESSAGE)
        if not message:
            raise NoAnswer(timed_out=False)
        answer = _decode_answer(message)
        return answer.ok, answer.payload

_SPIN = float(os.environ.get("SPIN", "0")) * 1e-6

class Channel(Source):
    def __init__(self, pool: Pool, connection: socket.socket) -> None:
        self._pool = pool
        self._socket = connection
        self._file = connection.fileno()
        self._pending: dict[int, Callable[[Outcome | SystemException], object]] = {}
        self._kind = Kind(quick=True)
        pool.attach(self)

    def fileno(self) -> int:
        return self._file

    def begin(self, number, prefix, operation, payload, attachment, done):
        self._pending[number] = done
        self._socket.send(_encode((number, prefix, operation, attachment, payload)), socket.MSG_NOSIGNAL)
        return partial(self._pending.pop, number, None)

    def take(self) -> Job | None:
        try:
            message = self._socket.recv(_LARGEST_MESSAGE, socket.MSG_DONTWAIT)
        except BlockingIOError:
            return None
        if not message:
            return None
        answer = _decode_answer(message)
        done = self._pending.pop(answer.number, None)
        if done is None:
            return self._kind, lambda: None
        return self._kind, partial(done, (answer.ok, answer.payload))
