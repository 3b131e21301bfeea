"""The fixed schedule of an automaton: cycles at whole multiples of its period, whatever came before.

Times are integer ns of component time. A slot that was missed is not made up for.
"""

from __future__ import annotations

__all__ = ["slot_after", "slot_at", "slot_from"]


def slot_at(now: int, interval: int) -> int:
    """Return the latest slot that is not in the future."""
    return now // interval * interval


def slot_after(now: int, interval: int) -> int:
    """Return the first slot in the future."""
    return slot_at(now, interval) + interval


def slot_from(now: int, interval: int) -> int:
    """Return the first slot that is not in the past."""
    return -(-now // interval) * interval
