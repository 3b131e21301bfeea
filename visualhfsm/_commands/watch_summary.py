"""Summarize a run in figures, for the terminal and the page of the run."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from codegen.messages import Message, number
from visualhfsm._commands.watch_line import CAMERA, IMAGE_SIZE
from visualhfsm._monitor.realm.automata import Automata
from visualhfsm._monitor.realm.run_log import RunLog
from visualhfsm._monitor.run_page import Figure
from zenoh_ice.data.text import printable

_MOST_ERRORS: Final = 20
"""A component sends its newest ones alone."""

SETTLING_TIME = 2.0
"""Seconds after a mark appears that do not count: the head is still turning."""
_GAP = 0.6
"""Seconds without a mark after which it counts as lost."""
_CHANGES_SHOWN = 12


@dataclass(frozen=True, slots=True)
class Summary:
    """Figures of a run; None if never measured.

    `centered` has for each mark the share from 0 to 1 of the moments, and their number, at which it was in
    the middle third of the image along both axes; angles are in rad, lags (robot time behind its schedule) in
    s of wall time.
    """

    duration: float
    changes: int
    torso_tilt: float | None
    camera_rate: float | None
    real_time_factor: float | None
    typical_lag: float | None
    largest_lag: float | None
    errors: int
    overruns: int
    cycles: int
    centered: dict[str, tuple[float, int]] = field(default_factory=dict)


def summarize(log: RunLog, camera: str = CAMERA, size: tuple[int, int] = IMAGE_SIZE) -> Summary:
    """Compute the figures of a run; `size` is that of the image of `camera` in pixels.

    A mark counts from `SETTLING_TIME` seconds after it appeared, and again after a gap of 0.6 s without it.
    """
    images = f"images.{camera}"
    names = ("robot.lag", images, "robot.torsoTilt", "robot.realTimeFactor")
    values = log.series(names)["values"]
    known = {name: [value for value in values.get(name, ()) if value is not None] for name in names}
    lags, factors = known["robot.lag"], known["robot.realTimeFactor"]
    newest = log.newest
    automata = newest.component.automata if newest else []
    return Summary(
        duration=log.duration,
        changes=len(log.changes()),
        torso_tilt=max(known["robot.torsoTilt"], default=None),
        camera_rate=statistics.median(known[images]) if known[images] else None,
        real_time_factor=statistics.fmean(factors) if factors else None,
        typical_lag=statistics.median(lags) if lags else None,
        largest_lag=max(lags, default=None),
        errors=len(newest.component.errors) if newest else 0,
        overruns=sum(automaton.overruns for automaton in automata),
        cycles=sum(automaton.cycles for automaton in automata),
        centered=_centered(log, camera, size),
    )


def _centered(log: RunLog, camera: str, size: tuple[int, int]) -> dict[str, tuple[float, int]]:
    shares = {}
    for label, points in log.marked(camera).items():
        since = before = -math.inf
        settled = []
        for time, u, v in points:
            since = time if time - before > _GAP else since
            before = time
            if time - since >= SETTLING_TIME:
                settled.append(in_middle_third(u, v, size))
        if settled:
            shares[label] = sum(settled) / len(settled), len(settled)
    return shares


def in_middle_third(u: float, v: float, size: tuple[int, int]) -> bool:
    """Whether a pixel is in the middle third of an image along both axes."""
    width, height = size
    return abs(u - (width - 1) / 2) <= width / 6 and abs(v - (height - 1) / 2) <= height / 6


def figures_of(summary: Summary) -> Iterator[Figure]:
    """Yield the figures as people read them."""
    yield Figure(
        Message("watched"),
        Message("{seconds:.1f} s", seconds=summary.duration),
        Message("of the component's time"),
    )
    for label, (share, count) in summary.centered.items():
        yield Figure(
            Message("{mark} in the middle third", mark=printable(label))
            if label
            else Message("in the middle third"),
            Message("{percent:.1f} %", percent=100 * share),
            Message(
                "of {count} moments from {seconds:g} s after it was first seen",
                count=count,
                seconds=SETTLING_TIME,
            ),
        )
    if summary.torso_tilt is not None:
        degrees = math.degrees(summary.torso_tilt)
        yield Figure(Message("largest torso tilt"), Message("{degrees:.1f}°", degrees=degrees))
    if summary.camera_rate is not None:
        rate = number(f"{summary.camera_rate:.1f}")
        yield Figure(Message("images a second"), rate, Message("of robot time"))
    if summary.real_time_factor is not None:
        yield Figure(Message("real-time factor"), number(f"{summary.real_time_factor:.2f}"))
    if summary.typical_lag is not None and summary.largest_lag is not None:
        most = Message("at most {time:.0f} ms", time=1000 * summary.largest_lag)
        yield Figure(Message("lag"), Message.verbatim(f"{1000 * summary.typical_lag:.0f} ms"), most)
    yield Figure(
        Message("cycles"),
        Message.verbatim(str(summary.cycles)),
        Message("{count} longer than their period", count=summary.overruns),
    )
    if summary.errors:
        some = Message.verbatim(str(summary.errors))
        many = Message("{count} or more", count=_MOST_ERRORS)
        yield Figure(Message("errors"), some if summary.errors < _MOST_ERRORS else many)
    yield Figure(Message("changes of state"), Message.verbatim(str(summary.changes)))


def summary_table(automata: Automata, log: RunLog, figures: Iterable[Figure]) -> RenderableType:
    """Format the figures of a run and its last changes of state for the terminal."""
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bright_black")
    table.add_column(justify="right")
    table.add_column(style="bright_black")
    for figure in figures:
        table.add_row(figure.name, figure.value, figure.note)
    changes = Table.grid(padding=(0, 2))
    changes.add_column(justify="right", style="bright_black")
    changes.add_column()
    for change in log.changes(_CHANGES_SHOWN):
        origin = automata.state_name(change.automaton, change.origin)
        destination = automata.state_name(change.automaton, change.destination)
        indent = "  " * automata.depth(change.automaton)
        changes.add_row(f"{change.time:7.2f} s", Text(f"{indent}{origin} → {destination}"))
    return Group(Text(automata.name, "bold"), table, changes)
