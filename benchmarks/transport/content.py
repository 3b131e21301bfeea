"""What is sent in the benchmark: joint states and images, alike for all peers."""

from __future__ import annotations

import random
from functools import cache
from typing import Final

POSE: Final = (0.1, 0.2, 0.3, 0.4)
JOINTS: Final = tuple(0.01 * number for number in range(26))
SMALL_IMAGE: Final = (320, 240)
LARGE_IMAGE: Final = (1280, 960)


@cache
def pixels(width: int, height: int) -> bytes:
    """Return an image that does not compress and whose pages are all its own."""
    return random.Random(width).randbytes(3 * width * height)


def marked_joints(number: int) -> list[float]:
    """Return positions that show whether they belong together."""
    return [float(number)] * len(JOINTS)


def marked_pixels(number: int, width: int, height: int) -> bytes:
    """Return an image that shows whether it is of one piece."""
    return bytes([number % 251]) * (3 * width * height)
