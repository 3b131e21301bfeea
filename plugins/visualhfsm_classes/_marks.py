"""The marks of a submission: what each criterion earned, and why; and those of a class as a table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct

from visualhfsm.plugins import write_csv
from visualhfsm_classes._words import say

if TYPE_CHECKING:
    from visualhfsm_classes._exercise import Exercise

_DIGITS = 2


class Earned(Struct, frozen=True):
    """What a criterion earned in all trials."""

    asks: str
    points: float
    of: float
    words: str
    failed: bool = False
    """True if its judge failed: a fault of the exercise."""


class Marks(Struct, frozen=True, kw_only=True):
    """The marks of a submission: the same each time and everywhere."""

    name: str
    language: str
    earned: tuple[Earned, ...]
    reason: str = ""
    """Why it could not be run at all."""
    error: str = ""
    """The first error that ended a trial, with its place."""
    did: str = ""
    """The states of the trial that lost the most points, in words."""
    worst_plan: str = ""
    worst_number: int = 0
    """The trial that lost the most points, from 1 on."""

    @property
    def points(self) -> float:
        """All points."""
        return round(sum(each.points for each in self.earned), _DIGITS)

    @property
    def of(self) -> float:
        """The most points."""
        return sum(each.of for each in self.earned)

    @property
    def summary(self) -> str:
        """Why points are lost, in one line."""
        if self.reason:
            return f"{say(self.language, 'broken')}: {self._reason_in_one_line()}"
        lost = [each.words for each in self.earned if each.points < each.of]
        if self.error:
            lost.append(" ".join(self.error.split()))
        if lost and self.did:
            lost.append(self.did)
        return "; ".join(dict.fromkeys(lost)) or say(self.language, "all")

    def _reason_in_one_line(self) -> str:
        """Return what the compiler said, without the lines of the document and the carets below them."""
        said = [line for line in self.reason.splitlines() if line == line.lstrip()]
        return "; ".join(filter(None, said))

    @classmethod
    def broken(cls, exercise: Exercise, name: str, language: str, reason: str) -> Marks:
        """Return the marks of a submission that cannot be run: no points, with the reason."""
        return cls(
            name=name,
            language=language,
            earned=tuple(
                Earned(each.asks[language], 0.0, each.points, say(language, "broken"))
                for each in exercise.criteria
            ),
            reason=reason,
        )


def write_table(path: Path, exercise: Exercise, language: str, marks: Sequence[Marks]) -> None:
    """Write a row for each submission as CSV: all points, those of each criterion, and why.

    Raises VisualHfsmError.
    """
    asks = [each.asks[exercise.language(language)] for each in exercise.criteria]
    rows = [
        [
            each.name,
            f"{each.points:g}",
            f"{each.of:g}",
            *(f"{earned.points:g}" for earned in each.earned),
            each.summary,
        ]
        for each in marks
    ]
    write_csv(path, [["name", "points", "of", *asks, "reasons"], *rows])
