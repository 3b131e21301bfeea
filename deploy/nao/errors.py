"""What `nao` itself has to complain about."""

from __future__ import annotations

__all__ = ["NaoError", "UsageError"]


class NaoError(Exception):
    """Something that the command cannot do; the text says why, and what to do."""


class UsageError(NaoError):
    """Arguments that do not fit what they are for."""
