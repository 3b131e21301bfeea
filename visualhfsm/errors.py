"""The exceptions of the command `visualhfsm`."""

from __future__ import annotations

__all__ = ["MissingPackageError", "VisualHfsmError"]


class VisualHfsmError(Exception):
    """The root of what the command reports in one line."""


class MissingPackageError(VisualHfsmError):
    """A package is not installed; the message names the command that installs it."""

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(f"{package} is not installed; install it with: pip install 'visualhfsm[{extra}]'")
