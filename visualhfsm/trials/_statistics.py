"""The statistics of trials, and their figures in words; SciPy does what it has.

Figures are rounded half up, from their exact value, as JavaScript does it: terminal and page say the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Context, Decimal
from statistics import NormalDist
from typing import Any, Final

import msgspec
import numpy as np

from ._errors import TrialsError

CONFIDENCE: Final = 0.95
FEWEST: Final = 5
"""Numbers of which a mean gets an interval: of fewer, none holds the true mean often enough."""
SMALL: Final = 20
"""Fewer trials say little: of so many, the interval of a rate is some 40 % wide."""
_RESAMPLES: Final = 4999
_EQUAL: Final = 1e-9
"""Part of the largest number within which all others are the same as it, but for rounding."""
_DIGITS: Final = 4
_PLAIN: Final = (-6, 12)
"""Exponents from and to which a number is written without one."""


class Rate(msgspec.Struct, frozen=True):
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
        return f"{percent(self.rate)} %  ({percent(self.lowest)} to {percent(self.highest)} %)"


def success_rate(successes: int, trials: int) -> Rate:
    """Return how many succeeded, with the interval."""
    if not trials:
        return Rate(0, 0, 0.0, 1.0)
    z = _normal()  # SciPy has this interval, too, but takes a second to load
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
    return float(require_scipy().binomtest(only_first, changed).pvalue) if changed else 1.0


@dataclass(frozen=True, slots=True)
class Mean:
    """A mean of numbers, with the interval in which the true mean lies.

    Without an interval `why` says so: "in each" if all numbers are the same, otherwise what is missing.
    """

    mean: float
    count: int
    interval: tuple[float, float] | None = None
    why: str = ""


def mean_of(numbers: Sequence[float]) -> Mean:
    """Return the mean of at least one number, with its interval by bootstrap.

    The interval is the studentized one (bootstrap-t), which holds the mean of skewed numbers as often as it
    says, as BCa does not; of two values it is the exact one of Clopper and Pearson, Biometrika 26 (1934), as
    Wilson's holds the mean of 50 coins less often. The same numbers give the same interval: the random
    numbers begin the same way. Source: B. Efron and R. Tibshirani, An Introduction to the Bootstrap (1993),
    chapter 12. benchmarks/bench_intervals.py says how often they hold it. Raises TrialsError without SciPy.
    """
    values = np.asarray(numbers, float)
    mean, count = float(values.mean()), len(values)
    if count < FEWEST:
        return Mean(mean, count, why=f"(fewer than {FEWEST} trials)")
    if np.ptp(values) <= _EQUAL * np.max(np.abs(values)):
        return Mean(mean, count, why="in each")
    exponent = int(np.frexp(np.max(np.abs(values)))[1])  # squares may be too large or too small for a number
    low, high = _interval(_merged(np.ldexp(values, -exponent)))
    if not math.isfinite(low) or not math.isfinite(high):
        return Mean(mean, count, why="(few different values)")
    return Mean(mean, count, (math.ldexp(low, exponent), math.ldexp(high, exponent)))


def _interval(values: np.ndarray) -> tuple[float, float]:
    """Return the interval of the mean of numbers within -1 and 1; infinite if too few are different."""
    distinct, count = np.unique(values), len(values)
    if len(distinct) == 2:
        least, most = distinct.tolist()
        found = require_scipy().binomtest(int(np.count_nonzero(values == most)), count)
        ends = found.proportion_ci(CONFIDENCE, method="exact")
        return least + (most - least) * float(ends.low), least + (most - least) * float(ends.high)
    mean, error = float(values.mean()), float(values.std(ddof=1))
    drawn = np.random.default_rng(0).choice(values, (_RESAMPLES, count))
    differences, errors = drawn.mean(axis=1) - mean, drawn.std(axis=1, ddof=1)
    equal = np.ptp(drawn, axis=1) == 0.0
    sides = np.sign(drawn[:, 0] - mean)
    differences[equal & (sides != 0)] = math.inf
    errors[equal] = np.where(sides[equal] < 0, -1.0, 1.0)
    scores = np.sort(differences / errors)
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = (
        mean - error * float(np.quantile(scores, part, method="nearest")) for part in (1 - tail, tail)
    )
    return low, high


def _merged(values: np.ndarray) -> np.ndarray:
    """Return numbers within -1 and 1, of which those are the same that only differ by rounding."""
    ordered, places = np.unique(values, return_inverse=True)
    is_other = np.concatenate(([True], np.diff(ordered) > _EQUAL))
    merged: np.ndarray = ordered[is_other][np.cumsum(is_other) - 1][places]
    return merged


def rate_difference(trials: int, only_first: int, only_second: int) -> Mean:
    """Return by how much the second of two rates is higher, of the same trials, with its interval.

    Source: D. Bonett and R. Price, "Adjusted Wald confidence interval for a difference of binomial
    proportions based on paired data", Journal of Educational and Behavioral Statistics 37 (2012).
    """
    lost, gained = ((each + 1) / (trials + 2) for each in (only_first, only_second))
    center = gained - lost
    reach = _normal() * math.sqrt((gained + lost - center**2) / (trials + 2))
    interval = max(-1.0, center - reach), min(1.0, center + reach)
    return Mean((only_second - only_first) / trials, trials, interval)


def figure(number: float, *, sign: bool = False) -> str:
    """Return a number with four digits, perhaps with its sign; a very large or small one has an exponent."""
    if not math.isfinite(number):
        return str(number)
    exact = Decimal(number)
    places = Decimal(1).scaleb(exact.adjusted() - _DIGITS + 1)
    rounded = exact.quantize(places, ROUND_HALF_UP, Context(prec=400))
    if not rounded or _PLAIN[0] <= rounded.adjusted() < _PLAIN[1]:
        return _plain(rounded, sign=sign)
    return f"{_plain(rounded.scaleb(-rounded.adjusted()), sign=sign)}e{rounded.adjusted()}"


def percent(part: float, *, sign: bool = False) -> str:
    """Return a part in percent, without the sign of that; perhaps with that of the number."""
    return _plain(Decimal(100 * part).quantize(Decimal("0.1"), ROUND_HALF_UP), sign=sign)


def _plain(number: Decimal, *, sign: bool) -> str:
    shown = number or Decimal(0)  # never -0
    text = f"{shown:+f}" if sign else f"{shown:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _normal() -> float:
    """Return the number of standard deviations within which the confidence lies."""
    return NormalDist().inv_cdf((1.0 + CONFIDENCE) / 2.0)


def require_scipy() -> Any:  # noqa: ANN401 - the module
    """Return the statistics of SciPy. Raises TrialsError without that package."""
    with TrialsError.in_place_of(
        ModuleNotFoundError, "trials need the package SciPy: pip install 'visualhfsm[trials]'"
    ):
        from scipy import stats  # takes a second to load: only who compares series waits for it
    return stats
