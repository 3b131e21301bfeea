"""What passes through a Unix socket: messages in MessagePack, each of at most 64 KiB.

The sockets keep the borders of messages and their order. A payload that is larger than a message lies in
memory that its sender lends; where there is none, and on the way to a servant, it is sent in parts.
"""

from __future__ import annotations

import logging
import os
import socket
import struct
import threading
from abc import abstractmethod
from array import array
from collections.abc import Callable
from typing import Annotated, Any, Final

import msgspec
from msgspec import Meta

from .. import typed
from .._codec import DECODE_ERRORS, LARGEST_BULK, LARGEST_PAYLOAD, Parted, Pieces, too_large
from .._memory import Arena, ArenaView, Extent, Reader
from .._pool import Job, Source
from .._wire import ATTACHMENT_LIMIT
from ..exceptions import MarshalException
from ..transport import Outcome

VERSION: Final = 1
"""Of these messages: a process of another release is called over Zenoh."""

LARGEST_MESSAGE: Final = 1 << 16
LARGEST_INLINE: Final = LARGEST_MESSAGE - (1 << 12)
"""Bytes of a payload within a message: the rest of it has room beside it."""

MOST_TOGETHER: Final = 16
"""Answers in one message."""

_LARGEST_WHOLE: Final = LARGEST_BULK + (1 << 12)  # bytes of all parts of a payload

HELLO, PART, REQUEST, ANSWER, RETURN, SUBSCRIBE, CANCEL, SUBSCRIBED, SAMPLE, ANSWERS = range(10)
"""The tags of messages."""

encode: Final = msgspec.msgpack.Encoder().encode
"""Encodes a message, given as a tuple that begins with its tag: that is faster than the struct."""

_logger = logging.getLogger(__name__)

_Number = Annotated[int, Meta(ge=0, lt=1 << 62)]
_Name = Annotated[str, Meta(max_length=512)]
_Attachment = Annotated[bytes, Meta(max_length=ATTACHMENT_LIMIT)]
_Places = Annotated[tuple[_Number, ...], Meta(max_length=256)]


class Hello(msgspec.Struct, array_like=True, tag=HELLO):
    """The first message to a client; the descriptor of the memory that the server lends comes with it."""

    version: int
    server: Annotated[str, Meta(max_length=64)]
    """Id of the server's session."""


class Part(msgspec.Struct, array_like=True, tag=PART):
    """A part of the payload of the next message, after the parts before it."""

    payload: Annotated[bytes, Meta(min_length=LARGEST_INLINE, max_length=LARGEST_INLINE)]
    """Full: many small ones would take many times their size."""


class Request(msgspec.Struct, array_like=True, tag=REQUEST):
    """A call."""

    number: _Number
    """Its number on this connection; 0 where only one is made at a time."""
    target: _Name
    operation: _Name
    attachment: _Attachment
    payload: bytes


class Answer(msgspec.Struct, array_like=True, tag=ANSWER):
    """The answer to a call."""

    number: _Number
    ok: bool
    payload: bytes
    places: _Places = ()
    """Places of the lent byte sequences in the payload; without any, the only one is the whole payload."""
    extent: Extent | None = None


class Answers(msgspec.Struct, array_like=True, tag=ANSWERS):
    """Small answers that were sent together."""

    answers: Annotated[tuple[Answer, ...], Meta(max_length=MOST_TOGETHER)]


class Return(msgspec.Struct, array_like=True, tag=RETURN):
    """The lent memory of an answer or a sample was read."""

    number: _Number
    start: _Number


class Subscribe(msgspec.Struct, array_like=True, tag=SUBSCRIBE):
    """Samples of a stream are wanted, until the number is cancelled."""

    number: _Number
    target: _Name
    operation: _Name


class Cancel(msgspec.Struct, array_like=True, tag=CANCEL):
    """No further sample is wanted."""

    number: _Number


class Subscribed(msgspec.Struct, array_like=True, tag=SUBSCRIBED):
    """Whether samples will come; otherwise the stream is not published here."""

    number: _Number
    ok: bool


class Sample(msgspec.Struct, array_like=True, tag=SAMPLE):
    """A sample of a stream."""

    number: _Number
    attachment: _Attachment
    payload: bytes
    places: _Places = ()
    extent: Extent | None = None


ToServer = Part | Request | Return | Subscribe | Cancel
ToClient = Part | Answer | Answers | Subscribed | Sample

decode_hello: Final = typed.msgpack_decoder(Hello)
decode_to_server: Final[Callable[[bytes], Any]] = typed.msgpack_decoder(ToServer)
decode_to_client: Final[Callable[[bytes], Any]] = typed.msgpack_decoder(ToClient)


class Parts:
    """The parts of a payload that have arrived."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, part: bytes) -> None:
        """Keep a part; raises MarshalException for more than any payload has."""
        self._size += len(part)
        if self._size > _LARGEST_WHOLE:
            raise too_large(self._size, _LARGEST_WHOLE, "payload")
        self._parts.append(part)

    def complete(self, last: bytes) -> bytes:
        """Return the whole payload with its last part, and forget it."""
        if not self._parts:
            return last
        whole = b"".join((*self._parts, last))
        self._parts, self._size = [], 0
        return whole


def send_parts(send: Callable[[bytes], object], payload: bytes) -> bytes:
    """Send all of a payload but its last part, and return that."""
    if len(payload) <= LARGEST_INLINE:
        return payload
    view = memoryview(payload)
    last = (len(payload) - 1) // LARGEST_INLINE * LARGEST_INLINE
    for start in range(0, last, LARGEST_INLINE):
        send(encode((PART, view[start : start + LARGEST_INLINE])))
    return payload[last:]


def lend(
    payload: bytes | Pieces, arena: Arena | None, *readers: Reader
) -> tuple[bytes, tuple[int, ...], Extent | None]:
    """Write a payload that is too large for a message into memory, for some readers.

    Return what travels of it, the places of the byte sequences in it that are lent (without any, the only one
    is all of it), and where they lie: None if nothing is lent.
    """
    if arena is not None and len(payload) > LARGEST_INLINE:
        if isinstance(payload, Pieces) and len(rest := payload.without_large()) <= LARGEST_INLINE:
            if (extent := arena.lend(payload.large, readers)) is not None:
                return rest, payload.places, extent
        elif (extent := arena.lend((bytes(payload),), readers)) is not None:
            return b"", (), extent
    return bytes(payload), (), None


def collect(received: Answer | Sample, view: ArenaView | None, limit: int, what: str) -> bytes | Parted:
    """Return the payload that `lend` divided; raises MarshalException for one of more than `limit` bytes."""
    payload, places, extent = received.payload, received.places, received.extent
    if len(payload) > limit:
        raise too_large(len(payload), limit, what)
    if extent is None:
        return payload
    if view is None or len(extent.sizes) != max(1, len(places)):
        raise MarshalException(f"{what}: a reference to no memory")
    large = view.read(extent, limit - len(payload), what)
    return Parted(payload, places, large) if places else large[0]


def outcome_of_answer(answer: Answer, view: ArenaView | None, limit: int, what: str) -> Outcome:
    """Return what an answer says; raises MarshalException for a result of more than `limit` bytes."""
    return answer.ok, collect(answer, view, limit if answer.ok else LARGEST_PAYLOAD, what)


class MessageSource(Source):
    """A socket from which the pool takes messages; several threads may send."""

    def __init__(self, connection: socket.socket, decode: Callable[[bytes], Any]) -> None:
        self._decode: Final = decode
        self._socket: Final = connection
        self._file: Final = connection.fileno()
        # Both are held while it is closed: nobody uses a file with the same number.
        self._receiving: Final = threading.Lock()
        self._sending: Final = threading.Lock()
        self._parts: Final = Parts()

    def fileno(self) -> int:
        return self._file

    def abandon(self) -> None:
        """Close its file in a forked child."""
        self._socket.close()

    def take(self) -> Job | None:
        while True:
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
                job = self._receive(self._decode(message))
            except (*DECODE_ERRORS, MarshalException) as error:
                _logger.warning("a malformed message from this machine ends its connection: %s", str(error))
                self.close()
                return None
            if job is not None:
                return job

    @abstractmethod
    def _receive(self, message: Any) -> Job | None:  # noqa: ANN401 - one of those that `decode` gives
        """Take a message; return the job that it makes, if any. Raises MarshalException."""

    @abstractmethod
    def close(self) -> None:
        """End the connection."""


def limit_sending(connection: socket.socket, seconds: float) -> None:
    """Let the system end a wait to send after some seconds."""
    microseconds = max(1, int(seconds * 1e6))  # 0 would be no limit
    limit = struct.pack("@ll", *divmod(microseconds, 1_000_000))
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)


def send_with_file(connection: socket.socket, message: bytes, file: int | None) -> None:
    """Send a message with a file of this process; raises OSError."""
    files = [] if file is None else [file]
    rights = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array("i", files))]
    connection.sendmsg([message], rights, socket.MSG_NOSIGNAL)


def receive_with_file(connection: socket.socket) -> tuple[bytes, int | None]:
    """Return a message with the file that came with it; raises OSError if this process may not open it."""
    room = socket.CMSG_LEN(array("i").itemsize)
    message, rights, flags, _ = connection.recvmsg(LARGEST_MESSAGE, room, socket.MSG_CMSG_CLOEXEC)
    files = array("i")
    for level, kind, content in rights:
        if (level, kind) == (socket.SOL_SOCKET, socket.SCM_RIGHTS):
            files.frombytes(content)
    if flags & socket.MSG_CTRUNC:
        for file in files:
            os.close(file)
        raise OSError("its memory could not be opened")
    return message, files[0] if files else None


def owner_of(connection: socket.socket) -> int:
    """Return the user of the process at the other end, as the system knows it."""
    credentials = struct.Struct("3i")
    found = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, credentials.size)
    return int(credentials.unpack(found)[1])
