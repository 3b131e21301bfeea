"""What a series of trials says: how often it succeeds, what that depends on, and how it fails."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from visualhfsm._csv_file import write_csv

from ._outcome import Outcome
from ._quantities import Value, Values
from ._record import read_outcomes
from ._statistics import Quartiles, Rate, quartiles, success_rate

_BINS: Final = 5
_WORST: Final = 10
_SHOWN_WAYS: Final = 5


class Row(NamedTuple):
    """What is kept of an outcome."""

    number: int
    values: Values
    success: bool
    reason: str
    states: str
    time: float
    numbers: Mapping[str, float]


class Part(NamedTuple):
    """The trials in which a quantity had a value, or one within a range."""

    label: str
    rate: Rate


class Way(NamedTuple):
    """A way to fail: the reason, the states at the end, and the numbers of the trials."""

    reason: str
    states: str
    numbers: Sequence[int]


class Map(NamedTuple):
    """The places of a thing that were drawn, in m, each with whether the trial succeeded."""

    thing: str
    places: Sequence[tuple[float, float, bool, int]]
    """x, y, success, number."""


class Summary:
    """A series of trials in figures. `varying` are the quantities that differ from trial to trial."""

    def __init__(self, outcomes: Iterable[Outcome], varying: Sequence[str]) -> None:
        rows = [
            Row(o.number, o.values, o.success, o.reason, o.states, o.time, {"time": o.time, **o.numbers})
            for o in outcomes
        ]
        self.rows: Final = sorted(rows)
        """The trials by number."""
        self.varying: Final = tuple(varying)

    def __str__(self) -> str:
        """Return the rate, and the commonest ways to fail."""
        ways = [f"{len(way.numbers)} {way.reason} in {way.states}" for way in self.ways[:_SHOWN_WAYS]]
        return f"{self.rate.successes} of {self.rate.trials} succeed: {self.rate}" + "".join(
            f"\n  {way}" for way in ways
        )

    __repr__ = __str__

    @cached_property
    def rate(self) -> Rate:
        """How often it succeeds."""
        return success_rate(sum(row.success for row in self.rows), len(self.rows))

    @cached_property
    def numbers(self) -> dict[str, Quartiles]:
        """The distribution of each number over the successful trials; over all, when none is."""
        rows = [row for row in self.rows if row.success] or self.rows
        found: defaultdict[str, list[float]] = defaultdict(list)
        for row in rows:
            for name, number in row.numbers.items():
                found[name].append(number)
        return {name: quartiles(numbers) for name, numbers in found.items()}

    @cached_property
    def dependences(self) -> dict[str, list[Part]]:
        """How often it succeeds by each quantity that varies: by value, or in ranges of equal numbers."""
        return {name: parts for name in self.varying if len(parts := self._parts(name)) > 1}

    @cached_property
    def ways(self) -> list[Way]:
        """The ways in which it fails, the commonest first."""
        found: defaultdict[tuple[str, str], list[int]] = defaultdict(list)
        for row in self.rows:
            if not row.success:
                found[row.reason, row.states].append(row.number)
        ways = [Way(reason, states, numbers) for (reason, states), numbers in found.items()]
        return sorted(ways, key=lambda way: (-len(way.numbers), way.numbers[0]))

    @cached_property
    def worst(self) -> list[Row]:
        """The ten worst trials: those that fail, of rare ways first, then the slowest ones."""
        rarity = Counter((row.reason, row.states) for row in self.rows if not row.success)
        ranked = sorted(
            self.rows,
            key=lambda row: (row.success, rarity[row.reason, row.states], -row.time, row.number),
        )
        return ranked[:_WORST]

    @cached_property
    def maps(self) -> list[Map]:
        """The drawn places of the robot and of things: those with an x and a y."""
        things = [name.removesuffix(".x") for name in self.varying if name.endswith(".x")]
        return [
            Map(
                thing,
                [
                    (
                        _float(row.values[f"{thing}.x"]),
                        _float(row.values[f"{thing}.y"]),
                        row.success,
                        row.number,
                    )
                    for row in self.rows
                ],
            )
            for thing in things
            if f"{thing}.y" in self.varying
        ]

    def _parts(self, name: str) -> list[Part]:
        rows = [row for row in self.rows if name in row.values]
        values = [row.values[name] for row in rows]
        distinct = sorted(set(values), key=lambda value: (str(type(value)), value))
        if len(distinct) <= _BINS or any(isinstance(value, str | bool) for value in values):
            return [
                Part(_shown(value), self._rate(row for row in rows if row.values[name] == value))
                for value in distinct
            ]
        edges = np.quantile([_float(value) for value in values], np.linspace(0.0, 1.0, _BINS + 1)).tolist()
        parts = []
        for low, high in pairwise(edges):
            end = math.inf if high == edges[-1] else high
            inside = [row for row in rows if low <= _float(row.values[name]) < end]
            if inside:
                parts.append(Part(f"{_shown(low)} to {_shown(high)}", self._rate(inside)))
        return parts

    @staticmethod
    def _rate(rows: Iterable[Row]) -> Rate:
        successes = [row.success for row in rows]
        return success_rate(sum(successes), len(successes))


def summarize(path: Path, varying: Sequence[str], runs: int) -> Summary:
    """Return the summary of the first `runs` trials in a file of outcomes. Raises TrialsError."""
    return Summary((each for each in read_outcomes(path) if each.number < runs), varying)


def write_table(path: Path, summary: Summary) -> None:
    """Write a row for each trial as CSV: what it came to, its quantities, and its numbers.

    Raises VisualHfsmError.
    """
    values = list(dict.fromkeys(name for row in summary.rows for name in row.values))
    numbers = list(dict.fromkeys(name for row in summary.rows for name in row.numbers))
    rows = [
        [
            row.number,
            row.success,
            row.reason,
            row.states,
            *(row.values.get(name, "") for name in values),
            *(row.numbers.get(name, "") for name in numbers),
        ]
        for row in summary.rows
    ]
    write_csv(path, [["number", "success", "reason", "states", *values, *numbers], *rows])


def _float(value: Value) -> float:
    return float(value)


def _shown(value: Value) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
