"""Watch a component until the time is over or Ctrl-C, then sum up how it went."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.live import Live

from interfaces.hfsm import HfsmMonitorPrx
from visualhfsm.errors import VisualHfsmError
from visualhfsm.monitoring.realm import MONITOR_PREFIX, components, missing_component
from visualhfsm.watch.report import ReportContents, check_packages, check_place, summary_table, write_report
from visualhfsm.watch.telemetry import Telemetry, WatchState
from visualhfsm.watch.view import View, status_line
from zenoh_ice import Communicator
from zenoh_ice.command import stop_on_signals

__all__ = ["WatchOptions", "watch"]

_PERIOD: Final = 0.1
_PLAIN_PERIOD: Final = 1.0
_MOST_STDERR: Final = 65_536
_PICTURES_IN_REPORT: Final = 8


@dataclass(frozen=True, slots=True)
class WatchOptions:
    """How a component is watched: `seconds` of 0 is for ever, `wait` how long it may take to appear."""

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
        check_packages()
        check_place(options.report)
    began = datetime.now().astimezone()
    live = console.is_terminal and not options.plain
    telemetry = Telemetry(communicator, options.component, pictures=options.report is not None)
    with stop_on_signals() as stop:
        # Listening ends first, so that what is summed up stands still.
        with telemetry, _live_display(console) if live else _plain_display(console) as show:
            _follow(communicator, telemetry, options, show, stop)
        if stop.signal in (0, signal.SIGINT):
            _conclude(telemetry, options, began, console)


def _follow(
    communicator: Communicator,
    telemetry: Telemetry,
    options: WatchOptions,
    show: Callable[[WatchState], None],
    stop: threading.Event,
) -> None:
    """Show what is there ten times a second; the seconds count from the component's first word."""
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
    """Raise the reason for which a component did not appear."""
    missing = missing_component(communicator, options.component)
    if missing is not None and components(communicator):
        raise missing
    HfsmMonitorPrx.checkedCast(communicator.stringToProxy(f"{MONITOR_PREFIX}{options.component}"))
    raise VisualHfsmError(f"{options.component} is there but sent nothing within {options.wait:g} s")


def _conclude(telemetry: Telemetry, options: WatchOptions, began: datetime, console: Console) -> None:
    if telemetry.automata is None or telemetry.log.newest is None:
        console.print(f"Nothing was heard of {options.component}: there is nothing to sum up.")
        return
    contents = ReportContents(
        telemetry.automata,
        telemetry.log,
        began,
        telemetry.camera,
        telemetry.image_size,
        telemetry.outside_album.choose(_PICTURES_IN_REPORT),
        telemetry.camera_album.choose(_PICTURES_IN_REPORT),
        telemetry.outside_trouble,
    )
    console.print(summary_table(contents))
    if options.report is not None:
        write_report(options.report, contents)
        console.print(f"Report: {options.report}")


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
    """Keep what is written to stderr, by Zenoh's own logger too, from the screen, and print it at the end."""
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
