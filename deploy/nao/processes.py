"""Ask the processes that serve in a realm about themselves, all at once."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Final

from zenoh_ice import Communicator, ZenohIceError
from zenoh_ice.network.process_status import ProcessStatus
from zenoh_ice.wire.text import printable

__all__ = ["ask_processes", "process_name"]

_LIMIT: Final = 1.0
"""Seconds within which a process tells its status; one that does not hangs."""
_AT_ONCE: Final = 16


def ask_processes(
    communicator: Communicator, servers: Iterable[str]
) -> dict[str, ProcessStatus | ZenohIceError]:
    """Return the status of each process by the id of its session, or why it could not be had."""
    ids = sorted(set(servers))

    def ask(server: str) -> ProcessStatus | ZenohIceError:
        try:
            return communicator.processStatus(server, timeout=min(_LIMIT, communicator.settings.timeout))
        except ZenohIceError as error:
            return error

    with ThreadPoolExecutor(max_workers=_AT_ONCE) as pool:
        return dict(zip(ids, pool.map(ask, ids), strict=True))


def process_name(status: ProcessStatus | ZenohIceError | None, server: str) -> str:
    """Return program and number of a process, or the beginning of its session's id."""
    if isinstance(status, ProcessStatus):
        return printable(f"{status.program} {status.pid}")
    return f"? ({server[:8]})"
