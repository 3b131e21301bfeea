"""Read numbers from the texts by which a monitor shows values."""

from __future__ import annotations

import math

__all__ = ["number_in"]

_LONGEST = 40
_TRUTHS = {"True": 1.0, "False": 0.0}


def number_in(text: str) -> float | None:
    """Return the finite number that the repr of a value shows, 1 or 0 for a truth value, else None."""
    if text in _TRUTHS:
        return _TRUTHS[text]
    # NumPy's own numbers show their type: np.float64(1.5).
    if text.startswith("np.") and text.endswith(")"):
        text = text[text.find("(") + 1 : -1]
    if len(text) > _LONGEST or not text.lstrip("+-")[:1].isdigit():
        return None  # most values are no numbers, and an exception for each would cost
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
