"""Not more than so many a second."""

from __future__ import annotations

import math
import time
from typing import Final

__all__ = ["Pacer"]


class Pacer:
    """Tell when the next thing may happen, so that on average there are not more than `rate` a second."""

    def __init__(self, rate: float | None) -> None:
        self._period: Final = 0.0 if rate is None else 1.0 / rate
        self._due = -math.inf

    def delay(self) -> float:
        """Return the wall seconds to wait before the next."""
        return max(0.0, self._due - time.monotonic()) if self._period else 0.0

    def count(self) -> None:
        """Count one that happens now."""
        if self._period:
            # From when it was due, so that late ones do not lower the rate; but a pause is not made up for.
            now = time.monotonic()
            late = now - self._due
            self._due = (self._due if late < self._period else now) + self._period
