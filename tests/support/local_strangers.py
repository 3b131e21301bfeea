"""Strangers at the socket of a server, and servers that do nothing as they should."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Final

from tests.support.limits import EVENT_LIMIT
from zenoh_ice import Communicator
from zenoh_ice.carriers._local.messages import (
    HELLO,
    LARGEST_MESSAGE,
    REQUEST,
    RESPONSE,
    VERSION,
    Request,
    Response,
    decode_hello,
    decode_to_client,
    decode_to_server,
    encode,
    receive_with_file,
)
from zenoh_ice.carriers._local.server import _bind, local_space
from zenoh_ice.data.codec import Pieces
from zenoh_ice.data.keys import parse_servant_token
from zenoh_ice.threads.pool import JobKind
from zenoh_ice.transport import Reply

from .receivers import Taken, Taker
from .stranger import session_of

__all__ = [
    "SERVER",
    "Echo",
    "Visitor",
    "address_of",
    "answer",
    "fake_server",
    "greet",
    "next_request",
]

SERVER: Final = "c0ffee"
"""The id of the session of a server of these tests."""


class Echo(Taker):
    """A receiver that answers every call with its payload, `big` with memory, and `wait` after `leave`."""

    def __init__(self) -> None:
        self.entered: Final = threading.Event()
        self.leave: Final = threading.Event()
        self.left: Final = threading.Semaphore(0)
        self.gone: Final[list[tuple[str, bool]]] = []
        """The operations that were called, and whether their callers had ended."""
        self.kind = JobKind()

    def take(self, call: Taken, reply: Reply) -> Callable[[], object]:
        self.gone.append((call.name, call.gone))
        content = call.payload or b""
        if call.name == "big":
            return partial(reply, True, Pieces((b"", b""), (bytes(1 << 20),), (0,)))
        if call.name == "wait":
            return partial(self._wait, content, reply)
        return partial(reply, True, content)

    def _wait(self, content: bytes, reply: Reply) -> None:
        self.entered.set()
        self.leave.wait(EVENT_LIMIT)
        reply(True, content)
        self.left.release()


class Visitor:
    """A process that connects to a server, and sends whatever it likes."""

    def __init__(self, address: str) -> None:
        _, process, file = address.split(".")
        self.socket: Final = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.settimeout(EVENT_LIMIT)
        try:
            self.socket.connect(f"/proc/{process}/fd/{file}")
        except BaseException:
            self.socket.close()
            raise

    def __enter__(self) -> Visitor:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def enter(self) -> Visitor:
        """Read who the server is; raises ConnectionError if it lets nobody in."""
        message, file = receive_with_file(self.socket)
        if file is not None:
            os.close(file)
        if not message:
            raise ConnectionError("not let in")
        decode_hello(message)
        return self

    def ask(self, target: str, operation: str, payload: bytes = b"") -> None:
        """Send a call."""
        self.socket.send(encode((REQUEST, target, operation, b"", payload)))

    def flood(self, message: bytes) -> None:
        """Send a message again and again; raises OSError when the server takes no more."""
        while True:
            self.socket.send(message)

    def answer(self) -> Response:
        """Return the next answer; raises ConnectionError when there is none."""
        while message := self.socket.recv(LARGEST_MESSAGE):
            received = decode_to_client(message)
            if isinstance(received, Response):
                return received
        raise ConnectionError("no further answer")

    def is_out(self) -> bool:
        """Wait until the server ends the connection; return false if it does not."""
        try:
            while self.socket.recv(LARGEST_MESSAGE):
                pass
        except ConnectionError:
            return True
        except TimeoutError:
            return False
        return True


def address_of(communicator: Communicator, target: str = "nao/Calculator") -> str:
    """Return the address of the server of a servant, as its token says."""
    for reply in session_of(communicator).liveliness().get(f"@servant/{target}/**", timeout=EVENT_LIMIT):
        assert reply.ok is not None
        token = parse_servant_token(str(reply.ok.key_expr))
        if token is not None and token.address:
            return token.address
    raise AssertionError(f"{target} has no address")


Behavior = Callable[[socket.socket], object]


@contextmanager
def fake_server(behave: Behavior) -> Iterator[str]:
    """Give each connection to a function during the block, on a separate thread; provide the address."""
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    handle = _bind(listener)
    listener.listen()
    connections: list[socket.socket] = []
    threads: list[threading.Thread] = []

    def serve(connection: socket.socket) -> None:
        with connection, suppress(OSError):
            behave(connection)

    def accept() -> None:
        with suppress(OSError):
            while True:
                connections.append(listener.accept()[0])
                threads.append(threading.Thread(target=serve, args=connections[-1:], daemon=True))
                threads[-1].start()

    accepting = threading.Thread(target=accept, daemon=True)
    accepting.start()
    try:
        yield f"{local_space()}.{os.getpid()}.{handle}"
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        accepting.join(EVENT_LIMIT)
        for connection in connections:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        for thread in threads:
            thread.join(EVENT_LIMIT)
        listener.close()
        os.close(handle)


def greet(connection: socket.socket, file: int | None = None, server: str = SERVER) -> None:
    """Say who is there, as a server of ours does."""
    socket.send_fds(connection, [encode((HELLO, VERSION, server))], [] if file is None else [file])


def next_request(connection: socket.socket) -> Request:
    """Return the next call; raises ConnectionError when there is none."""
    message = connection.recv(LARGEST_MESSAGE)
    if not message:
        raise ConnectionError("no further call")
    received = decode_to_server(message)
    return received if isinstance(received, Request) else next_request(connection)


def answer(payload: bytes = b"", *where: object) -> bytes:
    """Return the message of an answer."""
    return encode((RESPONSE, True, payload, *where))
