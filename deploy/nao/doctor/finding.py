"""What a check found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["Finding", "Level", "fail", "note", "ok", "warn"]


class Level(StrEnum):
    """How grave a finding is."""

    OK = "ok"
    NOTE = "note"
    """Something that may be meant to be so."""
    WARNING = "warn"
    """Something that will make trouble, sooner or later."""
    FAILURE = "FAIL"
    """Something that does not work."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at."""

    level: Level
    text: str
    mend: str = ""
    """What to do about it; empty when there is nothing to do."""

    @property
    def texts(self) -> dict[str, str]:
        """What is said of it, by name."""
        return {"text": self.text, "mend": self.mend}


def ok(text: str) -> Finding:
    """Return that something is as it should be."""
    return Finding(Level.OK, text)


def note(text: str, mend: str = "") -> Finding:
    """Return something that may be meant to be so."""
    return Finding(Level.NOTE, text, mend)


def warn(text: str, mend: str) -> Finding:
    """Return something that will make trouble."""
    return Finding(Level.WARNING, text, mend)


def fail(text: str, mend: str) -> Finding:
    """Return something that does not work."""
    return Finding(Level.FAILURE, text, mend)
