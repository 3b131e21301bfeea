"""Exceptions of replays."""

from __future__ import annotations

from ..errors import ComponentError

__all__ = ["NothingRecordedError", "ReplayEndedError", "ReplayError"]


class ReplayError(ComponentError):
    """A replay cannot go on."""


class NothingRecordedError(ReplayError):
    """The edited document reads what nobody had read until then, so the recording has no value for it."""


class ReplayEndedError(BaseException):
    """The recording is over: ends code that waits for more, and is no Exception so that it gets through."""
