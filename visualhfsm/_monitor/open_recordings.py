"""The recordings that windows look at."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from visualhfsm._monitor.realm.description import DescribedRobot

from .recordings import RecordedRun, open_recording

_PREFIX: Final = "recording:"
_MOST_IN_MEMORY: Final = 4


class _Opened(NamedTuple):
    path: Path
    described: DescribedRobot


class OpenRecordings:
    """Recordings by the names that `open` gives them; each stays open until `close`.

    Those that were asked for last are in memory; the file of another one is read again when somebody asks.
    """

    def __init__(self) -> None:
        self._opened: Final[dict[str, _Opened]] = {}
        self._in_memory: Final[dict[str, RecordedRun]] = {}
        self._numbers: Final = itertools.count(1)
        self._reads: Final = asyncio.Lock()

    async def open(self, path: Path) -> tuple[str, RecordedRun]:
        """Open a recording; return its name and the run. Raises VisualHfsmError."""
        run = await asyncio.to_thread(open_recording, path)
        name = f"{_PREFIX}{next(self._numbers)}:{path.name}"
        self._opened[name] = _Opened(path, run.described)
        self._keep(name, run)
        return name, run

    async def get(self, name: str) -> RecordedRun | None:
        """Return an open recording, None for another name. Raises VisualHfsmError if its file is gone."""
        if name not in self._opened:
            return None
        async with self._reads:
            opened, run = self._opened.get(name), self._in_memory.pop(name, None)
            if run is None and opened is not None:
                run = await asyncio.to_thread(open_recording, opened.path)
            if run is None or name not in self._opened:
                return None  # it was closed meanwhile
            self._keep(name, run)
            return run

    def close(self, name: str) -> None:
        """Close a recording, if it is open."""
        self._opened.pop(name, None)
        self._in_memory.pop(name, None)

    def described(self) -> Iterator[DescribedRobot]:
        """Yield the robots of the open recordings."""
        for each in self._opened.values():
            yield each.described

    def _keep(self, name: str, run: RecordedRun) -> None:
        self._in_memory[name] = run
        while len(self._in_memory) > _MOST_IN_MEMORY:
            del self._in_memory[next(iter(self._in_memory))]
