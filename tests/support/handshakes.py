"""Clients that begin a TLS handshake, and do not go on."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Final

from tests.support.limits import EVENT_LIMIT
from zenoh_ice.settings import host_and_port

__all__ = ["RECORD", "ended", "holding", "place_of"]

RECORD: Final = b"\x16\x03\x01"
"""The beginning of a handshake."""


def place_of(endpoint: str) -> tuple[str, int]:
    """Return the host and the port of an endpoint."""
    place = host_and_port(endpoint)
    assert place is not None
    return place


@contextmanager
def holding(endpoint: str, number: int, first: bytes) -> Iterator[list[socket.socket]]:
    """Hold connections that send some bytes and then nothing."""
    with ExitStack() as held:
        connections = [
            held.enter_context(socket.create_connection(place_of(endpoint), EVENT_LIMIT))
            for _ in range(number)
        ]
        for connection in connections:
            connection.sendall(first)
        yield connections


def ended(connection: socket.socket) -> bool:
    """Wait for the end of a connection."""
    connection.settimeout(EVENT_LIMIT)
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True
