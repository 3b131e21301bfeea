"""Errors of requests, and how they are reported to the page."""

from __future__ import annotations

from visualhfsm.editing.errors import ChangedOutsideError, OldFormatError
from visualhfsm.errors import VisualHfsmError

from .protocol import ErrorKind

__all__ = [
    "ForbiddenPathError",
    "MissingError",
    "TooManyError",
    "UnsavedError",
    "WouldOverwriteError",
    "kind_of",
]


class ForbiddenPathError(VisualHfsmError):
    """A path that the page may not reach."""


class MissingError(VisualHfsmError):
    """There is no such tab or file."""


class UnsavedError(VisualHfsmError):
    """Closing would lose changes."""


class WouldOverwriteError(VisualHfsmError):
    """Saving would overwrite another file."""


class TooManyError(VisualHfsmError):
    """A limit is reached."""


_KINDS: dict[type[Exception], ErrorKind] = {
    MissingError: "missing",
    UnsavedError: "unsaved",
    WouldOverwriteError: "exists",
    OldFormatError: "exists",
    TooManyError: "busy",
    ForbiddenPathError: "forbidden",
    ChangedOutsideError: "outside",
    VisualHfsmError: "refused",
    TimeoutError: "timeout",
}


def kind_of(error: Exception) -> tuple[ErrorKind, str]:
    """Return the kind of an error and what the person reads of it; details of a fault stay in the log."""
    for cls, kind in _KINDS.items():
        if isinstance(error, cls):
            return kind, str(error) or "it took too long"
    return "internal", "a fault of the program; what happened stands in its log"
