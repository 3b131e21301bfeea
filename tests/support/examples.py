"""How many examples a property is tried with: enough for every day, and more on request."""

from __future__ import annotations

import os

_TIMES = float(os.environ.get("VISUALHFSM_EXAMPLES", "1"))


def examples(count: int) -> int:
    """Return a number of examples, multiplied by VISUALHFSM_EXAMPLES."""
    return max(1, round(count * _TIMES))
