"""What a trial came to."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from ._quantities import Value


class Change(Struct, frozen=True, array_like=True):
    """The states of a trial from a time on."""

    time: float
    """In s."""
    states: str
    """The path of current states; those of all branches, separated by commas."""


class Outcome(Struct, frozen=True, kw_only=True):
    """What a trial came to: the same each time and everywhere."""

    number: int
    values: Mapping[str, Value]
    """What its quantities were."""
    success: bool
    reason: str = ""
    """Why it failed, in words."""
    time: float = 0.0
    """When it ended, in s of the trial."""
    states: str = ""
    """The path of current states at its end."""
    numbers: Mapping[str, float] = {}
    """What was noted, by name."""
    groups: Mapping[str, str] = {}
    """What trials are distinguished by, by name: the group that this one belongs to."""
    changes: tuple[Change, ...] = ()
    """How it came there: its changes of state."""
    left_out: int = 0
    """Changes that are left out before the newest ones."""
    error: str = ""
    """The error of the behavior's code with its place, and the timeline."""
