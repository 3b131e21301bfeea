"""The report's plots as PNG; needs Matplotlib (the extra `demo`)."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import cycle
from typing import Final

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from interfaces.hfsm import AutomatonStructure
from visualhfsm.monitoring.automata import Span
from visualhfsm.monitoring.run_log import RunLog
from visualhfsm.watch.panels import ARM_JOINTS
from visualhfsm.watch.report import ReportContents

_WIDTH: Final = 9.6
_DPI: Final = 130
_ROOM_FOR_LETTER: Final = 0.013
"""Share of the width of a plot that a letter takes."""
_SHORTEST_BAR: Final = 0.02
"""Seconds that a bar is drawn long at least, so that it is seen."""


_INK: Final = "#1d232b"
_FAINT: Final = "#68707c"
_GRID: Final = "#e3e6ea"
_PAGE: Final = "#ffffff"
_SERIES: Final = ("#2563a8", "#c2571a", "#2f8a57", "#8a4fa3", "#a8862a", "#3d8f99")
_NAMED_COLORS: Final = {"red": "#d64541", "green": "#3d9a50", "blue": "#3f7fd0", "yellow": "#c9a227"}


def marks(contents: ReportContents) -> bytes:
    """Plot how far marks are from the image's center along both axes, with the middle third shaded."""
    labels = list(contents.log.marked(contents.camera))
    with _axes(2, 2.0) as (figure, axes):
        for axis, extent, name, end in zip(axes, contents.image_size, ("right", "down"), "uv", strict=True):
            axis.axhspan(-extent / 6, extent / 6, color=_SERIES[2], alpha=0.13, linewidth=0)
            axis.axhline(0, color=_GRID, linewidth=0.8)
            axis.set_ylim(-extent / 2, extent / 2)
            axis.set_yticks([-extent / 2, -extent / 6, 0, extent / 6, extent / 2])
            axis.yaxis.set_major_formatter("{x:.0f}")
            axis.set_ylabel(f"{name} (px)")
            lines = {label: f"mark.{contents.camera}/{label}.{end}" for label in labels}
            _draw_lines(axis, contents.log, lines, zero=(extent - 1) / 2)
        _draw_legend(axes[0], len(labels))
        _limit_time(axes, contents.log)
        return _png(figure)


def states(contents: ReportContents) -> bytes:
    """Plot the state of each automaton over time; the states of ghosts are hatched."""
    automata = contents.automata
    with _axes(1, 0.55 * len(automata.all) + 0.5) as (figure, axes):
        axis = axes[0]
        names = []
        room = _ROOM_FOR_LETTER * max(contents.log.duration, 1.0)
        for row, automaton in enumerate(automata.all):
            names.append(" > ".join(automata.path(automaton.id)))
            for (state, ghost), spans in _spans_by_state(contents.log, automaton.id).items():
                name = automata.state_name(automaton.id, state)
                color = _state_color(automaton, state, name)
                _draw_bars(axis, spans, row, color=color, ghost=ghost)
                for span in spans:
                    if span.end - span.start > room * len(name):
                        _label_span(axis, span, row, name)
        axis.set_yticks(range(len(names)), names, parse_math=False)
        axis.set_ylim(len(names) - 0.4, -0.6)
        axis.grid(visible=False, axis="y")
        axis.tick_params(axis="y", length=0)
        _limit_time(axes, contents.log)
        return _png(figure)


def angles(contents: ReportContents) -> bytes:
    """Plot the angles of head and arms."""
    groups = [("head", {"pan": "joint.HeadYaw", "tilt": "joint.HeadPitch"})]
    for side, name in (("R", "right arm"), ("L", "left arm")):
        groups.append((name, {label: f"joint.{side}{joint}" for joint, label in ARM_JOINTS.items()}))
    with _axes(3, 1.7) as (figure, axes):
        for axis, (name, lines) in zip(axes, groups, strict=True):
            _draw_lines(axis, contents.log, lines)
            _draw_legend(axis, len(lines))
            axis.set_ylabel(f"{name} (rad)")
            _widen(axis, 1.0)
        _limit_time(axes, contents.log)
        return _png(figure)


@contextmanager
def _axes(count: int, height: float) -> Iterator[tuple[Figure, Sequence[Axes]]]:
    """Create a figure with stacked axes; the time axes of all figures are in the same place."""
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
        axis.grid(visible=True, color=_GRID, linewidth=0.8)
        axis.set_axisbelow(True)
        axis.tick_params(colors=_FAINT, labelsize=9, length=0)
        axis.yaxis.label.set(color=_INK, fontsize=9)
        axis.yaxis.set_label_coords(-0.075, 0.5)
        axis.yaxis.set_major_locator(MaxNLocator(4))
        for spine in axis.spines.values():
            spine.set_visible(False)
    axes[-1].set_xlabel("time of the component (s)", color=_FAINT, fontsize=9)
    yield figure, axes


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _limit_time(axes: Sequence[Axes], log: RunLog) -> None:
    timeline = log.timeline()
    axes[0].set_xlim(timeline.start, max(timeline.end, timeline.start + 1.0))


def _widen(axis: Axes, span: float) -> None:
    """Make a vertical axis at least this wide, so that constant values look constant."""
    lower, upper = axis.get_ylim()
    missing = max(span - (upper - lower), 0.0)
    axis.set_ylim(lower - missing / 2, upper + missing / 2)


def _draw_lines(axis: Axes, log: RunLog, lines: dict[str, str], *, zero: float = 0.0) -> None:
    """Draw numbers of the log by label, less `zero`."""
    series = log.series(list(lines.values()))
    for (label, name), color in zip(lines.items(), cycle(_SERIES), strict=False):
        values = series["values"].get(name, [None] * len(series["times"]))
        numbers = [math.nan if value is None else value - zero for value in values]
        axis.plot(series["times"], numbers, color=_named_color(label) or color, linewidth=1.3, label=label)


def _draw_legend(axis: Axes, columns: int) -> None:
    legend = axis.legend(
        loc="lower left",
        bbox_to_anchor=(-0.01, 1.0),
        ncols=columns,
        frameon=False,
        fontsize=9,
        labelcolor=_INK,
        handlelength=1.0,
        borderpad=0,
    )
    for text in legend.get_texts():
        text.set_parse_math(False)  # a label may hold dollar signs


def _spans_by_state(log: RunLog, automaton: int) -> dict[tuple[int, bool], list[Span]]:
    spans: dict[tuple[int, bool], list[Span]] = {}
    for span in log.spans():
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


def _label_span(axis: Axes, span: Span, row: int, name: str) -> None:
    axis.text(
        (span.start + span.end) / 2,
        row,
        name,
        ha="center",
        va="center",
        fontsize=8.5,
        color=_INK if span.ghost else _PAGE,
        bbox={"facecolor": _PAGE, "edgecolor": "none", "pad": 1.5} if span.ghost else None,
        clip_on=True,
        parse_math=False,  # a name may hold dollar signs
    )


def _state_color(automaton: AutomatonStructure, state: int, name: str) -> str:
    """Return the color that a state is named for, otherwise one by its place among its siblings."""
    places = [sibling.id for sibling in automaton.states]
    place = places.index(state) if state in places else -1
    return _named_color(name) or _SERIES[place % len(_SERIES)]


def _named_color(name: str) -> str:
    return next((color for word, color in _NAMED_COLORS.items() if word in name.lower().split()), "")
