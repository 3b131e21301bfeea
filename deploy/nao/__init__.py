"""The command `nao`: look at a running robot and everything around it, and call whatever it serves."""

from __future__ import annotations

__all__ = ["NaoError", "UsageError"]


class NaoError(Exception):
    """Something that the command cannot do; the text says why, and what to do."""


class UsageError(NaoError):
    """Arguments that do not fit what they are for."""
