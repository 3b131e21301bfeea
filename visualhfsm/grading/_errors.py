"""The exceptions of grading."""

from __future__ import annotations

from visualhfsm._errors import VisualHfsmError


class SandboxUnavailable(VisualHfsmError):
    """Nothing on this computer contains a stranger's program; the text says what to install."""


class GradingError(VisualHfsmError):
    """An exercise or its submissions cannot be graded; the text says what to change."""
