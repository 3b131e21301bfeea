"""The exceptions of trials."""

from __future__ import annotations

from codegen.messages import Message
from visualhfsm._errors import VisualHfsmError


class TrialsError(VisualHfsmError):
    """Trials cannot be made, or go on; the text says what to change."""


def wrong_plan(text: str) -> TrialsError:
    """Return the error of a plan's file, with its line and key."""
    return TrialsError(Message.verbatim(text))
