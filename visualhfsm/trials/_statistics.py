"""The statistics of trials: what takes more than a formula is done by SciPy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, Final

import numpy as np

from codegen.messages import Message

from ._errors import TrialsError

CONFIDENCE: Final = 0.95
_RESAMPLES: Final = 9999


@dataclass(frozen=True, slots=True)
class Rate:
    """How many of some trials succeeded, with the interval of Wilson in which the true rate lies.

    Source: E. B. Wilson, "Probable inference, the law of succession, and statistical inference", Journal of
    the American Statistical Association 22 (1927).
    """

    successes: int
    trials: int
    lowest: float
    highest: float

    @property
    def rate(self) -> float:
        """The share of successes, 0 without trials."""
        return self.successes / self.trials if self.trials else 0.0

    def __str__(self) -> str:
        if not self.trials:
            return "no trials"
        percent = f"{100 * self.rate:.1f} %".replace(".0 %", " %")
        return f"{percent}  ({100 * self.lowest:.1f} to {100 * self.highest:.1f} %)"


def success_rate(successes: int, trials: int, confidence: float = CONFIDENCE) -> Rate:
    """Return how many succeeded, with the interval of a confidence."""
    if not trials:
        return Rate(0, 0, 0.0, 1.0)
    z = NormalDist().inv_cdf(
        (1.0 + confidence) / 2.0
    )  # SciPy has this interval, too, but takes a second to load
    share, scale = successes / trials, 1.0 + z * z / trials
    center = (share + z * z / (2 * trials)) / scale
    reach = z / scale * math.sqrt(share * (1.0 - share) / trials + (z / (2 * trials)) ** 2)
    lowest = center - reach if successes else 0.0
    return Rate(successes, trials, lowest, center + reach if successes < trials else 1.0)


@dataclass(frozen=True, slots=True)
class Quartiles:
    """The distribution of a number: its least, its quartiles, its greatest, and its mean."""

    count: int
    least: float
    lower: float
    median: float
    upper: float
    greatest: float
    mean: float


def quartiles(numbers: Sequence[float]) -> Quartiles:
    """Return the distribution of at least one number."""
    least, lower, median, upper, greatest = np.quantile(numbers, (0, 0.25, 0.5, 0.75, 1)).tolist()
    return Quartiles(len(numbers), least, lower, median, upper, greatest, float(np.mean(numbers)))


def mcnemar(only_first: int, only_second: int) -> float:
    """Return the probability of so different rates by chance, of trials that succeed in one of two only.

    This is the exact test of McNemar: with no difference each of these is as likely in the one as in the
    other. Source: Q. McNemar, Psychometrika 12 (1947), 153.
    """
    changed = only_first + only_second
    return float(_scipy().binomtest(only_first, changed).pvalue) if changed else 1.0


def mean_difference(first: Sequence[float], second: Sequence[float]) -> tuple[float, float, float]:
    """Return the mean of `second - first`, pair by pair, with its interval by bootstrap.

    The same numbers give the same interval: the random numbers begin the same way.
    """
    differences = np.subtract(second, first)
    mean = float(differences.mean())
    if len(differences) < 2 or np.ptp(differences) == 0.0:
        return mean, mean, mean
    found = _scipy().bootstrap(
        (differences,),
        np.mean,
        n_resamples=_RESAMPLES,
        confidence_level=CONFIDENCE,
        rng=np.random.default_rng(0),
        batch=100,
    )
    low, high = found.confidence_interval
    return mean, float(low), float(high)


def _scipy() -> Any:  # noqa: ANN401 - the module
    try:
        from scipy import stats  # takes a second to load: only who compares series waits for it
    except ModuleNotFoundError as error:
        raise TrialsError(
            Message("trials need the package SciPy: pip install 'visualhfsm[trials]'")
        ) from error
    return stats
