"""Watch a component and its robot: a line a second, and at the end the page of the run, if one is wanted."""

from __future__ import annotations

import asyncio
import contextlib
import math
import signal
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Self

from rich.console import Console

from codegen.hfsm.document import Document
from interfaces.hfsm import ComponentSnapshot, ComponentStatus, HfsmMonitorPrx
from visualhfsm._base.errors import EditError, VisualHfsmError
from visualhfsm._base.html_file import check_place
from visualhfsm._document.serialization import parse_file
from visualhfsm._monitor.cameras import MOST_CAMERAS, Cameras
from visualhfsm._monitor.realm.automata import Automata
from visualhfsm._monitor.realm.body import STALE
from visualhfsm._monitor.realm.follower import Follower
from visualhfsm._monitor.realm.pictures import require_pillow
from visualhfsm._monitor.realm.realm import MONITOR_PREFIX, components, missing_component
from visualhfsm._monitor.realm.robot import RobotMonitor, RobotState
from visualhfsm._monitor.realm.run_log import RunLog
from visualhfsm._monitor.run_page import MOST_PICTURES, ExportedRun, write_run_page
from zenoh_ice import Communicator
from zenoh_ice.application.cli import stop_on_signals
from zenoh_ice.data.text import printable

_PERIOD: Final = 0.1
_LINE_PERIOD: Final = 1.0  # s


@dataclass(frozen=True, slots=True)
class WatchState:
    """A component and its robot at one moment; what has not arrived yet is None or empty.

    Ages are wall seconds since the last sample.
    """

    component: str
    endpoint: str
    automata: Automata | None = None
    snapshot: ComponentSnapshot | None = None
    snapshot_age: float = math.inf
    robot: RobotState = field(default_factory=RobotState)
    robot_age: float = math.inf
    robot_lost: bool = False
    """True while the robot's server does not reach it: only a real one can be lost."""

    @property
    def trouble(self) -> str:
        """Who does not answer, and what to do about it; empty when all is well."""
        if self.robot_age == math.inf:
            return f"Waiting for a robot server at {self.endpoint}; naoserver-sim starts one"
        if self.robot_age > STALE:
            return (
                f"Robot server lost {self.robot_age:.0f} s ago; going on when it is back at {self.endpoint}"
            )
        if self.automata is None or self.snapshot is None:
            return f"Waiting for {self.component}; start it, such as by python {self.component}.py"
        if self.snapshot_age > STALE:
            return f"{self.component} lost {self.snapshot_age:.0f} s ago; going on when it is back"
        return ""


class Telemetry:
    """The data of a component and its robot; `update` them about ten times a second.

    Both may be missing at the start, and are found again after they were lost. A component that is restarted
    begins a new log; one that is reloaded continues the same log.
    """

    def __init__(self, communicator: Communicator, component: str, *, pictures: bool) -> None:
        self._communicator = communicator
        self._robot = RobotMonitor(communicator)
        self._follower = Follower(communicator, component, self._robot)
        self.automata: Automata | None = None
        """The automata, None before the component has sent its structure."""
        self._takes_pictures = pictures
        self._cameras = Cameras(communicator)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._follower.close()

    @property
    def log(self) -> RunLog:
        """The log of the component's run."""
        return self._follower.log

    def exported(self, automata: Automata) -> ExportedRun:
        """Return the run with its pictures."""
        return ExportedRun(
            name=self._follower.component,
            structure=automata.structure,
            log=self.log,
            document=_document_of(automata.structure.document),
            world=self._robot.world.shapes,
            pictures=self._cameras.former.spread(MOST_PICTURES, *self.log.wall_times()),
        )

    def update(self) -> WatchState:
        """Request missing data and return the present state."""
        self._robot.update()
        self._follower.update()
        live = self._follower.structure
        if live is not None and (self.automata is None or self.automata.structure is not live.structure):
            self.automata = Automata(live.structure)
        newest = self.log.newest
        # After a reload its automata are not known at once.
        known = newest is not None and self.automata is not None and self.automata.fit(newest.component)
        snapshot = newest.component if newest is not None and known else None
        if snapshot is not None and self._takes_pictures:
            asyncio.run(self._cameras.keep(self._robot.cameras()[:MOST_CAMERAS]))
        age = self._robot.age()
        return WatchState(
            component=self._follower.component,
            endpoint=", ".join(self._communicator.settings.connect),
            automata=self.automata,
            snapshot=snapshot,
            snapshot_age=self._follower.age,
            robot=self._robot.read(stale=age > STALE),
            robot_age=age,
            robot_lost=not self._robot.presence().present,
        )


def watch(
    communicator: Communicator,
    component: str,
    console: Console,
    *,
    seconds: float = 0.0,
    wait: float = 3.0,
    report: Path | None = None,
) -> None:
    """Print what a component and its robot do for some seconds, 0 forever, and write the report.

    It is written after Ctrl-C, too. Raises the reason why the component does not appear within `wait` s
    (ConnectFailedException, ObjectNotExistException, InterfaceMismatchException), and MissingPackageError at
    once when the report cannot be drawn.
    """
    if report is not None:
        require_pillow()
        check_place(report)
    with stop_on_signals() as stop:
        telemetry = Telemetry(communicator, component, pictures=report is not None)
        with telemetry:  # listening ends before the report
            if not _follow(telemetry, console, stop, seconds, wait):
                _explain_absence(communicator, component, wait)
        if stop.signal not in (0, signal.SIGINT):
            return
        if telemetry.automata is None or telemetry.log.newest is None:
            console.print(f"Nothing was received from {component}: there is nothing to report.")
            return
        changes = len(telemetry.log.changes())
        console.print(f"watched {telemetry.log.duration:.1f} s of {component}: {changes} changes of state")
        if report is not None:
            size = write_run_page(report, telemetry.exported(telemetry.automata))
            console.print(f"Report: {report}")
            console.print(f"It has {size / 1e6:.1f} MB and needs no network.")


def _follow(
    telemetry: Telemetry, console: Console, stop: threading.Event, seconds: float, wait: float
) -> bool:
    """Print a line each second, the first news at once; return whether the component appeared in time.

    Seconds count from its first snapshot.
    """
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
        elif first is None and now - beginning > wait:
            return False
        if first is not None and seconds and now - first >= seconds:
            break
        stop.wait(_PERIOD - (time.monotonic() - beginning) % _PERIOD)
    return True


def _explain_absence(communicator: Communicator, component: str, wait: float) -> None:
    """Raise the reason why a component did not appear."""
    missing = missing_component(communicator, component)
    if missing is not None and components(communicator):
        raise missing
    HfsmMonitorPrx.checkedCast(communicator.stringToProxy(f"{MONITOR_PREFIX}{component}"))
    raise VisualHfsmError.because(
        "{component} is present but sent nothing within {wait:g} s", component=component, wait=wait
    )


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
    parts += (f"{printable(mark.label)} {mark.u:.0f} {mark.v:.0f} px".strip() for mark in snapshot.marks)
    robot = state.robot
    if robot.pan is not None and robot.tilt is not None:
        parts.append(f"head {robot.pan:+.2f} {robot.tilt:+.2f} rad")
    parts += (f"{fault} (made to fail)" for fault in robot.failing)
    if robot.health is not None:
        if robot.health.fallen:
            parts.append("fallen")
        parts.append(f"{max(robot.health.cameraRates.values(), default=0.0):.1f} images/s")
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
