"""What a series of trials says: how often it succeeds, what that depends on, and how it fails."""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

import msgspec
import numpy as np

from codegen.files import read_regular
from visualhfsm import VisualHfsmError
from visualhfsm.plugins import Rate, csv_text, success_rate, write_csv
from visualhfsm.trials import Outcome, Value

from ._record import read_looks, read_outcomes
from ._statistics import Quartiles, quartiles

_BINS: Final = 5
_MOST_VALUES: Final = 10
"""A quantity that has no more values is shown by each of them, unless each trial has its own."""
_BIN: Final = 5
"""Trials that are at least to be in a bin of few trials."""
_NOTED: Final = frozenset({"time", "calls", "cycles", "distance"})
"""Numbers of every trial; the others are the plan's."""
_WORST: Final = 10
_SHOWN_WAYS: Final = 5
_FIGURE: Final = re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?")


class Part(NamedTuple):
    """The trials in which a quantity had a value, or one within a range."""

    label: str
    rate: Rate
    means: Mapping[str, float]
    """The mean of each number of the plan, whether the trials succeed or not."""


class FailureGroup(NamedTuple):
    """A way to fail: the reason, the states at the end, and the numbers of the trials.

    Reasons that only differ in figures are one; here stands that of the first trial.
    """

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

    def __init__(
        self, outcomes: Iterable[Outcome], varying: Sequence[str], looks: Sequence[int] = ()
    ) -> None:
        self.rows: Final = sorted(map(_kept, outcomes), key=lambda row: row.number)
        """The trials by number: groups are among their values, and the time among their numbers."""
        self.varying: Final = (*varying, *dict.fromkeys(name for row in self.rows for name in row.groups))
        self.looks: Final = tuple(looks)
        """The numbers of trials asked for, one after the other: if several, some came after a look."""

    def __str__(self) -> str:
        """Return the rate, and the commonest ways to fail."""
        ways = [f"{len(way.numbers)} {way.reason} in {way.states}" for way in self.ways[:_SHOWN_WAYS]]
        if (more := len(self.ways) - _SHOWN_WAYS) > 0:
            ways.append(f"and {more} other way{'s' if more > 1 else ''}")
        return f"{self.rate.successes} of {self.rate.trials} succeed: {self.rate}" + "".join(
            f"\n  {line}" for line in (*self.warnings, *ways)
        )

    __repr__ = __str__

    @property
    def warnings(self) -> list[str]:
        """Why the rate says less than its figures, in sentences."""
        trials = self.rate.trials
        start = f"Success is true from the start in {self.from_start} of {trials}: that says nothing."
        equal = f"The {trials} trials are equal: they say as much as one."
        return [words for words, holds in ((start, self.from_start), (equal, self.are_equal)) if holds]

    @cached_property
    def from_start(self) -> int:
        """How many succeed before anything happens."""
        return sum(row.success and row.time == 0.0 for row in self.rows)

    @cached_property
    def are_equal(self) -> bool:
        """Whether there are several trials, and nothing differs between them."""
        rows = [msgspec.structs.replace(row, number=0) for row in self.rows]
        return len(rows) > 1 and all(row == rows[0] for row in rows)

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
        """How it goes by each quantity that varies: by value, or in ranges with equally many trials."""
        return {name: parts for name in self.varying if len(parts := self._parts(name)) > 1}

    @cached_property
    def own_numbers(self) -> tuple[str, ...]:
        """The names of the numbers that the plan asks for."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row.numbers if name not in _NOTED))

    @cached_property
    def ways(self) -> list[FailureGroup]:
        """The ways in which it fails, the commonest first."""
        found: defaultdict[tuple[str, str], list[Outcome]] = defaultdict(list)
        for row in self.rows:
            if not row.success:
                found[_way(row)].append(row)
        ways = [
            FailureGroup(rows[0].reason, rows[0].states, [row.number for row in rows])
            for rows in found.values()
        ]
        return sorted(ways, key=lambda way: (-len(way.numbers), way.numbers[0]))

    @cached_property
    def worst(self) -> list[Outcome]:
        """The ten worst trials: those that fail, of rare ways first, then the slowest; of equal ones, one."""
        rarity = Counter(_way(row) for row in self.rows if not row.success)
        ranked = sorted(self.rows, key=lambda row: (row.success, rarity[_way(row)], -row.time, row.number))
        return ranked[: 1 if self.are_equal else _WORST]

    @cached_property
    def maps(self) -> list[Map]:
        """The drawn places of the robot and of things: those with an x and a y."""
        found = []
        for x in self.varying:
            thing, y = x.removesuffix(".x"), f"{x.removesuffix('.x')}.y"
            if x != thing and y in self.varying:
                rows = [row for row in self.rows if {x, y} <= row.values.keys()]
                places = [
                    (float(row.values[x]), float(row.values[y]), row.success, row.number) for row in rows
                ]
                found.append(Map(thing, places))
        return found

    def _parts(self, name: str) -> list[Part]:
        rows = [row for row in self.rows if name in row.values]
        values = [row.values[name] for row in rows]
        distinct = sorted(set(values), key=lambda value: (str(type(value)), value))
        repeated = len(distinct) <= _MOST_VALUES and len(distinct) < max(len(rows), _BIN + 1)
        if repeated or any(isinstance(value, str | bool) for value in values):
            return [
                self._part(_shown(value), [row for row in rows if row.values[name] == value])
                for value in distinct
            ]
        bins = min(_BINS, max(2, len(rows) // _BIN))
        edges = np.quantile([float(value) for value in values], np.linspace(0.0, 1.0, bins + 1)).tolist()
        parts = []
        for low, high in pairwise(edges):
            end = math.inf if high == edges[-1] else high
            inside = [row for row in rows if low <= float(row.values[name]) < end]
            if inside:
                parts.append(self._part(f"{_shown(low)} to {_shown(high)}", inside))
        return parts

    def _part(self, label: str, rows: Sequence[Outcome]) -> Part:
        rate = success_rate(sum(row.success for row in rows), len(rows))
        numbers = {
            name: [row.numbers[name] for row in rows if name in row.numbers] for name in self.own_numbers
        }
        return Part(label, rate, {name: float(np.mean(each)) for name, each in numbers.items() if each})


def summarize(path: Path, varying: Sequence[str], runs: float = math.inf) -> Summary:
    """Return the summary of the trials in a file of outcomes, or the first `runs`. Raises TrialsError."""
    outcomes = (each for each in read_outcomes(path) if each.number <= runs)
    return Summary(outcomes, varying, read_looks(path))


def write_table(path: Path, summary: Summary, known: Summary | None = None) -> None:
    """Write a row for each trial as CSV: what it came to, its quantities, and its numbers.

    Raises VisualHfsmError, also when a table is there with anything that is not in that of all trials that
    are `known`, if they are given: somebody has changed it.
    """
    if known is not None and _was_changed(path, csv_text(_table(known))):
        raise VisualHfsmError.because(
            "{path} was changed since it was written, and is kept: move it for a table of all trials",
            path=str(path),
        )
    write_csv(path, _table(summary))


def _table(summary: Summary) -> list[list[str | float]]:
    values = list(dict.fromkeys(name for row in summary.rows for name in row.values))
    numbers = list(dict.fromkeys(name for row in summary.rows for name in row.numbers))
    rows: list[list[str | float]] = [
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
    return [["number", "success", "reason", "states", *values, *numbers], *rows]


def _was_changed(path: Path, table: str) -> bool:
    """Return whether a table has anything that a later one does not have."""
    try:
        there = read_regular(path).decode("utf-8-sig")
    except FileNotFoundError:
        return False
    except (OSError, UnicodeDecodeError):
        return True
    now = {row["number"]: row for row in csv.DictReader(io.StringIO(table, newline=""))}
    rows = [*csv.DictReader(io.StringIO(there, newline=""))]
    return (bool(there) and not rows) or any(
        value and value != now.get(row.get("number", ""), {}).get(name)
        for row in rows
        for name, value in row.items()
    )


def _kept(outcome: Outcome) -> Outcome:
    """Return what is kept of an outcome: there may be a million."""
    return msgspec.structs.replace(
        outcome,
        values={**outcome.values, **outcome.groups},
        numbers={"time": outcome.time, **outcome.numbers},
        changes=(),
        left_out=0,
        error="",
    )


def _way(row: Outcome) -> tuple[str, str]:
    """Return what trials have in common that fail in the same way."""
    return _FIGURE.sub("#", row.reason), row.states


def _shown(value: Value) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
