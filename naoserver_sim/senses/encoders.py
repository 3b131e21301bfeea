"""The encoders of the joints: angles as magnetic encoders of 12 bits tell them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

STEP: Final = math.tau / 4096
"""Resolution in rad: the 12 bits, about 0.1 degrees, that the documentation of the robot gives."""


def encoded(angles: Sequence[float]) -> tuple[float, ...]:
    """Return angles in rad as encoders tell them: the nearest that they tell apart."""
    return tuple(round(angle / STEP) * STEP for angle in angles)
