"""The statistics of trials, and their figures in words; SciPy does what it has.

Figures are rounded half up, from their exact value, as JavaScript does it: terminal and page say the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Context, Decimal
from functools import lru_cache
from statistics import NormalDist
from typing import Any, Final

import numpy as np

from visualhfsm.plugins import CONFIDENCE, plain_number
from visualhfsm.trials import TrialsError

FEWEST: Final = 5
"""Numbers of which a mean gets an interval: of fewer, none holds the true mean often enough."""
UNBOUNDED: Final = (-math.inf, math.inf)
SMALL: Final = 20
"""Fewer trials say little: of so many, the interval of a rate is some 40 % wide."""
_RESAMPLES: Final = 4999
_KEPT: Final = 200
"""For so many numbers, what is random in an interval is kept for the next one; for more it is too much."""
_BEYOND: Final = 2.0  # spacings from the last number to where the end of all may be
_FEW: Final = 3  # different values, beside which rare ones may well be missing
_FAR: Final = 2.0 / 3.0  # of the range of all: a number farther from the next is far from the others
_EQUAL: Final = 1e-9
"""Part of the largest number within which all others are the same as it, but for rounding."""
_DIGITS: Final = 4
_PLAIN: Final = (-6, 12)
"""Exponents from and to which a number is written without one."""


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

    `why` says why there is none, "in each" if all numbers are the same; beside an interval, why it may not
    hold the mean. `rarest` says of what no interval knows.
    """

    mean: float
    count: int
    interval: tuple[float, float] | None = None
    why: str = ""


def mean_of(numbers: Sequence[float], bounds: tuple[float, float] = UNBOUNDED) -> Mean:
    """Return the mean of at least one number, with its interval; `bounds` are what a number may be.

    The interval is Gaffke's: of random weights of the sorted numbers and one more at the end, as between
    order statistics. The end is the bound, or two spacings beyond the last number, where Robson and Whitlock
    take it to be with a confidence of 2/3. Of two values it is Clopper and Pearson's, up to chance. From
    `SMALL` numbers on, the bootstrap-t makes it narrower, whose ends fly off for fewer. The same numbers give
    the same interval; plugins/trials/benchmarks/bench_trials.py says how often it holds the mean.

    Sources: N. Gaffke, "Three test statistics for a nonparametric one-sided hypothesis on the mean of a
    nonnegative variable", Mathematical Methods of Statistics 14 (2005); D. Robson and J. Whitlock,
    "Estimation of a truncation point", Biometrika 51 (1964); B. Efron and R. Tibshirani, An Introduction to
    the Bootstrap (1993), chapter 12.
    """
    values = np.sort(np.asarray(numbers, float))
    exponent = int(np.frexp(np.max(np.abs(values)))[1])  # sums and squares may be too large or too small
    scaled = np.ldexp(values, -exponent)
    mean, count = float(np.ldexp(scaled.mean(), exponent)), len(values)
    if count < FEWEST:
        return Mean(mean, count, why=f"(fewer than {FEWEST} trials)")
    if np.ptp(scaled) <= _EQUAL * np.max(np.abs(scaled)):
        return Mean(mean, count, why="in each")
    merged = _merged(scaled)
    low, high = np.ldexp(_interval(merged, *np.ldexp(bounds, -exponent)), exponent).tolist()
    return Mean(mean, count, (low, high), _doubt(merged))


def rarest(count: int) -> float:
    """Return at which rate something occurs at least once in so many trials, 95 times in 100.

    Source: J. Hanley and A. Lippman-Hand, Journal of the American Medical Association 249 (1983), 1743.
    """
    return float(1.0 - (1.0 - CONFIDENCE) ** (1.0 / count))


def _interval(values: np.ndarray, lowest: float, highest: float) -> tuple[float, float]:
    """Return the interval of the mean of sorted numbers within -1 and 1."""
    count, tail = len(values), (1.0 - CONFIDENCE) / 2.0
    beyond = _BEYOND * (np.diff(values)[[0, -1]] if len(np.unique(values)) > 2 else np.zeros(2))
    least = max(lowest, values[0] - beyond[0])
    most = min(highest, values[-1] + beyond[1])
    weights, places = (_chances if count <= _KEPT else _chances.__wrapped__)(count)
    low = float(np.quantile(weights @ np.concatenate(([least], values)), tail))
    high = float(np.quantile(weights @ np.concatenate((values, [most])), 1.0 - tail))
    if count < SMALL:
        return low, high
    mean, error = float(values.mean()), float(values.std(ddof=1))
    drawn = values[places]
    errors = np.maximum(drawn.std(axis=1, ddof=1), _EQUAL * _EQUAL)  # 0 where all are equal
    scores = (drawn.mean(axis=1) - mean) / errors
    first, last = np.quantile(scores, (1.0 - tail, tail), method="nearest").tolist()
    return max(low, mean - error * first), min(high, mean - error * last)


@lru_cache(maxsize=2)
def _chances(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return random weights of so many numbers and one more, and places of numbers that are drawn."""
    random = np.random.default_rng(0)
    weights = random.standard_exponential((_RESAMPLES, count + 1))
    weights /= weights.sum(axis=1, keepdims=True)
    return weights, random.integers(0, count, (_RESAMPLES if count >= SMALL else 0, count))


def _doubt(values: np.ndarray) -> str:
    """Return why sorted numbers say little of their mean; of five normal ones, 8 % have a far one.

    Source: the ratio Q of R. Dean and W. Dixon, Analytical Chemistry 23 (1951), 636.
    """
    if len(np.unique(values)) <= _FEW:
        return "(few different values)"
    far = np.diff(values)[[0, -1]].max() > _FAR * np.ptp(values)
    return "(one number is far from the others)" if far else ""


def _merged(values: np.ndarray) -> np.ndarray:
    """Return numbers within -1 and 1; numbers that differ only by rounding become the same."""
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
        return plain_number(rounded, sign=sign)
    return f"{plain_number(rounded.scaleb(-rounded.adjusted()), sign=sign)}e{rounded.adjusted()}"


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
