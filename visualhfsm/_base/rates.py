"""How many of some succeeded, in words and figures.

Figures are rounded half up, from their exact value, as JavaScript does it: terminal and page say the same.
"""

from __future__ import annotations

import math
from decimal import ROUND_HALF_UP, Decimal
from statistics import NormalDist
from typing import Final

import msgspec

CONFIDENCE: Final = 0.95


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
    """Return how many of some trials succeeded, with the interval."""
    if not trials:
        return Rate(0, 0, 0.0, 1.0)
    z = _normal()  # SciPy has this interval, too, but takes a second to load
    share, scale = successes / trials, 1.0 + z * z / trials
    center = (share + z * z / (2 * trials)) / scale
    reach = z / scale * math.sqrt(share * (1.0 - share) / trials + (z / (2 * trials)) ** 2)
    lowest = center - reach if successes else 0.0
    return Rate(successes, trials, lowest, center + reach if successes < trials else 1.0)


def percent(part: float, *, sign: bool = False) -> str:
    """Return a part in percent, without the sign of that; perhaps with that of the number."""
    return plain_number(Decimal(100 * part).quantize(Decimal("0.1"), ROUND_HALF_UP), sign=sign)


def plain_number(number: Decimal, *, sign: bool) -> str:
    """Return a rounded number without an exponent and zeros at its end, perhaps with its sign."""
    shown = number or Decimal(0)  # never -0
    text = f"{shown:+f}" if sign else f"{shown:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _normal() -> float:
    """Return the number of standard deviations within which the confidence lies."""
    return NormalDist().inv_cdf((1.0 + CONFIDENCE) / 2.0)
