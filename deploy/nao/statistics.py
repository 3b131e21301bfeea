"""Figures of a stream: its rate, the age of its samples, and what was lost."""

from __future__ import annotations

import itertools
import time
from collections import deque
from dataclasses import dataclass
from typing import Any, Final

from zenoh_ice import Sample

__all__ = ["StreamStatistics", "Summary"]

_WINDOW: Final = 5.0
"""Seconds over which rates, intervals and ages are taken."""


@dataclass(frozen=True, slots=True)
class Summary:
    """A stream over the last seconds; what cannot be told yet is None."""

    received: int
    """Samples since the beginning."""
    lost: int
    """Samples that were sent and did not come, since the beginning; those that a rate left out, too."""
    restarts: int
    """How often the numbers began anew: the server was started again."""
    rate: float | None
    """Samples a second that came."""
    interval: tuple[float, float] | None
    """Shortest and longest time in s between two."""
    age: float | None
    """Mean age in s on arrival; below 0 when the clocks of the machines differ."""
    oldest: float | None
    """Largest age in s on arrival."""
    silence: float
    """Seconds since the newest came, or since the beginning."""


class StreamStatistics:
    """Count what a stream brings."""

    def __init__(self) -> None:
        self._received = 0
        self.lost = 0
        """Samples that were sent and did not come, so far."""
        self._restarts = 0
        self._last: float = time.monotonic()
        self._sequence: int | None = None
        self._arrivals: Final[deque[tuple[float, float]]] = deque()

    def add(self, sample: Sample[Any], arrived: float, age: float) -> None:
        """Count a sample that arrived at a time of the monotonic clock with an age in s."""
        self.lost += sample.lost
        if self._sequence is not None and sample.sequence <= self._sequence:
            self._restarts += 1
        self._sequence = sample.sequence
        self._received += 1
        self._last = arrived
        self._arrivals.append((arrived, age))
        self._forget(arrived)

    def summary(self) -> Summary:
        """Return what there is to tell now."""
        now = time.monotonic()
        self._forget(now)
        times = [arrived for arrived, _ in self._arrivals]
        ages = [age for _, age in self._arrivals]
        intervals = [after - before for before, after in itertools.pairwise(times)]
        return Summary(
            received=self._received,
            lost=self.lost,
            restarts=self._restarts,
            rate=len(intervals) / sum(intervals) if sum(intervals) > 0 else None,
            interval=(min(intervals), max(intervals)) if intervals else None,
            age=sum(ages) / len(ages) if ages else None,
            oldest=max(ages, default=None),
            silence=now - self._last,
        )

    def _forget(self, now: float) -> None:
        while self._arrivals and now - self._arrivals[0][0] > _WINDOW:
            self._arrivals.popleft()
