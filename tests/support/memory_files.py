"""The memory that processes lend to each other, as the system counts it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

__all__ = ["lent_bytes", "open_memory_files", "shared_maps"]

_NAME = "/memfd:zenoh_ice"


def open_memory_files() -> int:
    """Return the number of memory files that this process has open."""
    return sum(1 for _ in _memory_files())


def lent_bytes() -> int:
    """Return how many bytes this process has ever lent at the same time, since it has its memory files."""
    states = [path.stat() for path in _memory_files()]
    return sum({state.st_ino: 512 * state.st_blocks for state in states}.values())


def shared_maps() -> int:
    """Return how many maps of memory files this process has: its own, and those of others."""
    return sum(f" {_NAME}" in line for line in Path("/proc/self/maps").read_text().splitlines())


def _memory_files() -> Iterator[Path]:
    for path in Path("/proc/self/fd").iterdir():
        try:
            if str(path.readlink()).startswith(_NAME):
                yield path
        except FileNotFoundError:  # that of the folder itself
            continue
