"""The exceptions of trials."""

from __future__ import annotations

from visualhfsm._errors import VisualHfsmError


class TrialsError(VisualHfsmError):
    """Trials cannot be made, or go on; the text says what to change."""
