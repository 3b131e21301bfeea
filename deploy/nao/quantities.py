"""Write durations, sizes and rates for people."""

from __future__ import annotations

import math
from typing import Final

__all__ = ["bytes_text", "count_text", "duration_text", "rate_text", "span_text"]

_DURATIONS: Final = (("us", 1e6), ("ms", 1e3), ("s", 1))
_SIZES: Final = (("B", 1), ("kB", 1e3), ("MB", 1e6), ("GB", 1e9))


def span_text(seconds: float) -> str:
    """Return how long something lasts already, in its largest unit: `12 s`, `5 min`, `3 h`, `2 days`."""
    if not math.isfinite(seconds):
        return "-"
    for unit, length, limit in (("s", 1, 120), ("min", 60, 120 * 60), ("h", 3600, 48 * 3600)):
        if seconds < limit:
            return f"{max(0, int(seconds // length))} {unit}"
    return f"{int(seconds // 86400)} days"


def duration_text(seconds: float) -> str:
    """Return a short duration with three digits: `85 us`, `1.23 ms`, `4.5 s`."""
    if not math.isfinite(seconds):
        return "-"
    unit, scale = next(each for each in _DURATIONS if abs(seconds) * each[1] < 1000 or each[1] == 1)
    return f"{_three_digits(seconds * scale)} {unit}"


def rate_text(rate: float) -> str:
    """Return how often a second: `30.0 /s`."""
    return f"{_three_digits(rate)} /s"


def bytes_text(size: float) -> str:
    """Return a number of bytes: `86 B`, `57.6 kB`, `3.69 MB`."""
    unit, scale = next(each for each in _SIZES if size < 1000 * each[1] or each[1] == 1e9)
    return f"{size:.0f} B" if scale == 1 else f"{_three_digits(size / scale)} {unit}"


def count_text(number: int, singular: str, plural: str = "") -> str:
    """Return a number of things: `1 servant`, `3 servants`."""
    return f"{number} {singular if number == 1 else plural or singular + 's'}"


def _three_digits(value: float) -> str:
    return f"{value:.{0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2}f}"
