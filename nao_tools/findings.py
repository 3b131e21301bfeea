"""What a check finds, how bad it is, and how to fix it."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from typing import Final, NamedTuple


class Level(StrEnum):
    """Severity of a finding."""

    OK = "ok"
    NOTE = "note"
    """Something that may be intended."""
    WARNING = "warn"
    """Something that will cause trouble, sooner or later."""
    FAILURE = "FAIL"
    """Something that does not work."""


class Finding(NamedTuple):
    """The result of a check, and how to fix it; `fix` is empty when there is nothing to do."""

    level: Level
    text: str
    fix: str = ""


ok: Final = partial(Finding, Level.OK)
note: Final = partial(Finding, Level.NOTE)
warn: Final = partial(Finding, Level.WARNING)
fail: Final = partial(Finding, Level.FAILURE)
