"""Shared memory between two ends in this process, and a count of the existing memory files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from zenoh_ice._presence import client_token
from zenoh_ice._zenoh.shared_memory import SharedMemory, memory_space
from zenoh_ice.transport import Served

__all__ = ["NEAR", "mapped", "open_memory_files", "shared_maps", "shared_memory"]

NEAR = "c0ffee"
"""The id of a client that can read the memory of this process."""

_NAME = "/memfd:zenoh_ice-"


def shared_memory(
    *,
    enabled: bool = True,
    tokens: Callable[[Callable[[str, bool], object]], object] | None = None,
    on_unreadable: Callable[[], object] = lambda: None,
) -> SharedMemory:
    """Return the shared memory of a process in a realm whose only client is `NEAR`.

    `tokens` gets the function that takes the tokens of other clients instead.
    """

    def watch(changed: Callable[[str, bool], object]) -> Served:
        if tokens is None:
            changed(client_token("nao", NEAR, memory_space()), True)
        else:
            tokens(changed)
        return Served(lambda: None)

    return SharedMemory(enabled=enabled, watch_clients=watch, on_unreadable=on_unreadable)


def open_memory_files() -> int:
    """Return the number of open memory files; a mapped file counts as open."""
    links = []
    for path in Path("/proc/self/fd").iterdir():
        try:
            links.append(str(path.readlink()))
        except FileNotFoundError:  # that of the folder itself
            continue
    return sum(_NAME in link for link in links)


def shared_maps() -> int:
    """Return the number of mapped memory files."""
    return len(mapped(_NAME))


def mapped(name: str) -> set[str]:
    """Return the memory maps of this process of files with a prefix."""
    return {line for line in Path("/proc/self/maps").read_text().splitlines() if f" {name}" in line}
