"""The distribution of a call's time: the processor time of each thread of both processes."""

from __future__ import annotations

import re
import threading
from collections import defaultdict
from pathlib import Path
from typing import Final

from .figures import spread
from .processes import Worker

_TASKS: Final = Path("/proc/self/task")
_NUMBER: Final = re.compile(r"[-_ ]?\d+$")
_LEAST: Final = 0.3  # us per call below which a thread is not listed
_CALLS: Final = 1000


def thread_times() -> dict[str, float]:
    """Return the processor time of this process in us by thread; those of a pool are added up."""
    python = {thread.native_id: thread.name for thread in threading.enumerate()}
    times: defaultdict[str, float] = defaultdict(float)
    for task in _TASKS.iterdir():
        try:
            name = python.get(int(task.name)) or (task / "comm").read_text().strip()
            nanoseconds = int((task / "schedstat").read_text().split()[0])
        except (FileNotFoundError, ProcessLookupError):  # it has ended
            continue
        times[_NUMBER.sub("", name)] += nanoseconds / 1e3
    return dict(times)


def spent(server: Worker, client: Worker) -> dict[tuple[str, str], float]:
    """Return the processor time of a call in us, by side and thread."""
    sides = {"client": client, "server": server}
    before = {name: side.do("thread_times") for name, side in sides.items()}
    client.do("call", operation="step", count=_CALLS)
    return {
        (name, thread): (time - before[name].get(thread, 0.0)) / _CALLS
        for name, side in sides.items()
        for thread, time in side.do("thread_times").items()
    }


def rows(kind: str, rounds: list[dict[tuple[str, str], float]]) -> list[list[str]]:
    """Return the rows of a table: kind, side, thread, and the median of us per call."""
    found = []
    for name, thread in rounds[-1]:
        each = spread([one.get((name, thread), 0.0) for one in rounds])
        if each.median >= _LEAST:
            found.append((name, -each.median, [kind, name, thread, str(each)]))
    return [row for _, _, row in sorted(found)]
