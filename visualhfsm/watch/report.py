"""Write the report of a run: one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import contextlib
import html
import importlib.util
import math
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from string import Template

from visualhfsm.errors import MissingPackageError, VisualHfsmError
from visualhfsm.watch.album import Picture
from visualhfsm.watch.recording import Recording
from visualhfsm.watch.summary import SETTLING, Summary, summarize

__all__ = ["ReportContents", "check_packages", "check_place", "write_report"]

_TEMPLATE = Path(__file__).with_name("report_template.html")
_ROWS_OF_CHANGES = 200


@dataclass(frozen=True, slots=True)
class ReportContents:
    """What a report is made of.

    `image_size` is that of the robot's camera, `began` the wall time of the start, `outside_trouble` tells
    why there are no pictures from outside.
    """

    recording: Recording
    image_size: tuple[int, int]
    began: datetime
    outside: Sequence[Picture] = ()
    camera: Sequence[Picture] = ()
    outside_trouble: str = ""


def check_packages() -> None:
    """Raise MissingPackageError when what draws the plots is not installed."""
    for package in ("matplotlib", "PIL"):
        if importlib.util.find_spec(package) is None:
            raise MissingPackageError("Matplotlib", "demo")


def check_place(path: Path) -> None:
    """Raise VisualHfsmError when no report can be written there, before a run is spent on it."""
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
    target = path.resolve()  # a link stays a link
    beside = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.exists() and not target.is_file():  # a pipe or a device is written to, never replaced
            target.write_text(text, encoding="utf-8")
        else:
            beside.write_text(text, encoding="utf-8")
            beside.replace(target)
    except OSError as error:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)
        raise VisualHfsmError(f"{path}: the report cannot be written: {error.strerror}") from error


def _page(contents: ReportContents) -> str:
    recording = contents.recording
    summary = summarize(recording, *contents.image_size)
    began = contents.began.strftime("%-d %B %Y, %H:%M")
    subtitle = f"{summary.duration:.0f} s of a run watched on {began}."
    if summary.errors:
        subtitle += f" {summary.errors} errors were reported; they are below."
    return Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=html.escape(summary.component),
        subtitle=html.escape(subtitle),
        figures="\n".join(_figures(summary)),
        sections="\n".join(_sections(contents)),
    )


def _figures(summary: Summary) -> Iterable[str]:
    if summary.centered is not None:
        yield _figure(
            f"{100 * summary.centered:.1f} %",
            "of the time with the ball in the middle third of the image, "
            f"from {SETTLING:g} s after each change of ball",
            good=summary.centered >= 0.95,
        )
    yield _figure(str(summary.changes), "changes of state")
    if summary.torso_tilt is not None:
        degrees = math.degrees(summary.torso_tilt)
        yield _figure(f"{degrees:.1f}°", "largest tilt of the torso", good=degrees <= 10)
    if summary.camera_rate is not None:
        yield _figure(f"{summary.camera_rate:.1f}", "images a second of robot time")
    if summary.real_time_factor is not None:
        yield _figure(f"{summary.real_time_factor:.2f}", "robot seconds in a second of wall time")
    if summary.typical_lag is not None and summary.largest_lag is not None:
        yield _figure(
            f"{1000 * summary.typical_lag:.0f} ms",
            f"typical lag of robot time behind its schedule; {1000 * summary.largest_lag:.0f} ms at most",
        )
    late = 100 * summary.overruns / summary.cycles if summary.cycles else 0.0
    yield _figure(f"{late:.1f} %", f"of {summary.cycles} cycles took longer than their period")
    if summary.errors:
        yield _figure(str(summary.errors), "errors", good=False)


def _figure(value: str, label: str, *, good: bool | None = None) -> str:
    style = {None: "", True: ' class="good"', False: ' class="bad"'}[good]
    return f"<div><dt>{html.escape(label)}</dt><dd{style}>{html.escape(value)}</dd></div>"


def _sections(contents: ReportContents) -> Iterable[str]:
    from visualhfsm.watch import plots

    recording = contents.recording

    def plot(draw: Callable[[plots.Theme], bytes], description: str) -> str:
        light, dark = _data_uri(draw(plots.LIGHT)), _data_uri(draw(plots.DARK))
        return (
            f'<div class="wide"><picture><source media="(prefers-color-scheme: dark)" srcset="{dark}">'
            f'<img alt="{html.escape(description)}" src="{light}"></picture></div>'
        )

    yield "<h2>The robot</h2>"
    if contents.outside:
        yield "<p>Seen from outside by a spectator of the simulation.</p>"
        yield _film(contents.outside)
    else:
        yield f"<p>There is no picture from outside. {html.escape(contents.outside_trouble)}</p>"
    yield "<h2>What its camera saw</h2>"
    if contents.camera:
        yield "<p>The cross marks the center of the ball as the component measured it.</p>"
        yield _film(contents.camera)
    else:
        yield "<p>No image of the robot's camera arrived.</p>"
    if any(row.ball for row in recording.rows):
        yield "<h2>The ball in the image</h2>"
        yield (
            "<p>Distance of the ball from the center of the image. The middle third is shaded; the line is "
            "broken while the ball is out of sight or not looked for.</p>"
        )
        yield plot(
            lambda theme: plots.ball_error(recording, contents.image_size, theme), "Ball error over time"
        )
    if recording.rows:
        yield "<h2>States</h2>"
        yield (
            "<p>The current state of each automaton. Hatched is what an automaton remembers as a ghost, "
            "while an ancestor is in another state.</p>"
        )
        yield plot(lambda theme: plots.states(recording, theme), "States over time")
        yield "<h2>Head and arms</h2>"
        yield plot(lambda theme: plots.angles(recording, theme), "Angles of head and arms over time")
        yield "<h2>The robot's server</h2>"
        yield plot(
            lambda theme: plots.server(recording, theme), "Real-time factor, images and torso tilt over time"
        )
    yield from _errors(recording)
    yield from _changes(recording)


def _film(pictures: Sequence[Picture]) -> str:
    from visualhfsm.watch.pictures import picture_png

    def frame(picture: Picture) -> str:
        caption = html.escape(picture.caption)
        image = f'<img alt="{caption} at {picture.time:.1f} s" src="{_data_uri(picture_png(picture))}">'
        return f"<figure>{image}<figcaption><b>{picture.time:.1f} s</b> {caption}</figcaption></figure>"

    return f'<div class="film">{"".join(frame(picture) for picture in pictures)}</div>'


def _changes(recording: Recording) -> Iterable[str]:
    automata = recording.automata
    changes = list(recording.changes)
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


def _errors(recording: Recording) -> Iterable[str]:
    errors = recording.newest.errors if recording.newest else []
    if errors:
        yield "<h2>Errors</h2>"
        automata = recording.automata
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
