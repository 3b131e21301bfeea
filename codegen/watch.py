"""Run something again whenever a file that it depends on changes."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import NoReturn

__all__ = ["run_at_changes"]

_INTERVAL = 0.2  # s between two looks at the files
_LARGEST_SHARE = 0.02  # of the time may go into looking
_CLOCK_LAG = 20_000_000  # ns that the time of a file may be behind
_SETTLED = 0.05  # s without a change, so that nobody is read in the middle of writing
_LONGEST_UNREST = 1.0  # s that a file may go on changing before it is read all the same

_Snapshot = dict[Path, tuple[int, int, int] | None]


def run_at_changes(run: Callable[[], Collection[Path]]) -> NoReturn:
    """Call `run` now and at every change of the files or directories that its last call returned.

    Files are looked at five times a second, more seldom when that would take over 2 % of the time. It ends
    by an exception alone, as Ctrl-C raises it.
    """
    before: _Snapshot = {}
    while True:
        started = time.time_ns()
        paths = run()
        before = _wait_for_change(_look_back(before, paths, started))


def _look_back(known: _Snapshot, paths: Collection[Path], started: int) -> _Snapshot:
    """Return what paths were before a run that began at `started`, as they may have changed meanwhile.

    What was known of them counts; of others those that have changed since then are as if they were absent.
    """
    found = _look_at(paths)
    changed = {path: None for path, status in found.items() if status and status[0] > started - _CLOCK_LAG}
    return {**found, **changed, **{path: known[path] for path in paths if path in known}}


def _wait_for_change(before: _Snapshot) -> _Snapshot:
    """Wait until something differs from `before` and has come to rest; return what it is now."""
    while True:
        started = time.monotonic()
        now = _look_at(before)
        if now != before:
            break
        time.sleep(max(_INTERVAL, (time.monotonic() - started) / _LARGEST_SHARE))
    deadline = time.monotonic() + _LONGEST_UNREST
    while time.monotonic() < deadline:
        time.sleep(_SETTLED)
        later = _look_at(now)
        if later == now:
            break
        now = later
    return now


def _look_at(paths: Iterable[Path]) -> _Snapshot:
    """Return what changes when a file does: its time, its size, and its number on disk; None when absent."""
    found: _Snapshot = {}
    for path in paths:
        try:
            status = path.stat()
        except OSError:
            found[path] = None
        else:
            found[path] = (status.st_mtime_ns, status.st_size, status.st_ino)
    return found
