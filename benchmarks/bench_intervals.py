"""Measure how often the intervals of trials hold what they are of, and print the figures.

Means are of numbers that are drawn from a known distribution, 2,000 times for each count. `given` is the part
of the draws of which the mean gets an interval, `held` the part of these intervals with the true mean. A rate
is counted exactly: of every number of successes that there can be, with true rates from 5 to 95 %. Five
minutes of one processor.

    python benchmarks/bench_intervals.py [--draws 2000] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from visualhfsm.trials._statistics import mean_of, require_scipy, success_rate

COUNTS: Final = (3, 4, 5, 7, 10, 15, 20, 30, 50)
MANY: Final = 20
"""From so many numbers on a mean is to be held as often as the goal of its distribution says."""
FEW_GOAL: Final = 0.90
"""How often an interval of fewer is to hold it, if there is one."""
RATE_GOAL: Final = 0.94
TRUE_RATES: Final = tuple(part / 100 for part in range(5, 96))

Draw = Callable[[np.random.Generator, int], np.ndarray]
DISTRIBUTIONS: Final[dict[str, tuple[Draw, float, float]]] = {
    "exponential": (lambda random, count: random.exponential(1.0, count), 1.0, 0.92),
    "uniform": (lambda random, count: random.uniform(0.0, 1.0, count), 0.5, 0.94),
    "0 or 1, each as likely": (lambda random, count: 1.0 * (random.random(count) < 0.5), 0.5, 0.94),
    "1 in 20 %, otherwise 0": (lambda random, count: 1.0 * (random.random(count) < 0.2), 0.2, 0.94),
}
"""How numbers are drawn, their true mean, and the goal."""


def means(name: str, draws: int) -> list[tuple[float, float]]:
    """Return for each count which part of the draws has an interval, and which part of these holds."""
    draw, true, _ = DISTRIBUTIONS[name]
    random = np.random.default_rng(1)
    found = []
    for count in COUNTS:
        intervals = [mean_of(draw(random, count).tolist()).interval for _ in range(draws)]
        given = [each for each in intervals if each is not None]
        held = sum(low <= true <= high for low, high in given)
        found.append((len(given) / draws, held / len(given) if given else float("nan")))
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
    parser.add_argument("--draws", type=int, default=2000, metavar="N", help="series of each count")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to FILE")
    arguments = parser.parse_args()
    figures: dict[str, dict[int, tuple[float, float]]] = {}
    table = Table(title=f"Intervals of 95 % that hold what they are of, of {arguments.draws} draws")
    for column in ("mean of", *map(str, COUNTS), "goal"):
        table.add_column(column, justify="right" if column.isdigit() else "left")
    for name, (_, _, goal) in DISTRIBUTIONS.items():
        found = means(name, arguments.draws)
        figures[name] = dict(zip(COUNTS, found, strict=True))
        table.add_row(
            name,
            *(f"{100 * held:.1f}" if given else "none" for given, held in found),
            f">= {100 * goal:.0f} from {MANY}, {100 * FEW_GOAL:.0f} below",
        )
        table.add_row("  given", *(f"{100 * given:.1f}" for given, _ in found), "", style="dim")
    found = rates()
    figures["rate"] = dict(zip(COUNTS, found, strict=True))
    table.add_row(
        "a rate, on average", *(f"{100 * mean:.1f}" for mean, _ in found), f">= {100 * RATE_GOAL:.0f}"
    )
    table.add_row("  at the worst rate", *(f"{100 * least:.1f}" for _, least in found), "", style="dim")
    Console(width=120).print(table)
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
