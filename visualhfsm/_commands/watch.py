"""Watch a component, a line a second, until the time is over or Ctrl-C, then print a summary."""

from __future__ import annotations

import contextlib
import signal
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rich.console import Console

from codegen.hfsm.document import Document
from interfaces.hfsm import ComponentSnapshot, ComponentStatus, HfsmMonitorPrx, Mark
from visualhfsm._base.errors import EditError, VisualHfsmError
from visualhfsm._base.html_file import check_place
from visualhfsm._commands.watch_line import Telemetry, WatchState
from visualhfsm._commands.watch_summary import figures_of, summarize, summary_table
from visualhfsm._document.serialization import parse_file
from visualhfsm._monitor.realm.automata import Automata
from visualhfsm._monitor.realm.pictures import require_pillow
from visualhfsm._monitor.realm.realm import MONITOR_PREFIX, components, missing_component
from visualhfsm._monitor.run_page import write_run_page
from zenoh_ice import Communicator
from zenoh_ice.application.cli import stop_on_signals
from zenoh_ice.data.text import printable

_PERIOD: Final = 0.1
_LINE_PERIOD: Final = 1.0  # s


@dataclass(frozen=True, slots=True)
class WatchOptions:
    """Options of watching: `seconds`, 0 forever, and `wait`, the limit until the component appears."""

    component: str
    seconds: float = 0.0
    wait: float = 3.0
    report: Path | None = None


def watch(communicator: Communicator, options: WatchOptions, console: Console) -> None:
    """Print what a component and its robot do, then a summary, and write the report if one is wanted.

    The summary comes after Ctrl-C, too. Raises the reason why the component does not appear within `wait` s
    (ConnectFailedException, ObjectNotExistException, InterfaceMismatchException), and MissingPackageError at
    once when the report cannot be drawn.
    """
    if options.report is not None:
        require_pillow()
        check_place(options.report)
    telemetry = Telemetry(communicator, options.component, pictures=options.report is not None)
    with stop_on_signals() as stop:
        # Listening ends first, so that the summary does not change.
        with telemetry:
            _follow(communicator, telemetry, options, console, stop)
        if stop.signal in (0, signal.SIGINT):
            _conclude(telemetry, options, console)


def _follow(
    communicator: Communicator,
    telemetry: Telemetry,
    options: WatchOptions,
    console: Console,
    stop: threading.Event,
) -> None:
    """Print a line each second, the first news at once; seconds count from the component's first snapshot."""
    beginning = time.monotonic()
    first: float | None = None
    due, has_news = beginning, False
    while not stop.is_set():
        now = time.monotonic()
        state = telemetry.update()
        if not (has_news or state.trouble):
            due, has_news = now, True
        if now >= due:
            due = (due if now - due < _LINE_PERIOD else now) + _LINE_PERIOD
            console.print(status_line(state), highlight=False, markup=False, soft_wrap=True)
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
    raise VisualHfsmError.because(
        "{component} is present but sent nothing within {wait:g} s",
        component=options.component,
        wait=options.wait,
    )


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


def status_line(state: WatchState) -> str:
    """Return the state of a component and its robot in one line."""
    if state.trouble:
        return state.trouble
    assert state.automata is not None
    assert state.snapshot is not None
    automata, snapshot = state.automata, state.snapshot
    paths = (" > ".join(path) for path in automata.current_paths(snapshot))
    parts = [f"{snapshot.time:7.1f} s", " + ".join(paths)]
    if snapshot.status is not ComponentStatus.Running:
        parts.append(f"{snapshot.status.name.lower()}{_stopped(automata, snapshot)}")
    if snapshot.errors:
        error = snapshot.errors[-1]
        name = automata.state_name(error.automaton, error.state)
        parts.append(f"error at {error.time:.1f} s in {name}: {printable(error.message)}")
    for mark in state.marks:
        u, v = _from_center(mark, state.image_size)
        parts.append(f"{printable(mark.label)} {u:+.0f} {v:+.0f} px".strip())
    robot = state.robot
    if robot.pan is not None and robot.tilt is not None:
        parts.append(f"head {robot.pan:+.2f} {robot.tilt:+.2f} rad")
    if robot.health is not None:
        if robot.health.fallen:
            parts.append("fallen")
        parts.append(f"{robot.health.cameraRates.get(state.camera, 0.0):.1f} images/s")
        parts.append("robot lost" if state.robot_lost else f"real time x {robot.health.realTimeFactor:.2f}")
    return "  ".join(parts)


def _stopped(automata: Automata, snapshot: ComponentSnapshot) -> str:
    """Return at which breakpoint a component is paused, or which refused command paused it."""
    if snapshot.refusal:
        return f": {printable(snapshot.refusal)}"
    if not snapshot.stoppedAt:
        return ""
    point = snapshot.stoppedAt[0]
    if point.state:
        return f" at {automata.state_name(point.automaton, point.state)}"
    found = automata.transition(point.automaton, point.transition)
    return f" at {(found and found.name) or f'transition {point.transition}'}"


def _from_center(mark: Mark, image_size: tuple[int, int]) -> tuple[float, float]:
    """Return how far a mark is from the center of the picture in pixels, to the right and down."""
    return mark.u - (image_size[0] - 1) / 2, mark.v - (image_size[1] - 1) / 2
