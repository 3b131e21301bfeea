"""What failed during a run, and when."""

from __future__ import annotations

from collections import deque
from typing import Final

import msgspec

from .messages import Fault

_MOST: Final = 500
"""Spans that are kept: the newest."""


class FailureSpan(msgspec.Struct):
    """What failed together from one component time in s to another."""

    faults: tuple[Fault, ...]
    start: float
    end: float

    def __str__(self) -> str:
        return f"{', '.join(map(str, self.faults))} from {self.start:.1f} s to {self.end:.1f} s"


class FailureLog:
    """Collect the spans in which something failed. Not thread safe."""

    def __init__(self) -> None:
        self._spans: Final[deque[FailureSpan]] = deque(maxlen=_MOST)
        self._present: FailureSpan | None = None

    def end(self, time: float) -> None:
        """Note that what fails still does at a time in s."""
        if self._present is not None:
            self._present.end = time

    def note(self, faults: tuple[Fault, ...], time: float) -> bool:
        """Note what fails at a time in s that is not before the last; return whether that has changed."""
        self.end(time)
        if faults == (() if self._present is None else self._present.faults):
            return False
        self._present = FailureSpan(faults, time, time) if faults else None
        if self._present is not None:
            self._spans.append(self._present)
        return True

    def spans(self, since: float = 0.0) -> list[FailureSpan]:
        """Return the spans that end at a time in s or later, oldest first, each cut to begin there."""
        return [
            FailureSpan(span.faults, max(since, span.start), span.end)
            for span in self._spans
            if span.end >= since
        ]
