"""A clock for robots without physics that live faster than the wall's time."""

from __future__ import annotations

import threading
import time
from typing import Final


class FastClock:
    """Steady wall time, `rate` times as fast. Implements zenoh_ice.Clock."""

    simulated: Final = True

    def __init__(self, rate: float) -> None:
        self.rate: Final = rate
        """Seconds of this clock in a second of wall time."""

    def now(self) -> float:
        """Return the time in s."""
        return time.monotonic() * self.rate

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s."""
        time.sleep(max(0.0, seconds) / self.rate)

    def sleep_until(self, when: float) -> None:
        """Wait until a time in s."""
        self.sleep(when - self.now())

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s; return whether it is set."""
        return event.wait(max(0.0, timeout) / self.rate)
