"""The errors of matches."""

from __future__ import annotations

from codegen.messages import Message
from visualhfsm import VisualHfsmError


class MatchError(VisualHfsmError):
    """A match cannot be played; the message says why, and what to do."""

    @classmethod
    def of(cls, text: str) -> MatchError:
        """Return an error with a text as it is."""
        return cls(Message.verbatim(text))
