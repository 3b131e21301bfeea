"""Watch a component in the terminal until the time is over or Ctrl-C, then print a summary.

The view lays out automata, camera, robot and changes to fit the terminal.
"""

from __future__ import annotations

import contextlib
import math
import os
import signal
import sys
import tempfile
import textwrap
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rich.console import Console, ConsoleOptions, RenderResult
from rich.layout import Layout
from rich.live import Live
from rich.panel import Panel
from rich.text import Text

from codegen.hfsm.document import Document
from interfaces.hfsm import ComponentStatus, HfsmMonitorPrx, TransitionStructure
from interfaces.nao import Severity
from visualhfsm.editing.serialization import parse_file
from visualhfsm.errors import EditError, VisualHfsmError
from visualhfsm.monitoring.automata import by_id
from visualhfsm.monitoring.pictures import require_pillow
from visualhfsm.monitoring.realm import MONITOR_PREFIX, components, missing_component
from visualhfsm.monitoring.robot import STALE
from visualhfsm.run_page import check_place, write_run_page
from visualhfsm.watch.panels import camera_lines, from_center, legend, robot_lines, tree_lines
from visualhfsm.watch.summary import figures_of, summarize, summary_table
from visualhfsm.watch.telemetry import Telemetry, WatchState
from zenoh_ice import Communicator
from zenoh_ice.application.cli import stop_on_signals
from zenoh_ice.text import printable

_PERIOD: Final = 0.1
_PLAIN_PERIOD: Final = 1.0
_MOST_STDERR: Final = 65_536
_FAINT = "bright_black"
_NARROW = 72
"""Width in columns below which the parts are stacked."""
_ROBOT_ROWS = 9
_BORDERS = 2


@dataclass(frozen=True, slots=True)
class WatchOptions:
    """Options of watching: `seconds`, 0 forever, and `wait`, the limit until the component appears."""

    component: str
    seconds: float = 0.0
    wait: float = 3.0
    report: Path | None = None
    plain: bool = False


def watch(communicator: Communicator, options: WatchOptions, console: Console) -> None:
    """Show a component and its robot, then a summary, and write the report if one is wanted.

    The summary comes after Ctrl-C, too. Raises the reason why the component does not appear within `wait` s
    (ConnectFailedException, ObjectNotExistException, InterfaceMismatchException), and MissingPackageError at
    once when the report cannot be drawn.
    """
    if options.report is not None:
        require_pillow()
        check_place(options.report)
    live = console.is_terminal and not options.plain
    telemetry = Telemetry(communicator, options.component, pictures=options.report is not None)
    with stop_on_signals() as stop:
        # Listening ends first, so that the summary does not change.
        with telemetry, _live_display(console) if live else _plain_display(console) as show:
            _follow(communicator, telemetry, options, show, stop)
        if stop.signal in (0, signal.SIGINT):
            _conclude(telemetry, options, console)


def _follow(
    communicator: Communicator,
    telemetry: Telemetry,
    options: WatchOptions,
    show: Callable[[WatchState], None],
    stop: threading.Event,
) -> None:
    """Draw the view ten times a second; the seconds count from the component's first snapshot."""
    beginning = time.monotonic()
    first: float | None = None
    while not stop.is_set():
        now = time.monotonic()
        state = telemetry.update(now - first if first is not None else 0.0, options.seconds)
        show(state)
        if first is None and state.snapshot is not None:
            first = now
        elif first is None and now - beginning > options.wait:
            _explain_absence(communicator, options)
        if first is not None and options.seconds and now - first >= options.seconds:
            return
        stop.wait(_PERIOD - (time.monotonic() - beginning) % _PERIOD)


def _explain_absence(communicator: Communicator, options: WatchOptions) -> None:
    """Raise the reason why a component did not appear."""
    missing = missing_component(communicator, options.component)
    if missing is not None and components(communicator):
        raise missing
    HfsmMonitorPrx.checkedCast(communicator.stringToProxy(f"{MONITOR_PREFIX}{options.component}"))
    raise VisualHfsmError(f"{options.component} is present but sent nothing within {options.wait:g} s")


def _conclude(telemetry: Telemetry, options: WatchOptions, console: Console) -> None:
    automata, log = telemetry.automata, telemetry.log
    if automata is None or log.newest is None:
        console.print(f"Nothing was received from {options.component}: there is nothing to report.")
        return
    figures = list(figures_of(summarize(log, telemetry.camera, telemetry.image_size)))
    console.print(summary_table(automata, log, figures))
    if options.report is not None:
        size = write_run_page(
            options.report, telemetry.exported(_document_of(automata.structure.document), figures)
        )
        console.print(f"Report: {options.report}")
        console.print(f"It has {size / 1e6:.1f} MB and needs no network.")


def _document_of(name: str) -> Document | None:
    """Return the document of a component, if a file of its name lies here or in `behaviors`."""
    for folder in (Path(), Path("behaviors")):
        with contextlib.suppress(OSError, EditError):
            return parse_file((folder / Path(name).name).read_bytes(), Path(name))
    return None


@contextlib.contextmanager
def _plain_display(console: Console) -> Iterator[Callable[[WatchState], None]]:
    """Print a line each second."""
    due = 0.0

    def show(state: WatchState) -> None:
        nonlocal due
        now = time.monotonic()
        if now >= due:
            due = (now if now - due > _PLAIN_PERIOD else due) + _PLAIN_PERIOD
            console.print(status_line(state), highlight=False, markup=False, soft_wrap=True)

    yield show


@contextlib.contextmanager
def _live_display(console: Console) -> Iterator[Callable[[WatchState], None]]:
    """Fill the terminal."""
    with _stderr_set_aside(), Live(console=console, screen=True, auto_refresh=False, transient=True) as live:
        yield lambda state: live.update(View(state), refresh=True)


@contextlib.contextmanager
def _stderr_set_aside() -> Iterator[None]:
    """Hold back stderr, including the output of Zenoh's own logger, and print it at the end."""
    stderr = 2
    if not os.isatty(stderr):
        yield
        return
    sys.stderr.flush()
    with tempfile.TemporaryFile() as kept:
        before = os.dup(stderr)
        os.dup2(kept.fileno(), stderr)
        try:
            yield
        finally:
            sys.stderr.flush()
            os.dup2(before, stderr)
            os.close(before)
            size = kept.seek(0, os.SEEK_END)
            kept.seek(max(size - _MOST_STDERR, 0))
            sys.stderr.write(kept.read().decode(errors="replace"))
            sys.stderr.flush()


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
        lines = [Text("nothing received yet", _FAINT)]
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
    """Show at which breakpoint a component is paused, or which refused command paused it."""
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
    """Return the state in one line, for output that is not a terminal."""
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
