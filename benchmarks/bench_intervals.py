"""Measure how often the intervals of trials hold what they are of, and print the figures.

Means are of numbers that are drawn from a known distribution, 5,000 times for each count. `given` is the part
of the draws of which the mean gets an interval, `held` the part of these intervals with the true mean. None
may reach beyond what a number can be. A rate is counted exactly: of every number of successes that there can
be, with true rates from 1 to 99 %. Six minutes of one processor.

    python benchmarks/bench_intervals.py [--draws 5000] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from visualhfsm.trials._statistics import UNBOUNDED, mean_of, rarest, require_scipy, success_rate

COUNTS: Final = (4, 5, 10, 20, 50)
TRUE_RATES: Final = tuple(part / 100 for part in range(1, 100))

Draw = Callable[[np.random.Generator, int], np.ndarray]


class Distribution(NamedTuple):
    """How numbers are drawn, their true mean, and what a number can be."""

    draw: Draw
    mean: float
    bounds: tuple[float, float] = (0.0, math.inf)


def _mixture(random: np.random.Generator, count: int) -> np.ndarray:
    usual, rare = random.normal(1.0, 0.2, count), random.normal(10.0, 1.0, count)
    return np.where(random.random(count) < 0.1, rare, usual)


DISTRIBUTIONS: Final = {
    "normal, 3 ± 1": Distribution(lambda random, count: random.normal(3.0, 1.0, count), 3.0, UNBOUNDED),
    "exponential": Distribution(lambda random, count: random.exponential(1.0, count), 1.0),
    "lognormal, s = 1": Distribution(lambda random, count: random.lognormal(0.0, 1.0, count), math.exp(0.5)),
    "exponential, cut at 2": Distribution(
        lambda random, count: np.minimum(random.exponential(1.0, count), 2.0),
        1.0 - math.exp(-2.0),
        (0.0, 2.0),
    ),
    "1 in 30 %, else 0": Distribution(
        lambda random, count: 1.0 * (random.random(count) < 0.3), 0.3, (0.0, 1.0)
    ),
    "1 in 5 %, else 0": Distribution(
        lambda random, count: 1.0 * (random.random(count) < 0.05), 0.05, (0.0, 1.0)
    ),
    "0, 1, 5 in 60, 30, 10 %": Distribution(
        lambda random, count: random.choice([0.0, 1.0, 5.0], count, p=[0.6, 0.3, 0.1]), 0.8, (0.0, 5.0)
    ),
    "1 ± 0.2, in 10 % 10 ± 1": Distribution(_mixture, 1.9, UNBOUNDED),
}


def means(name: str, draws: int) -> list[tuple[float, float]]:
    """Return for each count which part of the draws has an interval, and which part of these holds."""
    draw, true, bounds = DISTRIBUTIONS[name]
    found = []
    for count in COUNTS:
        random = np.random.default_rng(count)
        intervals = [mean_of(draw(random, count).tolist(), bounds).interval for _ in range(draws)]
        given = [each for each in intervals if each is not None]
        if any(low < bounds[0] or high > bounds[1] for low, high in given):
            raise SystemExit(f"{name}: an interval of {count} numbers reaches beyond what they can be")
        held = sum(low <= true <= high for low, high in given)
        found.append((len(given) / draws, held / len(given) if given else math.nan))
    return found


def rates() -> list[tuple[float, float]]:
    """Return for each count how often the interval of a rate holds it: on average, and the least."""
    binomial = require_scipy().binom
    found = []
    for count in COUNTS:
        intervals = [success_rate(successes, count) for successes in range(count + 1)]
        held = [
            sum(
                binomial.pmf(successes, count, true)
                for successes, each in enumerate(intervals)
                if each.lowest <= true <= each.highest
            )
            for true in TRUE_RATES
        ]
        found.append((statistics.fmean(held), min(held)))
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=int, default=5000, metavar="N", help="series of each count")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to FILE")
    arguments = parser.parse_args()
    figures: dict[str, dict[int, tuple[float, float]]] = {}
    table = Table(title=f"Intervals of 95 % that hold what they are of, of {arguments.draws} draws")
    for column in ("mean of", *map(str, COUNTS)):
        table.add_column(column, justify="right" if column.isdigit() else "left")
    for name in DISTRIBUTIONS:
        found = means(name, arguments.draws)
        figures[name] = dict(zip(COUNTS, found, strict=True))
        table.add_row(name, *(f"{100 * held:.1f}" if given else "none" for given, held in found))
        table.add_row("  given", *(f"{100 * given:.1f}" for given, _ in found), style="dim")
    table.add_row("may be missing: rarer than", *(f"{100 * rarest(count):.0f}" for count in COUNTS))
    found = rates()
    figures["rate"] = dict(zip(COUNTS, found, strict=True))
    table.add_row("a rate, on average", *(f"{100 * mean:.1f}" for mean, _ in found))
    table.add_row("  at the worst rate", *(f"{100 * least:.1f}" for _, least in found), style="dim")
    Console(width=120).print(table)
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
