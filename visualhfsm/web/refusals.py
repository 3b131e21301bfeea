"""What the page is told when a request was not done."""

from __future__ import annotations

from visualhfsm.editing.errors import ChangedOutsideError, OldFormatError
from visualhfsm.errors import VisualHfsmError

from .paths import ForbiddenPathError
from .protocol import ErrorKind
from .services import NotAvailableError

__all__ = ["MissingError", "TooManyError", "UnsavedError", "WouldOverwriteError", "kind_of"]


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
    NotAvailableError: "unavailable",
    VisualHfsmError: "refused",
    TimeoutError: "timeout",
}


def kind_of(error: Exception) -> tuple[ErrorKind, str]:
    """Return the kind of an error and what the person reads of it; details of a fault stay in the log."""
    for cls, kind in _KINDS.items():
        if isinstance(error, cls):
            return kind, str(error) or "it took too long"
    return "internal", "a fault of the program; what happened stands in its log"
