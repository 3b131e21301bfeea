"""Look for what keeps a robot and its programs from working together, and say how to fix it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import partial

__all__ = ["Finding", "Level", "fail", "note", "ok", "warn"]


class Level(StrEnum):
    """How grave a finding is."""

    OK = "ok"
    NOTE = "note"
    """Something that may be meant to be so."""
    WARNING = "warn"
    """Something that will cause trouble, sooner or later."""
    FAILURE = "FAIL"
    """Something that does not work."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at."""

    level: Level
    text: str
    fix: str = ""
    """What to do about it; empty when there is nothing to do."""


ok = partial(Finding, Level.OK)
note = partial(Finding, Level.NOTE)
warn = partial(Finding, Level.WARNING)
fail = partial(Finding, Level.FAILURE)
