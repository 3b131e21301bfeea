"""Directories for a while, of which none outlives its process for long, however that ends.

Each holds a lock that the system takes away when the process dies. Whoever comes next deletes what is not
locked any more.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import stat
import tempfile
from pathlib import Path
from typing import Final

__all__ = ["ScratchDirectory", "delete_abandoned"]

_PREFIX: Final = "visualhfsm-scratch-"
_LOCK: Final = ".lock"


class ScratchDirectory:
    """A directory that only this user may look into; `close` deletes it."""

    def __init__(self) -> None:
        """Raises OSError when there is no room for one."""
        while True:
            self.path = Path(tempfile.mkdtemp(prefix=_PREFIX))
            self._lock = os.open(self.path / _LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            fcntl.flock(self._lock, fcntl.LOCK_EX)
            if (self.path / _LOCK).exists():
                return
            os.close(self._lock)  # somebody took it for abandoned in the moment before it was locked

    def close(self) -> None:
        """Delete it with all that it holds."""
        shutil.rmtree(self.path, ignore_errors=True)
        os.close(self._lock)


def delete_abandoned() -> None:
    """Delete the directories of this user's processes that have died without doing so."""
    for directory in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
        try:
            status = directory.lstat()
            if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid():
                continue
            lock = os.open(directory / _LOCK, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
        except OSError:  # it is gone, or was not locked yet
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(directory, ignore_errors=True)
        except BlockingIOError:  # its process is alive
            pass
        finally:
            os.close(lock)
