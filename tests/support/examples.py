"""The number of examples for a property: enough for every day, ten times as many in a soak, or as TEST_EXAMPLES says."""

from __future__ import annotations

import os
from typing import Final

from tests.support.soak import SOAKS

__all__ = ["examples", "more_asked_for"]

_TIMES: Final = float(os.environ.get("TEST_EXAMPLES") or ("10" if SOAKS else "1"))


def examples(count: int) -> int:
    """Return a number of examples, as many times as asked for."""
    return max(1, round(count * _TIMES))


def more_asked_for() -> bool:
    """Return whether TEST_EXAMPLES asks for more examples than by default."""
    return _TIMES > 1.0
