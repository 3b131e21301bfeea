"""A clock thirty times as fast as the wall's."""

from __future__ import annotations

import threading
import time

__all__ = ["FastClock"]


class FastClock:
    """Wall time, thirty times as fast. What this module imports as `time` is recorded, so it is kept here."""

    rate = 30.0
    simulated = True
    _monotonic = staticmethod(time.monotonic)
    _sleep = staticmethod(time.sleep)

    def now(self) -> float:
        return self._monotonic() * self.rate

    def sleep(self, seconds: float) -> None:
        self._sleep(max(0.0, seconds) / self.rate)

    def wait(self, event: threading.Event, timeout: float) -> bool:
        return event.wait(max(0.0, timeout) / self.rate)
