"""TCP ports on which servers of the tests listen, each reserved for one caller on the whole machine."""

from __future__ import annotations

import fcntl
import os
import socket
import tempfile
import threading
from collections.abc import Iterable, Iterator
from itertools import cycle, islice
from pathlib import Path
from random import Random
from typing import Final

__all__ = ["Ports", "free_port", "server_ports"]

_PORT_RANGE: Final = Path("/proc/sys/net/ipv4/ip_local_port_range")
_FIRST: Final = 11_000
"""Above the last port that browsers refuse, 10080."""


def server_ports(ephemeral: Iterable[int]) -> list[int]:
    """Return every second port but those that the system gives sockets by itself, and their neighbors.

    Those are `ephemeral`: port 0 and outgoing connections get them, at any moment. The port after each that is
    returned belongs to it: a second robot listens there. Without any other ports, these are the ephemeral ones.
    """
    usable, unsafe = range(_FIRST, 1 << 16, 2), frozenset(ephemeral)
    return [port for port in usable if unsafe.isdisjoint((port, port + 1))] or [*usable]


def _bindable(port: int) -> bool:
    """Return whether no socket has a port, at any address, and no connection that has just ended."""
    with socket.socket() as probe:  # without SO_REUSEADDR, which servers set
        try:
            probe.bind(("", port))
        except OSError:
            return False
    return True


class Ports:
    """TCP ports that are given to one caller each, until all have been given. Thread-safe.

    A port that is free now may not be when a server begins to listen on it, or listens on it again after a restart:
    until then nothing but a reservation says that it is taken. A reserved port is a locked byte of a file. The system
    releases the locks of a process at its end, however it ends.
    """

    def __init__(self, ports: Iterable[int], reservations: Path) -> None:
        """Give these ports, in random order; the processes of the machine share the file `reservations`."""
        self._ports: Final = [*ports]
        Random().shuffle(
            self._ports
        )  # not by the global generator: tests seed it, so that workers get the same
        self._next: Final[Iterator[int]] = cycle(self._ports)
        self._path: Final = reservations
        self._lock: Final = threading.Lock()
        self._file: int | None = None

    def take(self) -> int:
        """Return a port that is reserved for the caller until this process ends.

        Once all have been given, it returns one that was given before and is free again. Raises RuntimeError when
        there is none.
        """
        with self._lock:
            for port in islice(self._next, len(self._ports)):
                if self._reserve(port) and _bindable(port) and _bindable(port + 1):
                    return port
        raise RuntimeError(f"none of {len(self._ports)} ports is free: end other runs of the tests")

    def close(self) -> None:
        """Release the ports."""
        with self._lock:
            if self._file is not None:
                os.close(self._file)
                self._file = None

    def _reserve(self, port: int) -> bool:
        """Lock the byte of a port; return whether no other process has locked it."""
        if self._file is None:
            # Opened once: closing any descriptor of the file releases all locks of the process.
            self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, port)
        except (BlockingIOError, PermissionError):
            return False
        return True


def _ephemeral_ports() -> range:
    try:
        first, last = map(int, _PORT_RANGE.read_text().split())
    except FileNotFoundError:  # another system than Linux: all that are usual
        first, last = 32_768, 65_535
    return range(first, last + 1)


_PORTS: Final = Ports(
    server_ports(_ephemeral_ports()), Path(tempfile.gettempdir(), f"visualhfsm-test-ports-{os.getuid()}")
)


def free_port() -> int:
    """Return a TCP port that no other test uses on this machine, nor any program at the moment.

    The port after it is free, too.
    """
    return _PORTS.take()
