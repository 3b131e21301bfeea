"""Results of the benchmark: figures with their requirements, and tables of measurements."""

from __future__ import annotations

import json
import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

SMALLEST_QUARTILES: Final = 4


@dataclass(frozen=True)
class Effort:
    """The duration of measurements."""

    quick: bool = False
    soak_minutes: float = 20.0

    def rounds(self, full: int) -> int:
        """Return the number of interleaved rounds, given that of a full run."""
        return max(2, full // 8) if self.quick else full

    def seconds(self, full: float) -> float:
        """Return the duration of a part, given that of a full run."""
        return max(0.5, full / 8) if self.quick else full


@dataclass(frozen=True)
class Figure:
    """A required figure."""

    what: str
    asked: str
    measured: str
    met: bool


@dataclass(frozen=True)
class Table:
    """Detailed measurements of a section."""

    title: str
    columns: list[str]
    rows: list[list[str]]


@dataclass
class Section:
    """The results of one subject; `plot` is the data of its panel."""

    name: str
    figures: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    plot: dict[str, Any] = field(default_factory=dict)
    run: dict[str, str] = field(default_factory=dict)
    """Time, options and machine of the measurement."""

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(self)) + "\n")

    @classmethod
    def load(cls, path: Path) -> Section:
        """Read a file written by `save`."""
        data = json.loads(path.read_text())
        data["figures"] = [Figure(**figure) for figure in data["figures"]]
        data["tables"] = [Table(**table) for table in data["tables"]]
        return cls(**data)


@dataclass(frozen=True)
class Spread:
    """The median and the quartiles of the rounds."""

    median: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{_short(self.median)} ({_short(self.low)} to {_short(self.high)})"


def spread(values: Sequence[float]) -> Spread:
    """Return the median and the quartiles."""
    if len(values) < SMALLEST_QUARTILES:
        return Spread(statistics.median(values), min(values), max(values))
    low, median, high = statistics.quantiles(values, n=4, method="inclusive")
    return Spread(median, low, high)


def ratio(numerator: Sequence[float], denominator: Sequence[float]) -> Spread:
    """Return the spread of the ratios of the rounds."""
    return spread([above / below for above, below in zip(numerator, denominator, strict=True)])


def percentile(values: Sequence[float], share: float) -> float:
    """Return the value below which this share of all values is."""
    ordered = sorted(values)
    return ordered[min(int(len(ordered) * share), len(ordered) - 1)]


def thinned(values: Sequence[float], most: int = 500) -> list[float]:
    """Return quantiles with the same distribution as all values."""
    ordered = sorted(values)
    last = len(ordered) - 1
    count = min(len(ordered), most)
    return [float(f"{ordered[number * last // max(count - 1, 1)]:.4g}") for number in range(count)]


def microseconds(seconds: float) -> str:
    """Return a time for a table."""
    return _short(seconds * 1e6)


def milliseconds(seconds: float) -> str:
    """Return a time for a table."""
    return _short(seconds * 1e3)


def _short(value: float) -> str:
    return f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"
