"""The number of examples for a property: enough for every day, and more on request."""

from __future__ import annotations

import os

__all__ = ["examples", "more_asked_for"]

_TIMES = os.environ.get("TEST_EXAMPLES", "")


def examples(count: int) -> int:
    """Return a number of examples, multiplied by TEST_EXAMPLES."""
    return max(1, round(count * float(_TIMES or "1")))


def more_asked_for() -> bool:
    """Return whether TEST_EXAMPLES asks for more examples than by default."""
    return float(_TIMES or "1") > 1.0
