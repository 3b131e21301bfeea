"""The summary of a run as a table for the terminal."""

from __future__ import annotations

import math

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from visualhfsm.watch.recording import Recording
from visualhfsm.watch.summary import SETTLING, Summary

__all__ = ["summary_table"]

_CHANGES_SHOWN = 12


def summary_table(recording: Recording, summary: Summary) -> RenderableType:
    """Lay out the figures of a run and its last changes of state."""
    figures = Table.grid(padding=(0, 2))
    figures.add_column(style="bright_black")
    figures.add_column(justify="right")
    figures.add_column(style="bright_black")

    def add(name: str, value: str, note: str = "") -> None:
        figures.add_row(name, value, note)

    add("watched", f"{summary.duration:.1f} s", "of the component's time")
    if summary.centered is not None:
        add(
            "ball in the middle third",
            f"{100 * summary.centered:.1f} %",
            f"of {summary.centered_of} moments from {SETTLING:g} s after a new ball",
        )
    if summary.torso_tilt is not None:
        add("largest torso tilt", f"{math.degrees(summary.torso_tilt):.1f}°")
    if summary.camera_rate is not None:
        add("images a second", f"{summary.camera_rate:.1f}", "of robot time")
    if summary.real_time_factor is not None:
        add("real-time factor", f"{summary.real_time_factor:.2f}")
    if summary.typical_lag is not None and summary.largest_lag is not None:
        add("lag", f"{1000 * summary.typical_lag:.0f} ms", f"at most {1000 * summary.largest_lag:.0f} ms")
    add("cycles", str(summary.cycles), f"{summary.overruns} longer than their period")
    if summary.errors:
        add("errors", str(summary.errors))
    add("changes of state", str(summary.changes), _which(recording))
    return Group(Text(summary.component, "bold"), figures, _changes(recording))


def _which(recording: Recording) -> str:
    return f"the last {_CHANGES_SHOWN}:" if len(recording.changes) > _CHANGES_SHOWN else ""


def _changes(recording: Recording) -> RenderableType:
    table = Table.grid(padding=(0, 2))
    table.add_column(justify="right", style="bright_black")
    table.add_column()
    automata = recording.automata
    for change in list(recording.changes)[-_CHANGES_SHOWN:]:
        origin = automata.state_name(change.automaton, change.origin)
        destination = automata.state_name(change.automaton, change.destination)
        indent = "  " * automata.depth(change.automaton)
        table.add_row(f"{change.time:7.2f} s", Text(f"{indent}{origin} → {destination}"))
    return table
