"""A joint's range as a function of another joint's angle: how NAOqi keeps the body from hitting itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from naoserver.errors import RobotError


@dataclass(frozen=True, slots=True)
class RangeTable:
    """The range of the joint `dependent` at each angle of the joint `independent`, linear between rows."""

    independent: str
    dependent: str
    rows: tuple[tuple[float, float, float], ...]
    """Angle of `independent`, then lower and upper limit of `dependent`, in rad, by increasing angle."""

    def __post_init__(self) -> None:
        if not self.rows:
            raise RobotError(f"range table of {self.dependent}: no rows")
        for before, after in pairwise(self.rows):
            if not before[0] < after[0]:
                raise RobotError(f"range table of {self.dependent}: angle {after[0]} does not increase")
        for angle, lower, upper in self.rows:
            if lower > upper:
                raise RobotError(f"range table of {self.dependent}: empty range at {angle} rad")

    @property
    def steepest(self) -> float:
        """How far a limit of `dependent` moves at most for each rad of `independent`."""
        return max(
            (
                max(abs(after[1] - before[1]), abs(after[2] - before[2])) / (after[0] - before[0])
                for before, after in pairwise(self.rows)
            ),
            default=0.0,
        )

    def at(self, angle: float) -> tuple[float, float]:
        """Return the range of `dependent` at `angle` of `independent`; beyond the table, that of its edge."""
        rows = self.rows
        if angle <= rows[0][0]:
            return rows[0][1:]
        for left, right in pairwise(rows):
            if angle <= right[0]:
                share = (angle - left[0]) / (right[0] - left[0])
                return left[1] + share * (right[1] - left[1]), left[2] + share * (right[2] - left[2])
        return rows[-1][1:]

    def over(self, angles: Sequence[float]) -> tuple[float, float]:
        """Return the range that is allowed everywhere between the least and the greatest of `angles`.

        The range is piecewise linear, so its narrowest points lie at the ends and at the rows between.
        """
        first, last = min(angles), max(angles)
        ranges = [self.at(first), self.at(last)]
        ranges += [row[1:] for row in self.rows if first < row[0] < last]
        return max(lower for lower, _ in ranges), min(upper for _, upper in ranges)
