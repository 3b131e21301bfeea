"""How often something has happened lately."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Final

WINDOW: Final = 2.0
"""Seconds over which a rate is measured."""


class RateMeter:
    """Count events and tell their rate over the last `WINDOW` seconds of the clock `now`. Thread-safe."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._lock = threading.Lock()
        self._times: deque[float] = deque()

    def count(self, time: float) -> None:
        """Count an event at a time in s."""
        with self._lock:
            if self._times and time < self._times[-1]:
                self._times.clear()  # a simulation started anew
            self._times.append(time)
            self._drop(time)

    @property
    def rate(self) -> float:
        """Events a second."""
        with self._lock:
            self._drop(self._now())
            return len(self._times) / WINDOW

    def _drop(self, now: float) -> None:
        while self._times and now - self._times[0] >= WINDOW:
            self._times.popleft()
