"""Who touches whom: what stands firm touches what moves, and what moves touches one another."""

from __future__ import annotations

from typing import Final

FLOOR_BIT: Final = 1
"""The bit of what stands firm: floor, walls, heavy boxes."""
BODY_BIT: Final = 2
"""The bit of what moves: the links of the body, balls and boxes that can be pushed."""

FRICTION: Final = (1.0, 0.02, 0.001)
"""Along a surface, and in m about its normal and of rolling."""


def firm() -> dict[str, int]:
    """Return the bits of a geom that stands firm."""
    return {"contype": FLOOR_BIT, "conaffinity": BODY_BIT}


def moving() -> dict[str, int]:
    """Return the bits of a geom that moves."""
    return {"contype": BODY_BIT, "conaffinity": FLOOR_BIT | BODY_BIT}


def untouchable() -> dict[str, int]:
    """Return the bits of a geom that is only seen."""
    return {"contype": 0, "conaffinity": 0}
