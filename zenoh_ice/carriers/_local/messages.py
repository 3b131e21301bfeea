"""The messages that pass through a Unix socket: MessagePack, each of at most 64 KiB.

The sockets keep the borders of messages and their order. A payload that is larger than a message lies in
memory that its sender lends; where there is none, and on the way to a servant, it is sent in parts.
"""

from __future__ import annotations

import os
import socket
import struct
import threading
from array import array
from collections.abc import Callable
from typing import Annotated, Any, Final
from weakref import WeakSet

import msgspec
from msgspec import Meta

from zenoh_ice.carriers._local.memory import Arena, ArenaView, Extent
from zenoh_ice.data import typed
from zenoh_ice.data.codec import LARGEST_BULK, Parted, Pieces, too_large
from zenoh_ice.data.exceptions import MarshalException
from zenoh_ice.data.wire import ATTACHMENT_LIMIT

VERSION: Final = 2
"""Of these messages: a process of another release is called over Zenoh."""

LARGEST_MESSAGE: Final = 1 << 16
LARGEST_INLINE: Final = LARGEST_MESSAGE - (1 << 12)
"""Bytes of a payload within a message: the rest of it has room beside it."""

_LARGEST_WHOLE: Final = LARGEST_BULK + (1 << 12)  # bytes of all parts of a payload

HELLO, PART, REQUEST, RESPONSE, RETURN, SUBSCRIBE, SUBSCRIBED, SAMPLE = range(8)
"""The tags of messages."""

encode: Final = msgspec.msgpack.Encoder().encode
"""Encodes a message, given as a tuple that begins with its tag: that is faster than the struct."""

_sockets: Final[WeakSet[socket.socket]] = WeakSet()
_forking: Final = threading.Lock()
"""Held while a socket is made, too: no child has one that it does not know."""

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
    """A call; the next one follows its answer."""

    target: _Name
    operation: _Name
    attachment: _Attachment
    payload: bytes


class Response(msgspec.Struct, array_like=True, tag=RESPONSE):
    """The answer to a call."""

    ok: bool
    payload: bytes
    places: _Places = ()
    """Places of the lent byte sequences in the payload; without any, the only one is the whole payload."""
    extent: Extent | None = None


class Return(msgspec.Struct, array_like=True, tag=RETURN):
    """The lent memory of an answer or a sample was read."""

    start: _Number


class Subscribe(msgspec.Struct, array_like=True, tag=SUBSCRIBE):
    """Samples of a stream are wanted, as long as the channel lasts."""

    target: _Name
    operation: _Name


class Subscribed(msgspec.Struct, array_like=True, tag=SUBSCRIBED):
    """Samples will come, or have come before it; a channel that ends without either has none for now."""


class Sample(msgspec.Struct, array_like=True, tag=SAMPLE):
    """A sample of a stream."""

    attachment: _Attachment
    payload: bytes
    places: _Places = ()
    extent: Extent | None = None


ToServer = Part | Request | Return | Subscribe
ToClient = Part | Response | Subscribed | Sample

decode_hello: Final = typed.msgpack_decoder(Hello)
decode_to_server: Final[Callable[[bytes], Any]] = typed.msgpack_decoder(ToServer)
decode_to_client: Final[Callable[[bytes], Any]] = typed.msgpack_decoder(ToClient)


class Parts(list[bytes]):
    """The parts of a payload that have arrived."""

    def append(self, part: bytes, /) -> None:
        """Keep a part; raises MarshalException for more than any payload has."""
        size = (len(self) + 1) * LARGEST_INLINE
        if size > _LARGEST_WHOLE:
            raise too_large(size, _LARGEST_WHOLE, "payload")
        super().append(part)

    def complete(self, last: bytes) -> bytes:
        """Return the whole payload with its last part, and forget it."""
        whole = b"".join((*self, last))
        self.clear()
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
    payload: bytes | Pieces, arena: Arena | None, *readers: object
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


def collect(received: Response | Sample, view: ArenaView | None, limit: int, what: str) -> bytes | Parted:
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


def limit_sending(connection: socket.socket, seconds: float) -> None:
    """Let the system end a wait to send after some seconds."""
    microseconds = max(1, int(seconds * 1e6))  # 0 would be no limit
    limit = struct.pack("@ll", *divmod(microseconds, 1_000_000))
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)


def new_socket() -> socket.socket:
    """Return a socket for messages between processes of this machine."""
    return socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)


def end_in_children(make: Callable[[], socket.socket]) -> socket.socket:
    """Make a socket that forked children close: its other end is to notice the end of this process."""
    with _forking:
        made = make()
        _sockets.add(made)
    return made


def _close_all() -> None:
    _forking.release()
    for each in tuple(_sockets):
        each.close()


os.register_at_fork(before=_forking.acquire, after_in_parent=_forking.release, after_in_child=_close_all)


def receive_with_file(connection: socket.socket) -> tuple[bytes, int | None]:
    """Return a message with the file that came with it; raises OSError if this process may not open it."""
    # Not socket.recv_fds: that ignores flags in Python 3.11, and children would inherit the file.
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
