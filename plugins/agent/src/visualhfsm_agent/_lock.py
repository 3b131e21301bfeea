"""One at a time among the agents of a project: locks in our folder, which the kernel releases."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from ._limits import AgentError

_LIMIT: Final = 5.0
_PERIOD: Final = 0.01
"""s"""


@contextmanager
def lock(file: Path, limit: float = _LIMIT) -> Iterator[int]:
    """Hold a lock, for as long as the file that is yielded is open here or in a process that got it.

    Raises AgentError if another holds it for some s, and OSError.
    """
    file.parent.mkdir(exist_ok=True)
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    try:
        deadline = time.monotonic() + limit
        while not _try(descriptor):
            if time.monotonic() >= deadline:
                raise AgentError.because("another agent is at work in this folder: stop what it runs first")
            time.sleep(_PERIOD)
        yield descriptor
    finally:
        os.close(descriptor)


def _try(descriptor: int) -> bool:
    with suppress(BlockingIOError):
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    return False
