"""The live view in the terminal: lays out automata, camera, robot and what happened for its size."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence

from rich.console import Console, ConsoleOptions, RenderResult
from rich.layout import Layout
from rich.panel import Panel
from rich.text import Text

from interfaces.hfsm import ComponentStatus, TransitionStructure
from interfaces.nao import Severity
from visualhfsm.monitoring.automata import by_id
from visualhfsm.monitoring.robot import STALE
from visualhfsm.watch.panels import camera_lines, from_center, legend, robot_lines, tree_lines
from visualhfsm.watch.telemetry import WatchState
from zenoh_ice.text import printable

__all__ = ["View", "status_line"]

_FAINT = "bright_black"
_NARROW = 72
"""Columns below which the parts stand above one another."""
_ROBOT_ROWS = 9
_BORDERS = 2


class View:
    """A renderable of one moment that fills the console."""

    def __init__(self, state: WatchState) -> None:
        self._state = state

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        width, height = options.max_width, options.height or console.height
        trouble = self._state.trouble
        parts = [Layout(_header(self._state, width), size=1)]
        if trouble:
            parts.append(Layout(Text(f" {trouble}".ljust(width), "bold white on red", no_wrap=True), size=1))
        rows = height - len(parts) - 1
        body = self._one_column(width, rows) if width < _NARROW else self._two_columns(width, rows)
        layout = Layout()
        layout.split_column(*parts, body, Layout(_footer(), size=1))
        yield layout

    def _two_columns(self, width: int, rows: int) -> Layout:
        left_width = width * 9 // 20
        right_width = width - left_width
        body = Layout(size=rows)
        left, right = Layout(size=left_width), Layout(size=right_width)
        body.split_row(left, right)

        state = self._state
        states = sum(1 for _ in state.automata.rows()) if state.automata else 3
        tree_rows = min(states, max(rows - 4 - 2 * _BORDERS, 4))
        left.split_column(
            self._tree(left_width, tree_rows + _BORDERS),
            *self._changes(left_width, rows - tree_rows - _BORDERS),
        )

        camera_rows = rows - _ROBOT_ROWS - 2 * _BORDERS
        if camera_rows < 5:
            right.split_column(self._robot(right_width, rows))
        else:
            camera_rows = min(camera_rows, 14)
            events = rows - camera_rows - _ROBOT_ROWS - 2 * _BORDERS
            if events < 3:
                camera_rows, events = camera_rows + events, 0
            right.split_column(
                self._camera(right_width, camera_rows + _BORDERS),
                self._robot(right_width, _ROBOT_ROWS + _BORDERS),
                *([self._variables(right_width, events)] if events else []),
            )
        return body

    def _one_column(self, width: int, rows: int) -> Layout:
        body = Layout(size=rows)
        robot = _ROBOT_ROWS + _BORDERS if rows >= _ROBOT_ROWS + 8 else 0
        parts = [self._tree(width, rows - robot)]
        if robot:
            parts.append(self._robot(width, robot))
        body.split_column(*parts)
        return body

    def _tree(self, width: int, height: int) -> Layout:
        state = self._state
        lines = [Text("nothing heard of it yet", _FAINT)]
        title = "Automata"
        style = "blue"
        if state.automata is not None and state.snapshot is not None:
            lines = tree_lines(state.automata, state.snapshot, width - 4, height - _BORDERS)
            if state.snapshot_age > STALE:
                lines = [Text(line.plain, _FAINT) for line in lines]
                title, style = f"Automata, {state.snapshot_age:.0f} s old", _FAINT
        return _panel(title, lines, height, style)

    def _changes(self, width: int, height: int) -> list[Layout]:
        """Show the last changes of state, and below them errors when there are any."""
        if height <= _BORDERS:
            return []
        errors = self._error_lines(width - 4)
        error_rows = min(len(errors), max((height - 2 * _BORDERS) // 2, 0))
        parts = []
        change_rows = height - _BORDERS - (error_rows + _BORDERS if error_rows else 0)
        parts.append(
            _panel("Changes of state", self._change_lines(width - 4, change_rows), change_rows + _BORDERS)
        )
        if error_rows:
            parts.append(_panel("Errors", errors[-error_rows:], error_rows + _BORDERS, "red"))
        return parts

    def _change_lines(self, width: int, rows: int) -> list[Text]:
        state = self._state
        if state.automata is None:
            return []
        lines = []
        for change in list(state.changes)[-rows:]:
            transition = state.automata.transition(change.automaton, change.transition)
            line = Text.assemble(
                (f"{change.time:6.1f} s  ", _FAINT),
                "  " * state.automata.depth(change.automaton),
                f"{state.automata.state_name(change.automaton, change.origin)} → ",
                (state.automata.state_name(change.automaton, change.destination), "bold"),
            )
            name = f"  {_cause(transition)}" if transition and _cause(transition) else ""
            if line.cell_len + len(name) <= width:
                line.append(name, _FAINT)
            lines.append(line)
        return lines

    def _error_lines(self, width: int) -> list[Text]:
        state = self._state
        if state.snapshot is None or state.automata is None:
            return []
        automata = state.automata
        texts = (
            f"{error.time:.1f} s  {automata.state_name(error.automaton, error.state)}: {error.message}"
            for error in state.snapshot.errors
        )
        wrapped = (textwrap.wrap(printable(text), width, subsequent_indent="  ") for text in texts)
        return [Text(line) for lines in wrapped for line in lines]

    def _camera(self, width: int, height: int) -> Layout:
        return _panel(
            printable(self._state.camera), camera_lines(self._state, width - 4, height - _BORDERS), height
        )

    def _robot(self, width: int, height: int) -> Layout:
        lines = robot_lines(self._state, width - 4)
        age = self._state.robot_age
        if STALE < age < math.inf:
            return _panel(f"Robot (rad), {age:.0f} s old", lines, height, _FAINT)
        return _panel("Robot (rad)", lines, height)

    def _variables(self, width: int, height: int) -> Layout:
        """Show the events of the robot's server, then the variables of running automata."""
        state = self._state
        lines: list[Text] = []
        if state.robot.health is not None:
            for event in state.robot.health.events[-(height - _BORDERS) // 2 :]:
                style = {Severity.Info: "", Severity.Warning: "yellow", Severity.Error: "red"}[event.level]
                lines.append(Text(printable(f"{event.time:7.1f} s  {event.source}: {event.message}"), style))
        if state.automata is not None and state.snapshot is not None:
            running = by_id(state.snapshot).values()
            for automaton in (automaton for automaton in running if not automaton.ghost):
                for name, value in sorted(automaton.variables.items()):
                    owner = state.automata.automaton_name(automaton.id)
                    parts = ((f"{owner}.", _FAINT), f"{printable(name)} = ", (printable(value), "cyan"))
                    lines.append(Text.assemble(*parts))
        for line in lines:
            line.truncate(width - 4, overflow="ellipsis")
        return _panel("Events and variables", lines, height)


def _cause(transition: TransitionStructure) -> str:
    """Return the name of a transition and the event at which it fired."""
    event = f"at {transition.event}" if transition.event else ""
    return f"{transition.name} {event}".strip()


def _panel(title: str, lines: Sequence[Text], height: int, style: str = "blue") -> Layout:
    content = Text("\n").join(lines[: height - _BORDERS])
    content.no_wrap = True
    content.overflow = "ellipsis"
    panel = Panel(content, title=title, title_align="left", border_style=style, height=height, padding=(0, 1))
    return Layout(panel, size=height)


def _header(state: WatchState, width: int) -> Text:
    snapshot = state.snapshot
    status = snapshot.status.name.lower() if snapshot else "not seen"
    style = {"running": "green", "halted": "bold red"}.get(status, "yellow")
    where = _stopped(state)
    left = Text.assemble(" ", (state.component, "bold"), "  ", (f"{status}{where}", style))
    right = Text(f"{snapshot.time:.1f} s" if snapshot else "")
    if state.seconds:
        right.append(f"   {min(state.elapsed, state.seconds):.0f} of {state.seconds:g} s watched", _FAINT)
    right.append(" ")
    left.truncate(width - right.cell_len - 1, overflow="ellipsis")
    gap = width - left.cell_len - right.cell_len
    return Text.assemble(left, " " * max(gap, 1), right, style="on grey15", no_wrap=True)


def _stopped(state: WatchState) -> str:
    """Say at which breakpoint a component stands, or which refused command pauses it."""
    if state.snapshot is not None and state.snapshot.refusal:
        return f": {printable(state.snapshot.refusal)}"
    if state.snapshot is None or state.automata is None or not state.snapshot.stoppedAt:
        return ""
    point = state.snapshot.stoppedAt[0]
    if point.state:
        return f" at {state.automata.state_name(point.automaton, point.state)}"
    found = state.automata.transition(point.automaton, point.transition)
    return f" at {(found and found.name) or f'transition {point.transition}'}"


def _footer() -> Text:
    return Text.assemble(" ", legend(), ("     Ctrl-C ends", _FAINT), no_wrap=True)


def status_line(state: WatchState) -> str:
    """Return the state in one line, for output that is no terminal."""
    if state.trouble:
        return state.trouble
    assert state.automata is not None
    assert state.snapshot is not None
    snapshot = state.snapshot
    paths = (" > ".join(path) for path in state.automata.current_paths(snapshot))
    parts = [f"{snapshot.time:7.1f} s", " + ".join(paths)]
    if snapshot.status is not ComponentStatus.Running:
        parts.append(f"{snapshot.status.name.lower()}{_stopped(state)}")
    for mark in state.marks:
        u, v = from_center(mark, state.image_size)
        parts.append(f"{printable(mark.label)} {u:+.0f} {v:+.0f} px".strip())
    robot = state.robot
    if robot.pan is not None and robot.tilt is not None:
        parts.append(f"head {robot.pan:+.2f} {robot.tilt:+.2f} rad")
    if robot.health is not None:
        parts.append(f"{robot.health.cameraRates.get(state.camera, 0.0):.1f} images/s")
        parts.append(f"real time x {robot.health.realTimeFactor:.2f}")
    return "  ".join(parts)
