"""The balls of the simulated world."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["Color"]


class Color(StrEnum):
    """The color of a ball, which identifies it."""

    GREEN = "green"
    RED = "red"
