"""Messages of libqi's protocol, as a program sends them that keeps to no rule, and a libqi that a test plays."""

from __future__ import annotations

import socket
import struct
from typing import Final, NamedTuple, Self

from tests.support.limits import EVENT_LIMIT

__all__ = ["CALL", "ERROR", "POST", "REPLY", "Line", "Message", "text"]

CALL: Final = 1
REPLY: Final = 2
ERROR: Final = 3
POST: Final = 4

_HEADER: Final = struct.Struct("<IIIHBBIII")
_MAGIC: Final = 0x42ADDE42
_WHILE: Final = 0.1


class Message(NamedTuple):
    """A message without its payload."""

    type: int
    number: int
    service: int
    object: int = 1
    action: int = 100


class Line:
    """One end of a connection, until it is closed."""

    def __init__(self, connection: socket.socket) -> None:
        self.connection: Final = connection
        connection.settimeout(EVENT_LIMIT)

    @classmethod
    def to(cls, url: str) -> Self:
        """Connect to an address such as tcp://127.0.0.1:9559."""
        host, _, port = url.removeprefix("tcp://").partition(":")
        return cls(socket.create_connection((host, int(port)), EVENT_LIMIT))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.connection.close()

    def send(self, message: Message, payload: bytes = b"") -> None:
        """Send a message."""
        kind, number, *address = message
        self.connection.sendall(_HEADER.pack(_MAGIC, number, len(payload), 0, kind, 0, *address) + payload)

    def receive(self) -> tuple[Message, bytes]:
        """Return the next message. Raises EOFError at the end of the connection."""
        _, number, size, _, kind, _, *address = _HEADER.unpack(self._exactly(_HEADER.size))
        return Message(kind, number, *address), self._exactly(size)

    def numbers(self, count: int) -> list[int]:
        """Return the numbers of the next messages."""
        return [self.receive()[0].number for _ in range(count)]

    @property
    def silent(self) -> bool:
        """Whether nothing comes for a while."""
        self.connection.settimeout(_WHILE)
        try:
            return not self.connection.recv(1, socket.MSG_PEEK)
        except TimeoutError:
            return True
        finally:
            self.connection.settimeout(EVENT_LIMIT)

    @property
    def ended(self) -> bool:
        """Whether the other side closes it, after whatever it still sends."""
        try:
            while self.connection.recv(1 << 16):
                pass
        except ConnectionResetError:
            pass
        return True

    def _exactly(self, size: int) -> bytes:
        received = b""
        while len(received) < size:
            if not (part := self.connection.recv(size - len(received))):
                raise EOFError
            received += part
        return received


def text(value: str) -> bytes:
    """Return the encoding of a text."""
    return struct.pack("<I", len(value)) + value.encode()
