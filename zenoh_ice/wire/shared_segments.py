"""The files of shared memory: the pools of this process, and those of processes that ended.

Zenoh maps the pool of every process that has sent to this one and never lets go of it, so that a program that
outlives many restarts of a server of images would hold the memory of all of them (zenoh#2787). From outside
that memory can be given back. The maps and the files stay, empty, as Zenoh must not give a new pool the name
of one that it has mapped.
"""

from __future__ import annotations

import fcntl
import logging
import math
import mmap
import os
import re
import stat
import struct
import time
from contextlib import suppress
from pathlib import Path
from typing import Final

__all__ = ["GRACE", "claim", "mapped_segments", "sweep", "sweep_now_and_then"]

GRACE: Final = 5.0
"""Seconds for which what a process that ended has sent can still be read."""

_FOLDER: Final = Path("/dev/shm")  # noqa: S108 - where the system has its shared memory
_MAPPED: Final = re.compile(rf"{_FOLDER}/(\d+\.zenoh)$", re.M)

# Who made a pool holds a lock on it, which the system takes back when he ends, however he does. The sticky
# bit, which means nothing on a file, tells that it was made by us; it is executable once its maker is missed.
_OURS: Final = stat.S_ISVTX
_MISSED: Final = stat.S_IXUSR
_WRITE_LOCK: Final = struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)

_swept = -math.inf  # when, on the monotonic clock
_BLOCK: Final = 512  # bytes, in which the system counts what a file takes

_logger = logging.getLogger(__name__)


def mapped_segments() -> set[str]:
    """Return the names of the segments that this process has mapped; none where the system does not tell."""
    try:
        maps = Path("/proc/self/maps").read_text("utf-8", "replace")
    except OSError:
        return set()
    return set(_MAPPED.findall(maps))


def claim(name: str, size: int) -> int | None:
    """Tell that this process made a pool; return the file that holds the claim until it is closed.

    None when another has claimed it, or it is of another size, and so is no pool.
    """
    with suppress(OSError):
        file = os.open(_FOLDER / name, os.O_RDWR)
        try:
            if os.fstat(file).st_size != size:
                raise FileNotFoundError(name)
            fcntl.fcntl(file, fcntl.F_OFD_SETLK, _WRITE_LOCK)
            os.fchmod(file, stat.S_IMODE(os.fstat(file).st_mode) | _OURS)
        except OSError:
            os.close(file)
            raise
        return file
    return None


def sweep(grace: float = GRACE) -> int:
    """Give back the memory of those whose maker ended more than `grace` s ago; return how many bytes.

    It must be called more than once: at first it only notes whose maker is missed. What was sent and is read
    afterwards is all zeros.
    """
    return sum(_give_back(path, grace) for path in _FOLDER.glob("*.zenoh"))


def sweep_now_and_then() -> None:
    """Sweep, unless this process has just done so."""
    global _swept  # noqa: PLW0603 - so are the segments, the process's
    now = time.monotonic()
    if now - _swept >= GRACE:
        _swept = now
        sweep()


def _give_back(path: Path, grace: float) -> int:
    try:
        file = os.open(path, os.O_RDWR | os.O_NOFOLLOW)
    except OSError:  # another user's, or gone
        return 0
    try:
        about = os.fstat(file)
        if not about.st_mode & _OURS or about.st_blocks == 0:
            return 0
        fcntl.fcntl(file, fcntl.F_OFD_SETLK, _WRITE_LOCK)
        if not about.st_mode & _MISSED:
            os.fchmod(file, stat.S_IMODE(about.st_mode) | _MISSED)
            return 0
        if time.time() - about.st_ctime < grace:
            return 0
        with mmap.mmap(file, about.st_size) as memory:
            memory.madvise(mmap.MADV_REMOVE)
    except OSError as error:  # its maker lives, usually
        _logger.debug("%s stays: %s", path, error)
        return 0
    finally:
        os.close(file)
    _logger.debug("gave back the memory of %s", path)
    return about.st_blocks * _BLOCK
