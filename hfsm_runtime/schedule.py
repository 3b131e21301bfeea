"""The fixed schedule of an automaton: cycles at whole multiples of its period, whatever came before.

Times are integer ns of component time. A slot that was missed is not made up for.
"""

from __future__ import annotations

from typing import Final

__all__ = ["delay_in_slot", "slot_after", "slot_at", "slot_from"]

_APART: Final = 50_000
"""ns between the wake-ups of two automata whose slots fall together: about what a cycle takes on a thread."""


def slot_at(now: int, interval: int) -> int:
    """Return the latest slot that is not in the future."""
    return now // interval * interval


def slot_after(now: int, interval: int) -> int:
    """Return the first slot in the future."""
    return slot_at(now, interval) + interval


def slot_from(now: int, interval: int) -> int:
    """Return the first slot that is not in the past."""
    return -(-now // interval) * interval


def delay_in_slot(index: int, interval: int) -> int:
    """Return how long after the beginning of its slots the automaton of this number wakes.

    Threads that woke all at once would fight for the interpreter, and a few would win it late. The cycle
    belongs to the time of its slot nevertheless.
    """
    return index * _APART % interval
