"""The content of the benchmark: joint states and images, the same for all peers."""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import numpy as np

POSE: Final = (0.1, 0.2, 0.3, 0.4)
JOINTS: Final = tuple(0.01 * number for number in range(26))
SMALL_IMAGE: Final = (320, 240)
LARGE_IMAGE: Final = (1280, 960)


@cache
def frame(width: int, height: int) -> Any:  # noqa: ANN401
    """Return an image as an array, like a camera; the sender copies its bytes each time."""
    return np.random.default_rng(width).integers(0, 256, (height, width, 3), np.uint8)


def marked_joints(number: int) -> list[float]:
    """Return positions by which torn values can be recognized."""
    return [float(number)] * len(JOINTS)


def marked_pixels(number: int, width: int, height: int) -> bytes:
    """Return an image by which torn values can be recognized."""
    return bytes([number % 251]) * (3 * width * height)
