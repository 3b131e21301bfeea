"""What carries calls between processes of one machine: local sockets or the network, and which of both does."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import Final

import pytest

__all__ = [
    "COLLOCATED",
    "LOCAL",
    "LOCAL_SOCKETS",
    "NETWORK",
    "everywhere",
    "is_used",
    "local_connections",
    "over_both",
]

LOCAL: Final = "local"
NETWORK: Final = "network"
COLLOCATED: Final = "collocated"

LOCAL_SOCKETS: Final = "VISUALHFSM_LOCAL_SOCKETS"
"""The environment variable that turns the sockets off."""

over_both: Final = pytest.mark.parametrize("carrier", [LOCAL, NETWORK])
"""Runs a test of calls between processes over both carriers; `make_communicator` makes their clients."""

everywhere: Final = pytest.mark.parametrize("carrier", [LOCAL, NETWORK, COLLOCATED])
"""Runs a test also where it calls a servant of its own communicator."""

_SEQPACKET: Final = "0005"
_CONNECTED: Final = "03"


def local_connections(pid: int | None = None) -> int:
    """Return how many ends of local connections a process has, by default this one."""
    connected = set()
    for line in Path("/proc/net/unix").read_text().splitlines()[1:]:
        _, _, _, _, kind, state, inode, *_ = line.split()
        if (kind, state) == (_SEQPACKET, _CONNECTED):
            connected.add(f"socket:[{inode}]")
    count = 0
    for file in Path(f"/proc/{pid or os.getpid()}/fd").iterdir():
        with suppress(OSError):  # it was closed meanwhile
            count += str(file.readlink()) in connected
    return count


def is_used(carrier: str, pid: int | None = None) -> bool:
    """Return whether a process, which has called or was called, did so over a carrier."""
    return (local_connections(pid) > 0) is (carrier == LOCAL)
