"""What a robot may lack, and the one of a test has."""

from __future__ import annotations

from typing import TypeVar

Part = TypeVar("Part")


def present(part: Part | None) -> Part:
    """Return a part that is there."""
    assert part is not None
    return part
