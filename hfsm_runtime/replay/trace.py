"""Lead what a replay does to the comparison, by the recorder that writes recordings."""

from __future__ import annotations

from typing import Final

from ..recording.turns import Turns
from ..recording.writer import Entry
from .answers import Answers
from .strands import Strands

__all__ = ["ComparisonSink", "StrandContext"]


class ComparisonSink:
    """Where what the replay does is told: to the comparison."""

    crowded: Final = True

    def __init__(self, answers: Answers) -> None:
        self._answers = answers

    def put(self, entry: Entry) -> None:
        """Take a message."""
        message = entry.message if not callable(entry.message) else entry.message()
        self._answers.comparison.replayed(entry.time, message)


class StrandContext(Turns):
    """Turns that nobody takes: the code of a context is that on its strand."""

    def __init__(self, strands: Strands) -> None:
        super().__init__(lambda _context, _beside: None)
        self._strands = strands

    @property
    def context(self) -> str | None:
        """Whose code this thread runs."""
        return self._strands.context
