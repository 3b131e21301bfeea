"""The files that a process has open."""

from __future__ import annotations

from pathlib import Path

__all__ = ["open_files"]


def open_files(process: int | None = None) -> int:
    """Return the number of open files of a process, or of this one."""
    return len(list(Path("/proc", str(process or "self"), "fd").iterdir()))
