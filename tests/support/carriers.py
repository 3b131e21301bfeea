"""What carries calls between processes of one machine: local sockets or the network, and which of both does."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest
import zenoh

from tests.support.soak import cases
from tests.support.waiting import until
from zenoh_ice import Communicator
from zenoh_ice.data.keys import Target, parse_servant_token, servant_token

if TYPE_CHECKING:
    from tests.support.suite import Pair

__all__ = [
    "COLLOCATED",
    "LOCAL",
    "LOCAL_SOCKETS",
    "NETWORK",
    "anywhere",
    "calls_over_network",
    "cut_local_connections",
    "everywhere",
    "is_used",
    "local_connections",
    "over_both",
    "over_one",
    "two_servers",
]

LOCAL: Final = "local"
NETWORK: Final = "network"
COLLOCATED: Final = "collocated"

LOCAL_SOCKETS: Final = "VISUALHFSM_LOCAL_SOCKETS"
"""The environment variable that turns the sockets off."""

over_both: Final = pytest.mark.parametrize("carrier", [LOCAL, NETWORK])
"""Runs a test of calls between processes over both carriers; `make_communicator` makes their clients."""

everywhere: Final = pytest.mark.parametrize("carrier", [LOCAL, NETWORK, COLLOCATED])
"""Runs a test also with the communicator that serves as the caller."""

over_one: Final = pytest.mark.parametrize("carrier", cases([LOCAL], [NETWORK]))
"""Runs a test of what no carrier changes over one of both, and in soak over the other."""

anywhere: Final = pytest.mark.parametrize("carrier", cases([LOCAL], [NETWORK, COLLOCATED]))
"""Runs such a test in soak also with the communicator that serves as the caller."""

_SEQPACKET: Final = "0005"
_CONNECTED: Final = "03"


def local_connections(pid: int | None = None) -> int:
    """Return how many ends of local connections a process has, by default this one."""
    return len(_local_files(pid or os.getpid()))


def is_used(carrier: str, pid: int | None = None) -> bool:
    """Return whether a process, which has called or was called, did so over a carrier."""
    return (local_connections(pid) > 0) is (carrier == LOCAL)


def cut_local_connections() -> None:
    """End all local connections of this process, as if they broke, but none that are made meanwhile."""
    with ExitStack() as copies:
        ends = []
        for file in _local_files(os.getpid()):
            with suppress(OSError):  # it was closed meanwhile
                ends.append(copies.enter_context(socket.socket(fileno=os.dup(file))))
        for end in ends:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)


def calls_over_network(server: Communicator) -> list[str]:
    """Return a list that notes the key of each call that reaches a server over the network from now on."""
    noted: list[str] = []
    pool = server.pool
    place = pool.place

    def noting(query: zenoh.Query) -> Any:
        noted.append(str(query.key_expr))
        return place(query)

    pool.place = noting
    return noted


@contextmanager
def two_servers(pair: Pair, target: Target, type_id: str) -> Iterator[None]:
    """Let a target seem to have another server, too, so that the client calls it over the network."""
    servers: set[str] = set()

    def note(key: str, came: bool) -> None:
        token = parse_servant_token(key)
        if token is not None and token.target == target:
            (servers.add if came else servers.discard)(token.server)

    # Called after the routes, which were there before.
    watch = pair.client.transport.watch(f"@servant/{target.realm}/**", note)
    token = pair.server.transport.announce(servant_token(target, type_id, "", "c0ffee", 1.0))
    until(lambda: len(servers) == 2)
    try:
        yield
    finally:
        token.close()
        until(lambda: len(servers) == 1)
        watch.close()


def _local_files(pid: int) -> list[int]:
    """Return the descriptors of the ends of local connections that a process has."""
    connected = set()
    for line in Path("/proc/net/unix").read_text().splitlines()[1:]:
        _, _, _, _, kind, state, inode, *_ = line.split()
        if (kind, state) == (_SEQPACKET, _CONNECTED):
            connected.add(f"socket:[{inode}]")
    found = []
    for file in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(OSError):  # it was closed meanwhile
            if str(file.readlink()) in connected:
                found.append(int(file.name))
    return found
