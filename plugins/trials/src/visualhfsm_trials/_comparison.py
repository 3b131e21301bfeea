"""Two series of the same trials, of different documents or plans: what differs, and whether by chance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from visualhfsm.plugins import Rate
from visualhfsm.trials import Outcome, TrialsError

from ._statistics import UNBOUNDED, Mean, mcnemar, mean_of, rate_difference
from ._summary import Summary

_SIGNIFICANT: Final = 0.05


@dataclass(frozen=True, slots=True)
class MeanChange:
    """The means of a number in two series, over the same trials, and the mean difference."""

    first: float
    second: float
    difference: Mean


class Comparison:
    """What differs between two series, trial by trial, of at most `limit` s; only what both have counts."""

    def __init__(self, first: Summary, second: Summary, *, limit: float = math.inf) -> None:
        others = {row.number: row for row in second.rows}
        self._pairs: Final = [(row, others[row.number]) for row in first.rows if row.number in others]
        if not self._pairs:
            raise TrialsError.because("the two series have no trial in common")
        self.rates: Final[tuple[Rate, Rate]] = (first.rate, second.rate)
        self.only_first: Final[Sequence[int]] = [
            a.number for a, b in self._pairs if a.success and not b.success
        ]
        """The trials in which only the first succeeds."""
        self.only_second: Final[Sequence[int]] = [
            a.number for a, b in self._pairs if b.success and not a.success
        ]
        """The trials in which only the second succeeds."""
        self.chance: Final = mcnemar(len(self.only_first), len(self.only_second))
        """Probability of rates that differ as much by chance, at a single look."""
        self.looks: Final = max(1, len({*first.looks, *second.looks}))
        """The number of looks at what a growing number of these trials came to."""
        self.difference: Final = rate_difference(
            len(self._pairs), len(self.only_first), len(self.only_second)
        )
        """By how much the rate of the second is higher."""
        both = [pair for pair in self._pairs if pair[0].success and pair[1].success]
        self.both: Final = len(both)
        """The number of trials in which both succeed."""
        self.numbers: Final[Mapping[str, MeanChange]] = _changes(both, limit)
        """The numbers of trials in which both succeed: one that fails has other ones."""

    @property
    def verdict(self) -> str:
        """Whether the difference in success is real, in words.

        Of several looks at growing data, each may find by chance what is not there: so small a probability at
        one of them is at most so many times as likely (Bonferroni), and no difference is called real.
        """
        gained, lost = len(self.only_second), len(self.only_first)
        if not gained and not lost:
            return "none: the same trials succeed"
        if self.looks > 1:
            most = min(1.0, self.looks * self.chance)
            single = f"p = {self.chance:.3g} of a single look"
            return f"{gained} gained, {lost} lost: {single}, at most {most:.3g} of {self.looks} looks"
        real = "real" if self.chance < _SIGNIFICANT else "perhaps chance"
        return f"{gained} gained, {lost} lost: {real} (p = {self.chance:.3g})"


def _changes(pairs: Sequence[tuple[Outcome, Outcome]], limit: float) -> dict[str, MeanChange]:
    if not pairs:
        return {}
    names = [
        name for name in pairs[0][0].numbers if all(name in a.numbers and name in b.numbers for a, b in pairs)
    ]
    found = {}
    for name in names:
        first = [a.numbers[name] for a, _ in pairs]
        second = [b.numbers[name] for _, b in pairs]
        bounds = (-limit, limit) if name == "time" else UNBOUNDED
        difference = mean_of(np.subtract(second, first).tolist(), bounds)
        found[name] = MeanChange(float(np.mean(first)), float(np.mean(second)), difference)
    return found
