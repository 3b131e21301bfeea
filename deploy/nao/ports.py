"""Look at endpoints without Zenoh: whether something listens there, and which process does."""

from __future__ import annotations

import re
import socket
from pathlib import Path
from typing import Final

__all__ = ["holder_of", "listens"]

_ADDRESS: Final = re.compile(r"\w+/(?:\[(?P<v6>[^]]+)\]|(?P<v4>[^:]+)):(?P<port>\d+)")
_LIMIT: Final = 1.0  # s for a connection
_LISTENING: Final = "0A"  # state in /proc/net/tcp


def listens(endpoint: str) -> bool | None:
    """Return whether something takes connections at an endpoint; None when that cannot be told."""
    protocol, _, path = endpoint.partition("/")
    if protocol == "unixsock-stream":
        return Path(path).exists()
    match = _ADDRESS.match(endpoint)
    if match is None or protocol not in {"tcp", "tls", "ws"}:
        return None
    try:
        with socket.create_connection((match["v6"] or match["v4"], int(match["port"])), timeout=_LIMIT):
            return True
    except OSError:
        return False


def holder_of(endpoint: str) -> str:
    """Return which process of this machine listens at an endpoint: `naoserver-sim 4711`; empty if unknown."""
    match = _ADDRESS.match(endpoint)
    if match is None:
        return ""
    inodes = _listening_inodes(int(match["port"]))
    for descriptor in Path("/proc").glob("[0-9]*/fd/*") if inodes else ():
        try:
            target = str(descriptor.readlink())
        except OSError:  # another user's, or gone
            continue
        if target.startswith("socket:[") and target[8:-1] in inodes:
            process = descriptor.parts[2]
            return f"{_command_of(process)} {process}"
    return ""


def _listening_inodes(port: int) -> set[str]:
    found = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        try:
            rows = Path(table).read_text().splitlines()[1:]
        except OSError:
            continue
        for row in rows:
            cells = row.split()
            if cells[3] == _LISTENING and int(cells[1].rpartition(":")[2], 16) == port:
                found.add(cells[9])
    return found


def _command_of(process: str) -> str:
    """Return the program of a process, of a Python the script or module that it runs."""
    try:
        words = Path(f"/proc/{process}/cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        words = []
    names = [Path(word).name for word in words if word] or ["process"]
    scripts = [name for name in names[1:] if not name.startswith("-")]
    return scripts[0] if scripts and names[0].startswith("python") else names[0]
