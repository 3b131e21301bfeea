"""A summary of trials as the page draws it, of limited size: texts come from code of users."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import islice
from pathlib import Path
from typing import Final

import numpy as np

from codegen.messages import Message
from visualhfsm.trials import Outcome, Plan, StateChange, Value, failure_said

from ._messages import (
    Dependence,
    FailureView,
    Histogram,
    PartView,
    PlaceMap,
    Trial,
    TrialsView,
    TrialTimeline,
)
from ._record import read_outcomes
from ._statistics import figure
from ._summary import Map, Summary

_BARS: Final = 20
_MOST_LOOKS: Final = 50
_MOST_WAYS: Final = 12
_MOST_NUMBERS: Final = 50
_MOST_MEANS: Final = 6
_MOST_PLOTS: Final = 20
_MOST_PARTS: Final = 40
_MOST_VALUES: Final = 60
_MOST_PLACES: Final = 2000
"""Places of all maps together."""
_LONGEST_TEXT: Final = 300
_LONGEST_STATES: Final = 100
"""Characters of the states in a timeline, which has many."""
_SAME: Final = 1e-6
"""Part of a number below which its differences are not worth a drawing."""


def view_of(plan: Plan, summary: Summary, file: Path, pages: Mapping[int, str] | None = None) -> TrialsView:
    """Return the view of a summary; `file` has its outcomes. `pages` are those of recordings by number."""
    ways, own = summary.ways[:_MOST_WAYS], summary.own_numbers[:_MOST_MEANS]
    wanted = {way.numbers[0] for way in ways} | {row.number for row in summary.worst}
    timelines = _timelines(read_outcomes(file), wanted)
    return TrialsView(
        name=Path(plan.document).stem,
        planned=plan.runs,
        looks=[*summary.looks[-_MOST_LOOKS:]],
        share=summary.rate,
        histograms=_histograms(summary),
        dependences=[
            Dependence(
                _cut(name),
                [
                    PartView(_cut(each.label), each.rate, _means(each.means, own))
                    for each in parts[:_MOST_PARTS]
                ],
            )
            for name, parts in islice(summary.dependences.items(), _MOST_PLOTS)
        ],
        maps=_maps(plan, summary),
        ways=[
            FailureView(
                _reason(way.reason),
                _cut(way.states),
                len(way.numbers),
                [*way.numbers[:_MOST_NUMBERS]],
                timelines[way.numbers[0]],
            )
            for way in ways
        ],
        worst=[
            _trial(row, timelines[row.number], (pages or {}).get(row.number, "")) for row in summary.worst
        ],
        from_start=summary.from_start,
        equal=summary.are_equal,
    )


def _means(means: Mapping[str, float], names: Iterable[str]) -> list[tuple[str, float]]:
    return [(_cut(name), means[name]) for name in names if name in means]


def _timelines(outcomes: Iterable[Outcome], wanted: set[int]) -> dict[int, TrialTimeline]:
    return {
        outcome.number: TrialTimeline(
            outcome.number,
            outcome.time,
            [StateChange(each.time, _cut(each.states, _LONGEST_STATES)) for each in outcome.changes],
        )
        for outcome in outcomes
        if outcome.number in wanted
    }


def _histograms(summary: Summary) -> list[Histogram]:
    found = []
    for name, figures in islice(summary.numbers.items(), _MOST_PLOTS):
        rows = [row for row in summary.rows if name in row.numbers]
        numbers = np.array([row.numbers[name] for row in rows])
        if np.ptp(numbers) <= _SAME * np.max(np.abs(numbers)):
            continue
        edges = np.histogram_bin_edges(numbers, _BARS)
        good = np.array([row.success for row in rows])
        found.append(
            Histogram(
                _cut(name),
                figures.median,
                figures.lower,
                figures.upper,
                edges.tolist(),
                np.histogram(numbers[good], edges)[0].tolist(),
                np.histogram(numbers[~good], edges)[0].tolist(),
            )
        )
    return found


def _maps(plan: Plan, summary: Summary) -> list[PlaceMap]:
    maps = summary.maps[:_MOST_PLOTS]
    lines = _floor(plan) if maps else []
    return [_map(each, _MOST_PLACES // len(maps), lines) for each in maps]


def _line(ends: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    x, y, end_x, end_y = (round(each, 3) for each in ends)
    return x, y, end_x, end_y


def _map(found: Map, most: int, lines: list[tuple[float, float, float, float]]) -> PlaceMap:
    every = -(-len(found.places) // most)
    shown = [
        (round(x, 3), round(y, 3), good, number) for x, y, good, number in found.places if number % every == 0
    ]
    return PlaceMap(_cut(found.thing), shown, len(found.places), lines)


def _floor(plan: Plan) -> list[tuple[float, float, float, float]]:
    """Return the lines of a soccer field, if the trials are on one."""
    world = plan.scene.get("world")
    if not isinstance(world, str) or plan.robot != "sim":
        return []
    from naoserver.soccer_field import FieldLines
    from naoserver_sim.world import load_world  # needs the package MuJoCo

    field = load_world(str(Path(plan.document).parent / world) if world.endswith(".toml") else world).field
    return [] if field is None else [*map(_line, FieldLines(field).segments)]


def _trial(row: Outcome, timeline: TrialTimeline, page: str) -> Trial:
    noted = {name: value for name, value in {**row.values, **row.numbers}.items() if name != "time"}
    values = [(_cut(name), _cut(_shown(value))) for name, value in islice(noted.items(), _MOST_VALUES)]
    return Trial(
        row.number, row.success, _reason(row.reason), row.time, _cut(row.states), values, timeline, page
    )


def _reason(text: str) -> Message:
    return failure_said(_cut(text))


def _cut(text: str, most: int = _LONGEST_TEXT) -> str:
    return text if len(text) <= most else f"{text[:most]}…"


def _shown(value: Value) -> str:
    return figure(value) if isinstance(value, float) else str(value)
