"""The exceptions of grading."""

from __future__ import annotations

from codegen.messages import Message
from visualhfsm import VisualHfsmError


class SandboxUnavailable(VisualHfsmError):
    """Nothing on this computer contains a stranger's program; the text says what to install."""


class GradingError(VisualHfsmError):
    """An exercise or its submissions cannot be graded; the text says what to change."""


def wrong_exercise(text: str) -> GradingError:
    """Return the error of an exercise's file, with its line and key."""
    return GradingError(Message.verbatim(text))


class ComputerTooBusy(GradingError):
    """The computer had no time for a submission, whose fault that is not."""


class ComputerFailed(GradingError):
    """A computer cannot grade, whatever is handed in."""

    def __init__(self, why: str) -> None:
        super().__init__(
            Message("this computer cannot grade, which is no fault of a submission: {reason}", reason=why)
        )
