"""What a component did: every moment of it, to scrub back through, in bounded memory."""

from __future__ import annotations

import bisect
import threading
import zlib
from collections import deque
from collections.abc import Sequence
from typing import Any, Final

import msgspec

from visualhfsm.watch.state_log import StateLog

from .series import SeriesTable
from .values import LiveSnapshot, numbers_of

__all__ = ["History", "Timeline"]

LARGEST: Final = 48 << 20
"""Bytes of packed moments that are kept; an hour of a component of five automata takes about half of it."""
_INTERVAL: Final = 0.05
"""Seconds of component time between two moments that are kept, unless a state changes."""
_FASTEST: Final = 1

_encoder = msgspec.json.Encoder()


class Timeline(msgspec.Struct, frozen=True, rename="camel"):
    """The whole of what is kept: from when to when, and how the states changed.

    A change is [time, automaton, origin, destination, transition], a span [automaton, state, whether it was a
    ghost, start, end]. Times are the component's in s; `numbers` are the names of what can be plotted.
    """

    start: float
    end: float
    changes: list[tuple[float, int, int, int, int]]
    spans: list[tuple[int, int, bool, float, float]]
    numbers: list[str]


class History:
    """The moments of one run, the newest that fit. It may be used from any thread."""

    def __init__(self, largest: int = LARGEST, interval: float = _INTERVAL) -> None:
        self._largest = largest
        self._interval = interval
        self._lock = threading.Lock()
        self._times: deque[float] = deque()
        self._packed: deque[bytes] = deque()
        self._bytes = 0
        self._log = StateLog()
        self._series = SeriesTable()
        self._newest: LiveSnapshot | None = None

    @property
    def newest(self) -> LiveSnapshot | None:
        """The last moment that was added."""
        return self._newest

    def add(self, snapshot: LiveSnapshot) -> None:
        """Take a moment; one that is not after the last only replaces it as the newest."""
        time = snapshot.component.time
        with self._lock:
            before, self._newest = self._newest, snapshot
            if before is not None and time <= before.component.time:
                return
            changed = self._log.add(snapshot.component)
            self._series.add(time, numbers_of(snapshot))
            if self._times and time - self._times[-1] < self._interval and not changed:
                return
            packed = zlib.compress(_encoder.encode(snapshot), _FASTEST)
            self._times.append(time)
            self._packed.append(packed)
            self._bytes += len(packed)
            while self._bytes > self._largest and len(self._packed) > 1:
                self._times.popleft()
                self._bytes -= len(self._packed.popleft())

    def at(self, time: float) -> msgspec.Raw | None:
        """Return the last moment at or before a component time as JSON, the first when all are later."""
        with self._lock:
            if not self._times:
                return None
            packed = self._packed[max(0, bisect.bisect_right(self._times, time) - 1)]
        return msgspec.Raw(zlib.decompress(packed))

    def timeline(self) -> Timeline:
        """Return how the states changed in the time that is kept."""
        with self._lock:
            start, end = (self._times[0], self._times[-1]) if self._times else (0.0, 0.0)
            return Timeline(
                start,
                end,
                [
                    (change.time, change.automaton, change.origin, change.destination, change.transition)
                    for change in self._log.changes
                    if change.time >= start
                ],
                [
                    (span.automaton, span.state, span.ghost, max(start, span.start), span.end)
                    for span in self._log.spans
                    if span.end >= start
                ],
                self._series.names,
            )

    def series(self, names: Sequence[str], start: float, end: float, points: int) -> dict[str, Any]:
        """Return numbers over time for a plot, `points` of them at most; None where one is missing."""
        with self._lock:
            times, values = self._series.read(names, start, end, points)
        return {"times": times, "values": values}
