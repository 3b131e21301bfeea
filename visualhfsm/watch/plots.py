"""The report's plots as PNG, each for light and for dark pages; needs Matplotlib (the extra `demo`)."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from interfaces.hfsm import AutomatonStructure
from visualhfsm.watch.recording import ARM_JOINTS, Ball, Recording, Row, Span

__all__ = ["DARK", "LIGHT", "Theme", "angles", "ball_error", "server", "states"]

_WIDTH: Final = 9.6
_DPI: Final = 130
_ROOM_FOR_LETTER: Final = 0.013
"""Share of the width of a plot that a letter takes."""
_SHORTEST_BAR: Final = 0.02
"""Seconds that a bar is drawn long at least, so that it is seen."""
_ROOM_FOR_LABEL: Final = 0.05
"""Share of the width of a plot below which a label at the end is left out."""
_GAP: Final = 0.6
"""Seconds without a row after which a line is broken."""


@dataclass(frozen=True, slots=True)
class Theme:
    """The colors of a page."""

    ink: str
    faint: str
    grid: str
    page: str
    series: tuple[str, ...]


LIGHT: Final = Theme(
    "#1d232b",
    "#68707c",
    "#e3e6ea",
    "#ffffff",
    ("#2563a8", "#c2571a", "#2f8a57", "#8a4fa3", "#a8862a", "#3d8f99"),
)
DARK: Final = Theme(
    "#e6e9ee",
    "#98a1ae",
    "#333a44",
    "#171b21",
    ("#6ea8e8", "#f0995c", "#6cc795", "#c391dc", "#dcbf6a", "#79c9d2"),
)
_NAMED_COLORS: Final = {"red": "#d64541", "green": "#3d9a50", "blue": "#3f7fd0", "yellow": "#c9a227"}


def ball_error(recording: Recording, size: tuple[int, int], theme: Theme) -> bytes:
    """Plot the ball's distance from the image's center along both axes, with the middle third shaded."""
    with _axes(2, 2.0, theme) as (figure, axes):
        for axis, extent, name in zip(axes, size, ("right", "down"), strict=True):
            axis.axhspan(-extent / 6, extent / 6, color=theme.series[2], alpha=0.13, linewidth=0)
            axis.axhline(0, color=theme.grid, linewidth=0.8)
            axis.set_ylim(-extent / 2, extent / 2)
            axis.set_yticks([-extent / 2, -extent / 6, 0, extent / 6, extent / 2])
            axis.yaxis.set_major_formatter("{x:.0f}")
            axis.set_ylabel(f"{name} (px)")
            for ball, times, values in _ball_lines(recording, name):
                axis.plot(times, values, color=_ball_color(ball, theme), linewidth=1.3)
        _label_balls(axes[0], recording, theme)
        _limit_time(axes, recording)
        return _png(figure)


def states(recording: Recording, theme: Theme) -> bytes:
    """Plot the state of each automaton over time; what it remembered as a ghost is hatched."""
    automata = recording.automata
    with _axes(1, 0.55 * len(automata.all) + 0.5, theme) as (figure, axes):
        axis = axes[0]
        names = []
        room = _ROOM_FOR_LETTER * max(recording.duration, 1.0)
        for row, automaton in enumerate(automata.all):
            names.append(_path(recording, automaton.id))
            for (state, ghost), spans in _spans_by_state(recording, automaton.id).items():
                name = automata.state_name(automaton.id, state)
                color = _state_color(automaton, state, name, theme)
                _draw_bars(axis, spans, row, color=color, ghost=ghost)
                for span in spans:
                    if span.end - span.start > room * len(name):
                        _label_span(axis, span, row, name, theme)
        axis.set_yticks(range(len(names)), names, parse_math=False)
        axis.set_ylim(len(names) - 0.4, -0.6)
        axis.grid(visible=False, axis="y")
        axis.tick_params(axis="y", length=0)
        _limit_time(axes, recording)
        return _png(figure)


def angles(recording: Recording, theme: Theme) -> bytes:
    """Plot the angles of head and arms."""
    with _axes(3, 1.7, theme) as (figure, axes):
        rows = list(recording.rows)
        head = {"pan": [row.robot.pan for row in rows], "tilt": [row.robot.tilt for row in rows]}
        _draw_lines(axes[0], rows, head, theme)
        axes[0].set_ylabel("head (rad)")
        _widen(axes[0], 1.0)
        for axis, side, name in ((axes[1], "R", "right arm"), (axes[2], "L", "left arm")):
            joints = {
                _spaced(joint): [row.robot.joints.get(side + joint) for row in rows] for joint in ARM_JOINTS
            }
            _draw_lines(axis, rows, joints, theme)
            axis.set_ylabel(f"{name} (rad)")
            _widen(axis, 1.0)
        _limit_time(axes, recording)
        return _png(figure)


def server(recording: Recording, theme: Theme) -> bytes:
    """Plot the real-time factor, the rate of images and the tilt of the torso."""
    with _axes(3, 1.2, theme) as (figure, axes):
        rows = list(recording.rows)
        tilts = [math.degrees(tilt) if (tilt := row.robot.torso_tilt) is not None else None for row in rows]
        for axis, name, values in (
            (axes[0], "real-time\nfactor", [row.robot.real_time_factor for row in rows]),
            (axes[1], "images/s", [row.robot.camera_rate for row in rows]),
            (axes[2], "torso\ntilt (°)", tilts),
        ):
            _draw_lines(axis, rows, {name: values}, theme, legend=False)
            axis.set_ylabel(name)
            known = [value for value in values if value is not None]
            axis.set_ylim(0, max(known, default=1.0) * 1.25 or 1.0)
        _limit_time(axes, recording)
        return _png(figure)


@contextmanager
def _axes(count: int, height: float, theme: Theme) -> Iterator[tuple[Figure, Sequence[Axes]]]:
    """Give a figure with axes above one another; the time axes of all figures stand in the same place."""
    above, between, below = 0.3, 0.36, 0.45  # inches
    total = above + count * height + (count - 1) * between + below
    figure = Figure(figsize=(_WIDTH, total), dpi=_DPI)
    FigureCanvasAgg(figure)
    figure.patch.set_alpha(0)
    figure.subplots_adjust(
        left=0.145, right=0.99, top=1 - above / total, bottom=below / total, hspace=between / height
    )
    axes = list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])
    for axis in axes:
        axis.patch.set_alpha(0)
        axis.grid(visible=True, color=theme.grid, linewidth=0.8)
        axis.set_axisbelow(True)
        axis.tick_params(colors=theme.faint, labelsize=9, length=0)
        axis.yaxis.label.set(color=theme.ink, fontsize=9)
        axis.yaxis.set_label_coords(-0.075, 0.5)
        axis.yaxis.set_major_locator(MaxNLocator(4))
        for spine in axis.spines.values():
            spine.set_visible(False)
    axes[-1].set_xlabel("time of the component (s)", color=theme.faint, fontsize=9)
    yield figure, axes


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _limit_time(axes: Sequence[Axes], recording: Recording) -> None:
    rows = recording.rows
    if rows:
        axes[0].set_xlim(rows[0].time, max(rows[-1].time, rows[0].time + 1.0))


def _widen(axis: Axes, span: float) -> None:
    """Make a vertical axis at least so wide, so that what stands still looks like it."""
    lower, upper = axis.get_ylim()
    missing = max(span - (upper - lower), 0.0)
    axis.set_ylim(lower - missing / 2, upper + missing / 2)


def _draw_lines(
    axis: Axes,
    rows: Sequence[Row],
    lines: dict[str, list[float | None]],
    theme: Theme,
    *,
    legend: bool = True,
) -> None:
    times = [row.time for row in rows]
    for (name, values), color in zip(lines.items(), theme.series, strict=False):
        numbers = [math.nan if value is None else value for value in values]
        axis.plot(times, numbers, color=color, linewidth=1.3, label=name)
    if legend:
        axis.legend(
            loc="lower left",
            bbox_to_anchor=(-0.01, 1.0),
            ncols=len(lines),
            frameon=False,
            fontsize=9,
            labelcolor=theme.ink,
            handlelength=1.0,
            borderpad=0,
        )


def _spans_by_state(recording: Recording, automaton: int) -> dict[tuple[int, bool], list[Span]]:
    spans: dict[tuple[int, bool], list[Span]] = {}
    for span in recording.spans:
        if span.automaton == automaton:
            spans.setdefault((span.state, span.ghost), []).append(span)
    return spans


def _draw_bars(axis: Axes, spans: Sequence[Span], row: int, *, color: str, ghost: bool) -> None:
    bars = [(span.start, max(span.end - span.start, _SHORTEST_BAR)) for span in spans]
    place = (row - 0.32, 0.64)
    if ghost:
        axis.broken_barh(
            bars, place, facecolor="none", edgecolor=color, hatch="////", alpha=0.45, linewidth=0
        )
    else:
        axis.broken_barh(bars, place, facecolor=color, linewidth=0)


def _label_span(axis: Axes, span: Span, row: int, name: str, theme: Theme) -> None:
    axis.text(
        (span.start + span.end) / 2,
        row,
        name,
        ha="center",
        va="center",
        fontsize=8.5,
        color=theme.ink if span.ghost else theme.page,
        bbox={"facecolor": theme.page, "edgecolor": "none", "pad": 1.5} if span.ghost else None,
        clip_on=True,
        parse_math=False,  # a name may hold dollar signs
    )


def _ball_lines(recording: Recording, axis: str) -> Iterator[tuple[Ball, list[float], list[float]]]:
    """Yield the ball's error in stretches without a break, each of one ball."""
    times: list[float] = []
    values: list[float] = []
    last: Ball | None = None
    for row in recording.rows:
        ball = row.ball if row.ball and row.ball.seen else None
        broken = ball is None or last is None or ball.name != last.name or row.time - times[-1] > _GAP
        if broken and last is not None:
            yield last, times, values
            times, values = [], []
        last = ball
        if ball is not None:
            times.append(row.time)
            values.append(ball.error_u if axis == "right" else ball.error_v)
    if last is not None:
        yield last, times, values


def _label_balls(axis: Axes, recording: Recording, theme: Theme) -> None:
    """Name the ball above each time of following."""
    last = None
    for row in recording.rows:
        if row.ball is None:
            continue
        key = (row.ball.name, row.ball.following_since)
        if key != last:
            last = key
            if row.time > recording.rows[-1].time - _ROOM_FOR_LABEL * recording.duration:
                continue
            axis.annotate(
                row.ball.name, (row.time, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 3),
                textcoords="offset points", fontsize=9, color=_ball_color(row.ball, theme),
                parse_math=False,
            )  # fmt: skip


def _state_color(automaton: AutomatonStructure, state: int, name: str, theme: Theme) -> str:
    """Return the color that a state is named for, otherwise one by its place among its siblings."""
    places = [sibling.id for sibling in automaton.states]
    place = places.index(state) if state in places else -1
    return _named_color(name) or theme.series[place % len(theme.series)]


def _ball_color(ball: Ball, theme: Theme) -> str:
    return _named_color(ball.name) or theme.series[0]


def _named_color(name: str) -> str:
    return next((color for word, color in _NAMED_COLORS.items() if word in name.lower().split()), "")


def _path(recording: Recording, automaton: int) -> str:
    """Return the names from the component down to an automaton, the first left out where there are others."""
    automata = recording.automata
    chain = [automaton, *automata.ancestors(automaton)]
    names = [automata.automaton_name(one) for one in reversed(chain)]
    return " > ".join(names[1:] or names)


def _spaced(name: str) -> str:
    return "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name).strip()
