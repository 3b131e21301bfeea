"""Relay data between two processes like a network; hold, delay, corrupt or cut it on request."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

from tests.support.limits import EVENT_LIMIT

__all__ = ["Relay"]

_BUFFER = 1 << 16
_RESET = struct.pack("ii", 1, 0)  # of SO_LINGER: closing throws away what was not sent, and says so


class Relay:
    """Forwards TCP connections to an endpoint; leaving the `with` block ends them."""

    def __init__(self, endpoint: str) -> None:
        host, port = endpoint.removeprefix("tcp/").rsplit(":", 1)
        self._server = (host, int(port))
        self._flowing = threading.Event()
        self._flowing.set()
        self._garble: Callable[[bytearray], object] | None = None
        self._delay = 0.0
        self._is_cut = False
        self._lock = threading.Lock()
        self._sockets: list[socket.socket] = []
        self._threads: list[threading.Thread] = []
        self._door = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self._door.getsockname()[1]}"
        self.passed = 0
        """Bytes forwarded so far, in both directions."""

    def hold(self) -> None:
        """Forward nothing until `resume`, and keep the connections: like an unplugged cable."""
        self._flowing.clear()

    def delay(self, seconds: float) -> None:
        """Delay all data by some s, until `resume`."""
        self._delay = seconds

    def garble(self, change: Callable[[bytearray], object]) -> None:
        """Change all data with a function, until `resume`."""
        self._garble = change

    def cut(self) -> None:
        """Break all connections, also new ones, until `resume`."""
        with self._lock:
            self._is_cut = True
            for end in self._sockets:
                _reset(end)

    def resume(self) -> None:
        """Forward the held data and all further data unchanged."""
        self._garble = None
        self._delay = 0.0
        self._is_cut = False
        self._flowing.set()

    def __enter__(self) -> Self:
        self._start(self._accept)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._door.shutdown(socket.SHUT_RDWR)
        self._threads[0].join(EVENT_LIMIT)
        self.cut()
        self._flowing.set()
        for thread in self._threads:
            thread.join(EVENT_LIMIT)
        for end in (self._door, *self._sockets):
            end.close()

    def _start(self, function: Callable[..., object], *arguments: Any) -> None:
        thread = threading.Thread(target=function, args=arguments, name="relay", daemon=True)
        self._threads.append(thread)
        thread.start()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._door.accept()
            except OSError:
                return
            try:
                server = socket.create_connection(self._server)
            except OSError:
                client.close()
                continue
            with self._lock:
                self._sockets += [client, server]
                if self._is_cut:
                    _reset(client)
                    _reset(server)
            self._start(self._pass, client, server)
            self._start(self._pass, server, client)

    def _pass(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(_BUFFER):
                self._flowing.wait()
                if self._delay:
                    time.sleep(self._delay)
                if (garble := self._garble) is not None:
                    changed = bytearray(data)
                    garble(changed)
                    data = bytes(changed)
                sink.sendall(data)
                self.passed += len(data)
        for end in (source, sink):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)


def _reset(end: socket.socket) -> None:
    with suppress(OSError):
        end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
        end.shutdown(socket.SHUT_RDWR)
