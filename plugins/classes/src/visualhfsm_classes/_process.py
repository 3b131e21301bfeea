"""The process of a submission's code as the kernel sees it: its processor time, and its threads."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from typing import Final

_NANOSECONDS: Final = 1e-9


class CodeProcess:
    """The process of the code: the innermost below one that makes walls.

    A process that has ended has used nothing more, and has no threads.
    """

    def __init__(self, outermost: int) -> None:
        self._outermost: Final = outermost
        self._innermost = 0
        self._used = 0.0

    def find(self) -> None:
        """Look which process it is, now that it runs code."""
        self._innermost = _innermost(self._outermost)

    def used(self) -> float:
        """Return the s of processor time that it has used since the last call."""
        process = self._innermost or _innermost(self._outermost)
        used = self._used
        with suppress(OSError):
            used = time.clock_gettime(
                ~process << 3 | 2
            )  # CPUCLOCK_SCHED of a process: clock_getcpuclockid(3)
        before, self._used = self._used, max(self._used, used)
        return self._used - before

    def queued(self) -> float:
        """Return for how many s altogether its first thread has waited for a processor."""
        with suppress(OSError, IndexError, ValueError):
            return int(self._file("schedstat").read_text().split()[1]) * _NANOSECONDS
        return 0.0

    def threads(self) -> int:
        """Return the number of its threads."""
        with suppress(OSError):
            return sum(1 for _ in self._file("task").iterdir())
        return 0

    def _file(self, name: str) -> Path:
        return Path(f"/proc/{self._innermost or _innermost(self._outermost)}", name)


def _innermost(process: int) -> int:
    """Return the last of a chain of processes that each started the next one."""
    while True:
        try:
            children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
        except OSError:
            return process
        if not children:
            return process
        process = int(children[0])
