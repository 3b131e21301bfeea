"""Measure subjects in alternating rounds, so that other load of the machine affects all of them."""

from __future__ import annotations

import random
import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

from .figures import Spread, percentile, spread

T = TypeVar("T")


@dataclass
class Times:
    """The durations of something in s, by round."""

    rounds: list[list[float]] = field(default_factory=list)

    @property
    def medians(self) -> list[float]:
        """The median of each round."""
        return [statistics.median(times) for times in self.rounds]

    @property
    def median(self) -> Spread:
        """The median of the rounds' medians."""
        return spread(self.medians)

    @property
    def all(self) -> list[float]:
        """All durations."""
        return [time for times in self.rounds for time in times]

    @property
    def p99(self) -> float:
        """The 99th percentile of all."""
        return percentile(self.all, 0.99)


def interleaved(subjects: Mapping[str, Callable[[], T]], rounds: int) -> dict[str, list[T]]:
    """Return the results of the subjects by round, in random order and without the first round."""
    results: dict[str, list[T]] = {name: [] for name in subjects}
    for number in range(rounds + 1):
        for name in random.sample(list(subjects), len(subjects)):
            result = subjects[name]()
            if number:
                results[name].append(result)
    return results


def timed(subjects: Mapping[str, Callable[[], list[float]]], rounds: int) -> dict[str, Times]:
    """Return the times of the subjects, with a list per round."""
    return {name: Times(results) for name, results in interleaved(subjects, rounds).items()}
