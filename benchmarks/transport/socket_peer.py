"""The lower bound of a call: a blocking TCP socket, and MessagePack."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Final

import msgpack

from .content import POSE

_MOST: Final = 4096
_LIMIT: Final = 10.0


class SocketClient:
    """A connection."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection

    def step(self) -> object:
        """Call with four doubles there and back."""
        self._connection.sendall(msgpack.packb(POSE))
        return msgpack.unpackb(self._connection.recv(_MOST))


@contextmanager
def serve(endpoint: str) -> Iterator[None]:
    """Serve one connection on an endpoint."""
    with socket.create_server(_address(endpoint)) as listener:
        thread = threading.Thread(target=_answer, args=(listener,), daemon=True)
        thread.start()
        yield


@contextmanager
def connect(endpoint: str) -> Iterator[SocketClient]:
    """Connect to a server."""
    with socket.create_connection(_address(endpoint), _LIMIT) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        yield SocketClient(connection)


def _answer(listener: socket.socket) -> None:
    with suppress(OSError):  # the peer disconnects
        connection, _ = listener.accept()
        with connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            while request := connection.recv(_MOST):
                connection.sendall(msgpack.packb(msgpack.unpackb(request)))


def _address(endpoint: str) -> tuple[str, int]:
    host, port = endpoint.removeprefix("tcp/").split(":")
    return host, int(port)
