"""A file in which a component keeps what it is executing, for the process that started it.

A process that is killed, or that its own code ends at once, reports nothing any more; the pages that it has
written to shared memory stay. The one that starts it names the file in the environment.
"""

from __future__ import annotations

import mmap
import os
import struct
import threading
import time
from pathlib import Path
from typing import Final, NamedTuple

VARIABLE: Final = "HFSM_LAST_CYCLE"
"""The variable of the environment that has the path of the file."""

_RECORD: Final = struct.Struct("<qqqq?7x")  # when in ns, automaton, state, transition, whether the cycle runs
_AUTOMATA: Final = 4096
"""Automata that have a record; further ones have none."""
_SIZE: Final = (1 + _AUTOMATA) * _RECORD.size
"""Bytes of the file. Its first byte says whether the process ends in an orderly way; the records follow."""


class LastCycle(NamedTuple):
    """The cycle that began last, of those that were running if there were any.

    All are ids of the document. Its `transition` was firing, unless it is 0: then the `state` was current.
    """

    automaton: int
    state: int
    transition: int
    running: bool


class CycleFile:
    """The component's end of the file. Closing it says that the process ends in an orderly way."""

    def __init__(self, path: Path) -> None:
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), _SIZE)
        self._places: dict[int, int] = {}
        self._lock = threading.Lock()

    @classmethod
    def of_parent(cls) -> CycleFile | None:
        """Open the file that the environment names, if it does; child processes do not inherit it."""
        path = os.environ.pop(VARIABLE, "")
        try:
            return cls(Path(path)) if path else None
        except (OSError, ValueError):  # it is gone with the one that made it
            return None

    def write(self, automaton: int, state: int, transition: int = 0, *, running: bool = True) -> None:
        """Keep what an automaton executes."""
        place = self._places.get(automaton)
        if place is None:
            place = self._add(automaton)
        if place < _SIZE:
            _RECORD.pack_into(self._memory, place, time.monotonic_ns(), automaton, state, transition, running)

    def close(self) -> None:
        """Note that the process ends in an orderly way."""
        self._memory[0] = 1  # it stays mapped: a cycle that was abandoned may still write

    def _add(self, automaton: int) -> int:
        with self._lock:
            return self._places.setdefault(automaton, (1 + len(self._places)) * _RECORD.size)


def create(path: Path) -> None:
    """Make an empty file for one run of a component. Raises OSError."""
    with path.open("wb") as file:
        file.truncate(_SIZE)


def read(path: Path) -> LastCycle | None:
    """Return what a process executed when it ended; None if it ended in an orderly way, or before a cycle."""
    try:
        written = path.read_bytes()
    except OSError:
        return None
    if len(written) != _SIZE or written[0]:
        return None
    found = [record for record in _RECORD.iter_unpack(written) if record[0]]
    if not found:
        return None
    _, automaton, state, transition, running = max(found, key=lambda record: (record[4], record[0]))
    return LastCycle(automaton, state, transition, running)
