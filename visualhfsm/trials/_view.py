"""A summary of trials as the page draws it, in JSON."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Final

import msgspec
import numpy as np

from ._outcome import Change, Outcome
from ._plan import Plan
from ._quantities import Value
from ._record import read_outcomes
from ._statistics import Rate
from ._summary import Row, Summary

_BARS: Final = 20
_MOST_WAYS: Final = 12
_MOST_NUMBERS: Final = 50
_MOST_MEANS: Final = 6
_DIGITS: Final = 4


class _View(msgspec.Struct, frozen=True, rename="camel"):
    pass


class Share(_View, frozen=True):
    """How many of some trials succeed, with the interval of the true rate."""

    successes: int
    trials: int
    lowest: float
    highest: float


class Histogram(_View, frozen=True):
    """A number over all trials: between two `edges` so many `good` and `bad` trials."""

    name: str
    median: float
    lower: float
    upper: float
    edges: list[float]
    good: list[int]
    bad: list[int]


class Part(_View, frozen=True):
    """The trials with a value of a quantity, or one in a range, and the means of the plan's own numbers."""

    label: str
    share: Share
    means: list[tuple[str, float]]


class Dependence(_View, frozen=True):
    """How success depends on a quantity."""

    name: str
    parts: list[Part]


class PlaceMap(_View, frozen=True):
    """The places of a thing in m, with success and number of each trial, and lines on the floor."""

    thing: str
    places: list[tuple[float, float, bool, int]]
    lines: list[tuple[float, float, float, float]]


class TrialTimeline(_View, frozen=True):
    """The states of a trial up to its end."""

    number: int
    end: float
    changes: list[Change]


class Way(_View, frozen=True):
    """A way to fail: so many trials, the numbers of some, and the timeline of one."""

    reason: str
    states: str
    count: int
    numbers: list[int]
    timeline: TrialTimeline


class Trial(_View, frozen=True):
    """One of the worst trials; `page` is that of its recording, if there is one."""

    number: int
    success: bool
    reason: str
    time: float
    states: str
    values: list[tuple[str, str]]
    timeline: TrialTimeline
    page: str = ""


class TrialsView(_View, frozen=True):
    """A series of trials; `planned` are more than `share.trials` while it runs."""

    name: str
    planned: int
    share: Share
    histograms: list[Histogram]
    dependences: list[Dependence]
    maps: list[PlaceMap]
    ways: list[Way]
    worst: list[Trial]


def view_of(plan: Plan, summary: Summary, file: Path, pages: Mapping[int, str] | None = None) -> TrialsView:
    """Return the view of a summary; `file` has its outcomes. `pages` are those of recordings by number."""
    ways = summary.ways[:_MOST_WAYS]
    wanted = {way.numbers[0] for way in ways} | {row.number for row in summary.worst}
    timelines = _timelines(read_outcomes(file), wanted)
    return TrialsView(
        name=Path(plan.document).stem,
        planned=plan.runs,
        share=_share(summary.rate),
        histograms=_histograms(summary),
        dependences=[
            Dependence(name, [Part(part.label, _share(part.rate), _means(part.means)) for part in parts])
            for name, parts in summary.dependences.items()
        ],
        maps=_maps(plan, summary),
        ways=[
            Way(
                way.reason,
                way.states,
                len(way.numbers),
                [*way.numbers[:_MOST_NUMBERS]],
                timelines[way.numbers[0]],
            )
            for way in ways
        ],
        worst=[
            _trial(row, timelines[row.number], (pages or {}).get(row.number, "")) for row in summary.worst
        ],
    )


def _share(rate: Rate) -> Share:
    return Share(rate.successes, rate.trials, round(rate.lowest, _DIGITS), round(rate.highest, _DIGITS))


def _means(means: Mapping[str, float]) -> list[tuple[str, float]]:
    return [(name, _rounded(mean)) for name, mean in islice(means.items(), _MOST_MEANS)]


def _timelines(outcomes: Iterable[Outcome], wanted: set[int]) -> dict[int, TrialTimeline]:
    return {
        outcome.number: TrialTimeline(outcome.number, outcome.time, [*outcome.changes])
        for outcome in outcomes
        if outcome.number in wanted
    }


def _histograms(summary: Summary) -> list[Histogram]:
    found = []
    for name, figures in summary.numbers.items():
        rows = [row for row in summary.rows if name in row.numbers]
        numbers = np.array([row.numbers[name] for row in rows])
        if np.ptp(numbers) == 0.0:
            continue
        edges = np.histogram_bin_edges(numbers, _BARS)
        good = np.array([row.success for row in rows])
        found.append(
            Histogram(
                name,
                _rounded(figures.median),
                _rounded(figures.lower),
                _rounded(figures.upper),
                [_rounded(edge) for edge in edges.tolist()],
                np.histogram(numbers[good], edges)[0].tolist(),
                np.histogram(numbers[~good], edges)[0].tolist(),
            )
        )
    return found


def _maps(plan: Plan, summary: Summary) -> list[PlaceMap]:
    lines = _floor(plan)
    return [
        PlaceMap(each.thing, [(round(x, 3), round(y, 3), good, n) for x, y, good, n in each.places], lines)
        for each in summary.maps
    ]


def _floor(plan: Plan) -> list[tuple[float, float, float, float]]:
    """Return the lines of a soccer field, if the trials are on one."""
    world = plan.scene.get("world")
    if not isinstance(world, str) or plan.robot != "sim":
        return []
    from naoserver_sim.world import load_world  # needs the package MuJoCo

    field = load_world(str(Path(plan.document).parent / world) if world.endswith(".toml") else world).field
    return [] if field is None else [(*begin, *end) for begin, end in field.lines()]


def _trial(row: Row, timeline: TrialTimeline, page: str) -> Trial:
    values = [(name, _shown(value)) for name, value in (row.values | row.numbers).items() if name != "time"]
    return Trial(row.number, row.success, row.reason, row.time, row.states, values, timeline, page)


def _shown(value: Value) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _rounded(number: float) -> float:
    return float(f"{number:.6g}")


__all__: Sequence[str] = ["TrialsView", "view_of"]
