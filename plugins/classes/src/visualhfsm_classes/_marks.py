"""The marks of a submission: what each criterion earned, and why; and those of a class as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

from msgspec import Struct

from visualhfsm_classes._words import say

if TYPE_CHECKING:
    from visualhfsm_classes._exercise import Exercise

_DIGITS = 2
NAME: Final = 0
POINTS: Final = 1
NOTE: Final = -1
REASONS: Final = "reasons"
"""Columns of the table."""


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
    digest: str = ""
    """The first digits of the SHA-256 of its document; empty if none could be read."""
    handed_in: str = ""
    """When its document was written."""

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


class Listed(NamedTuple):
    """A row of the table, as the page of the class shows it."""

    name: str
    page: str
    """The name of the page of this submission, without its suffix."""
    points: str
    reasons: str
    note: str = ""
    """Why these are no marks of a document of now, if they are not."""


def table_of(exercise: Exercise, language: str, marks: Sequence[Marks]) -> list[list[str]]:
    """Return a head, and a row for each submission: points, those of each criterion, why, and of what."""
    asks = [each.asks[exercise.language(language)] for each in exercise.criteria]
    rows = [
        [
            each.name,
            f"{each.points:g}",
            f"{each.of:g}",
            *(f"{earned.points:g}" for earned in each.earned),
            each.summary,
            each.digest,
            each.handed_in,
            "",
        ]
        for each in marks
    ]
    return [["name", "points", "of", *asks, REASONS, "document", "handed in", "note"], *rows]
