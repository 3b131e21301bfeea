"""Summarize a run: figures for the terminal, and a report as one self-contained HTML file."""

from __future__ import annotations

import base64
import html
import importlib.util
import math
import os
import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from string import Template

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from visualhfsm.errors import MissingPackageError, VisualHfsmError
from visualhfsm.monitoring.automata import Automata
from visualhfsm.monitoring.run_log import RunLog
from visualhfsm.watch.telemetry import CAMERA, IMAGE_SIZE, Picture, picture_png
from zenoh_ice.text import printable

SETTLING = 2.0
"""Seconds after a mark appears that do not count: the head is still turning."""
_GAP = 0.6
"""Seconds without a mark after which it counts as lost."""
_TEMPLATE = Path(__file__).with_name("report_template.html")
_ROWS_OF_CHANGES = 200
_CHANGES_SHOWN = 12


@dataclass(frozen=True, slots=True)
class ReportContents:
    """The content of a report.

    `began` is the wall time of the start, `image_size` that of the pictures of `camera`, `outside_trouble`
    says why there are no pictures from outside.
    """

    automata: Automata
    log: RunLog
    began: datetime
    camera: str = CAMERA
    image_size: tuple[int, int] = IMAGE_SIZE
    outside: Sequence[Picture] = ()
    through_camera: Sequence[Picture] = ()
    outside_trouble: str = ""


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

    A mark counts from `SETTLING` seconds after it appeared, and again after a gap of 0.6 s without it.
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
            if time - since >= SETTLING:
                settled.append(in_middle_third(u, v, size))
        if settled:
            shares[label] = sum(settled) / len(settled), len(settled)
    return shares


def in_middle_third(u: float, v: float, size: tuple[int, int]) -> bool:
    """Whether a pixel is in the middle third of an image along both axes."""
    width, height = size
    return abs(u - (width - 1) / 2) <= width / 6 and abs(v - (height - 1) / 2) <= height / 6


@dataclass(frozen=True, slots=True)
class _Figure:
    """A figure of the summary; `good` is None where it is neither good nor bad."""

    name: str
    value: str
    note: str = ""
    good: bool | None = None


def _figures(summary: Summary) -> Iterator[_Figure]:
    yield _Figure("watched", f"{summary.duration:.1f} s", "of the component's time")
    for label, (share, count) in summary.centered.items():
        note = f"of {count} moments from {SETTLING:g} s after it was first seen"
        name = f"{printable(label)} in the middle third".strip()
        yield _Figure(name, f"{100 * share:.1f} %", note, share >= 0.95)
    if summary.torso_tilt is not None:
        degrees = math.degrees(summary.torso_tilt)
        yield _Figure("largest torso tilt", f"{degrees:.1f}°", good=degrees <= 10)
    if summary.camera_rate is not None:
        yield _Figure("images a second", f"{summary.camera_rate:.1f}", "of robot time")
    if summary.real_time_factor is not None:
        yield _Figure("real-time factor", f"{summary.real_time_factor:.2f}")
    if summary.typical_lag is not None and summary.largest_lag is not None:
        most = f"at most {1000 * summary.largest_lag:.0f} ms"
        yield _Figure("lag", f"{1000 * summary.typical_lag:.0f} ms", most)
    yield _Figure("cycles", str(summary.cycles), f"{summary.overruns} longer than their period")
    if summary.errors:
        yield _Figure("errors", str(summary.errors), good=False)
    yield _Figure("changes of state", str(summary.changes))


def summary_table(contents: ReportContents) -> RenderableType:
    """Format the figures of a run and its last changes of state for the terminal."""
    figures = Table.grid(padding=(0, 2))
    figures.add_column(style="bright_black")
    figures.add_column(justify="right")
    figures.add_column(style="bright_black")
    for figure in _figures(summarize(contents.log, contents.camera, contents.image_size)):
        figures.add_row(figure.name, figure.value, figure.note)
    changes = Table.grid(padding=(0, 2))
    changes.add_column(justify="right", style="bright_black")
    changes.add_column()
    automata = contents.automata
    for change in contents.log.changes(_CHANGES_SHOWN):
        origin = automata.state_name(change.automaton, change.origin)
        destination = automata.state_name(change.automaton, change.destination)
        indent = "  " * automata.depth(change.automaton)
        changes.add_row(f"{change.time:7.2f} s", Text(f"{indent}{origin} → {destination}"))
    return Group(Text(automata.name, "bold"), figures, changes)


def check_packages() -> None:
    """Raise MissingPackageError when Matplotlib, which draws the plots, is not installed."""
    for package in ("matplotlib", "PIL"):
        if importlib.util.find_spec(package) is None:
            raise MissingPackageError("Matplotlib", "demo")


def check_place(path: Path) -> None:
    """Raise VisualHfsmError when no report can be written there, before the run begins."""
    directory = path.resolve().parent
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise VisualHfsmError(f"{path}: the report cannot be written: {error.strerror}") from error
    if not os.access(directory, os.W_OK):
        raise VisualHfsmError(f"{path}: the report cannot be written: {directory} is not writable")


def write_report(path: Path, contents: ReportContents) -> None:
    """Write the report, replacing what was there.

    Raises MissingPackageError without Matplotlib and VisualHfsmError when the file cannot be written.
    """
    check_packages()
    text = _page(contents)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise VisualHfsmError(f"{path}: the report cannot be written: {error.strerror}") from error


def _page(contents: ReportContents) -> str:
    summary = summarize(contents.log, contents.camera, contents.image_size)
    began = contents.began.strftime("%-d %B %Y, %H:%M")
    subtitle = f"{summary.duration:.0f} s of a run watched on {began}."
    if summary.errors:
        subtitle += f" {summary.errors} errors were reported; they are below."
    return Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=html.escape(contents.automata.name),
        subtitle=html.escape(subtitle),
        figures="\n".join(_figure_in_page(figure) for figure in _figures(summary)),
        sections="\n".join(_sections(contents)),
    )


def _figure_in_page(figure: _Figure) -> str:
    style = {None: "", True: ' class="good"', False: ' class="bad"'}[figure.good]
    label = html.escape(f"{figure.name}, {figure.note}" if figure.note else figure.name)
    return f"<div><dt>{label}</dt><dd{style}>{html.escape(figure.value)}</dd></div>"


def _sections(contents: ReportContents) -> Iterable[str]:
    from visualhfsm.watch import plots

    def plot(png: bytes, description: str) -> str:
        return f'<div class="wide"><img alt="{html.escape(description)}" src="{_data_uri(png)}"></div>'

    yield "<h2>The robot</h2>"
    if contents.outside:
        yield "<p>Seen from outside, by a camera of the simulation.</p>"
        yield _film(contents.outside)
    else:
        yield f"<p>There is no picture from outside. {html.escape(contents.outside_trouble)}</p>"
    yield "<h2>What its camera saw</h2>"
    if contents.through_camera:
        yield "<p>The crosses are what the component marked.</p>"
        yield _film(contents.through_camera)
    else:
        yield "<p>No image of the robot's camera arrived.</p>"
    if contents.log.marked(contents.camera):
        yield "<h2>Marks in the image</h2>"
        yield (
            "<p>Distance of the marks from the center of the image. The middle third is shaded; a line is "
            "broken while its mark is missing.</p>"
        )
        yield plot(plots.marks(contents), "Marks over time")
    if contents.log.newest is not None:
        yield "<h2>States</h2>"
        yield (
            "<p>The current state of each automaton. Hatched: the state that a ghost keeps "
            "while an ancestor is in another state.</p>"
        )
        yield plot(plots.states(contents), "States over time")
        yield "<h2>Head and arms</h2>"
        yield plot(plots.angles(contents), "Angles of head and arms over time")
    yield from _errors(contents)
    yield from _changes(contents)


def _film(pictures: Sequence[Picture]) -> str:
    def frame(picture: Picture) -> str:
        caption = html.escape(picture.caption)
        image = f'<img alt="{caption} at {picture.time:.1f} s" src="{_data_uri(picture_png(picture))}">'
        return f"<figure>{image}<figcaption><b>{picture.time:.1f} s</b> {caption}</figcaption></figure>"

    return f'<div class="film">{"".join(frame(picture) for picture in pictures)}</div>'


def _changes(contents: ReportContents) -> Iterable[str]:
    automata = contents.automata
    changes = contents.log.changes()
    if not changes:
        return
    yield "<h2>Changes of state</h2>"
    if len(changes) > _ROWS_OF_CHANGES:
        yield f"<p>The last {_ROWS_OF_CHANGES} of {len(changes)}.</p>"
    rows = []
    for change in changes[-_ROWS_OF_CHANGES:]:
        origin = automata.state_name(change.automaton, change.origin)
        destination = automata.state_name(change.automaton, change.destination)
        transition = automata.transition(change.automaton, change.transition)
        automaton = automata.automaton_name(change.automaton)
        name = transition.name if transition else ""
        rows.append((f"{change.time:.2f}", automaton, f"{origin} → {destination}", name))
    yield _table(("s", "automaton", "states", "transition"), rows)


def _errors(contents: ReportContents) -> Iterable[str]:
    newest = contents.log.newest
    errors = newest.component.errors if newest else []
    if errors:
        yield "<h2>Errors</h2>"
        automata = contents.automata
        rows = [
            (f"{e.time:.2f}", automata.state_name(e.automaton, e.state), e.location, e.message)
            for e in errors
        ]
        yield _table(("s", "state", "place", "message"), rows)


def _table(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    def line(tag: str, cells: Sequence[str]) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    body = "".join(line("td", row) for row in rows)
    return f'<div class="wide"><table>{line("th", titles)}{body}</table></div>'


def _data_uri(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"
