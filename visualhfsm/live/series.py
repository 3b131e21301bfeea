"""Time series of many numbers, in a ring of bounded length, for plots."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["SeriesTable"]

CAPACITY: Final = 18_000
"""Rows kept: half an hour at 10 a second."""
_FIRST: Final = 1024
"""Rows for which there is room at first; it doubles when it is full."""
MOST_COLUMNS: Final = 1000
"""Numbers kept; what comes later is left out. With all rows they take 72 MB."""


class SeriesTable:
    """Numbers by name over time; a number that is missing at a moment is NaN. Not thread safe."""

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._capacity = capacity
        self._room = min(_FIRST, capacity)
        self._times: NDArray[np.float64] = np.full(self._room, np.nan)
        self._columns: dict[str, NDArray[np.float32]] = {}
        self._written = 0

    @property
    def names(self) -> list[str]:
        """The names of the numbers, sorted."""
        return sorted(self._columns)

    def add(self, time: float, numbers: Mapping[str, float]) -> None:
        """Append a row at a time in s that is not before the last."""
        if self._written == self._room < self._capacity:
            self._grow()
        row = self._written % self._room
        self._times[row] = time
        for column in self._columns.values():
            column[row] = np.nan
        for name, value in numbers.items():
            found = self._columns.get(name)
            if found is None:
                if len(self._columns) >= MOST_COLUMNS:
                    continue
                found = self._columns[name] = np.full(self._room, np.nan, np.float32)
            found[row] = value
        self._written += 1

    def read(
        self, names: Sequence[str], start: float, end: float, points: int
    ) -> tuple[list[float], dict[str, list[float | None]]]:
        """Return the times from `start` to `end` and the numbers at them; unknown names are left out.

        Of more rows than `points`, at least 2, those stay at which a number is lowest or highest within its
        share of the time: no peak is lost.
        """
        order = self._order()
        times = self._times[order]
        inside = order[np.searchsorted(times, start) : np.searchsorted(times, end, side="right")]
        columns = {name: self._columns[name][inside] for name in names if name in self._columns}
        kept = _thinned(list(columns.values()), len(inside), max(2, points))
        return (
            self._times[inside][kept].tolist(),
            {name: _without_nan(column[kept]) for name, column in columns.items()},
        )

    def _order(self) -> NDArray[np.intp]:
        """Return the rows from the oldest to the newest."""
        count = min(self._written, self._room)
        return (np.arange(self._written - count, self._written) % self._room).astype(np.intp)

    def _grow(self) -> None:
        room = min(2 * self._room, self._capacity)
        extra = room - self._room
        self._times = np.concatenate([self._times, np.full(extra, np.nan)])
        for name, column in self._columns.items():
            self._columns[name] = np.concatenate([column, np.full(extra, np.nan, np.float32)])
        self._room = room


def _thinned(columns: Sequence[NDArray[np.float32]], count: int, points: int) -> NDArray[np.intp]:
    """Return the rows that stay, in order."""
    if count <= points or not columns:
        step = max(1, -(-count // points))
        return np.arange(0, count, step, dtype=np.intp)
    buckets = max(1, points // (2 * len(columns)))
    edges = np.linspace(0, count, buckets + 1).astype(np.intp)
    kept: set[int] = {0, count - 1}
    for first, last in itertools.pairwise(edges):
        for column in columns:
            part = column[first:last]
            if part.size and not np.isnan(part).all():
                kept |= {int(first + np.nanargmin(part)), int(first + np.nanargmax(part))}
    return np.array(sorted(kept), dtype=np.intp)


def _without_nan(values: NDArray[np.float32]) -> list[float | None]:
    return [None if value != value else value for value in values.tolist()]  # noqa: PLR0124 - NaN
