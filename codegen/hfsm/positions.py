"""Positions of states that a file does not place."""

from __future__ import annotations

import math
from typing import Final

_APART: Final = 260.0
"""Pixels between states that are next to each other."""
_LEFT: Final = 120.0
_TOP: Final = 160.0


def on_circle(number: int, count: int) -> tuple[float, float]:
    """Return the position of a state on the canvas in pixels: on a circle, so that arcs pass no other state.

    `number` is its place among `count` states, from 1. With an odd number of corners, the arcs between
    different states have different middles.
    """
    corners = max(3, count | 1)
    radius = _APART / (2 * math.sin(math.pi / corners))
    angle = (2 * number - 3) * math.pi / corners - math.pi / 2  # the first two are beside each other
    x, y = radius * (1 + math.cos(angle)), radius * (1 + math.sin(angle))
    return round(_LEFT + x, 1), round(_TOP + y, 1)
