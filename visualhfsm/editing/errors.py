"""What can go wrong while a document is edited."""

from __future__ import annotations

from visualhfsm.errors import VisualHfsmError

__all__ = ["ChangedOutsideError", "EditError", "OldFormatError"]


class EditError(VisualHfsmError):
    """A document could not be changed, opened or saved as asked; it is as it was before.

    `what` could not be done, `why`, and `hint`: what to do about it.
    """

    def __init__(self, what: str, why: str, hint: str = "") -> None:
        super().__init__(f"{what}: {why}" + (f"; {hint}" if hint else ""))
        self.what = what
        self.why = why
        self.hint = hint


class ChangedOutsideError(EditError):
    """A file was changed by another program since it was read."""


class OldFormatError(EditError):
    """Saving would replace a file of an older format by one of today's."""
