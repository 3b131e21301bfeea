"""Follow one component: its structure, what it does moment by moment, and whether it is still heard of."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Final, NamedTuple

from interfaces.hfsm import Breakpoint, ComponentSnapshot, HfsmMonitorPrx
from visualhfsm.watch.discovery import MONITOR_PREFIX
from visualhfsm.watch.fact import Fact
from zenoh_ice import Communicator, Sample

from .history import History
from .robot import RobotWatch
from .values import LiveSnapshot, LiveStructure, is_sound

__all__ = ["Relay", "Silence"]

_PACE: Final = 0.02
"""Least seconds between two moments that are passed on; of more only the newest is."""
_PACE_EACH: Final = 0.0005
"""The same for each automaton: the page takes in no more of a component of hundreds."""
_SILENT: Final = 1.0
"""Seconds without a word after which a component counts as silent; it speaks ten times a second."""

_logger = logging.getLogger(__name__)


class Silence(NamedTuple):
    """A component is silent since a wall time in s; 0 says that it speaks again."""

    since: float


Told = Callable[[LiveSnapshot | LiveStructure | Silence], None]


class Relay:
    """Pass on what one component tells, whenever it is there; `update` it a few times a second.

    `told` is called from any thread, with a snapshot at every change of state and at least ten times a
    second, with the structure when it is known and when it has changed, and with the beginning and the end of
    silence. A component that is started anew begins a new history.
    """

    def __init__(self, communicator: Communicator, component: str, robot: RobotWatch, told: Told) -> None:
        self.component: Final = component
        self.identity: Final = f"{MONITOR_PREFIX}{component}"
        self.monitor: Final = HfsmMonitorPrx.uncheckedCast(communicator.stringToProxy(self.identity))
        self._communicator = communicator
        self._robot = robot
        self._told = told
        self._structure = Fact(self.monitor.getStructureAsync)
        self._breakpoints: Fact[list[Breakpoint]] = Fact(self.monitor.getBreakpointsAsync)
        self._told_structure: LiveStructure | None = None
        self._run = 1
        self._renewed = False
        self._history = History()
        self._heard = time.monotonic()
        self._heard_at = time.time()
        self._silent = False
        self._order = threading.Lock()  # of moments and of silences: whoever hears them goes by the last one
        self._closed = threading.Event()
        self._subscription = self.monitor.getSnapshot.subscribe(self._on_snapshot)

    @property
    def history(self) -> History:
        """What the component did since it was started, or since it is followed."""
        return self._history

    @property
    def structure(self) -> LiveStructure | None:
        """What does not change; None until it is known."""
        return self._told_structure

    @property
    def silence(self) -> Silence:
        """Whether it is silent."""
        return Silence(self._heard_at if self._silent else 0.0)

    def close(self) -> None:
        """Stop listening."""
        self._closed.set()
        self._subscription.close()

    def forget_breakpoints(self) -> None:
        """Ask for the breakpoints again: somebody may have changed them."""
        self._breakpoints.forget()

    def update(self) -> None:
        """Ask for what is missing, and tell what has changed."""
        self._update_silence()
        if self._silent:
            return
        if self._is_outdated():
            self._renewed = False
            self._structure.forget()
            self._breakpoints.forget()
        structure, breakpoints = self._structure.poll(), self._breakpoints.poll()
        if structure is None or (breakpoints is None and not self._breakpoints.trouble):
            return  # breakpoints that are not known yet must not be taken for none
        told = LiveStructure(structure, self._run, breakpoints or [], self._robot.cameras())
        if told != self._told_structure:
            self._told_structure = told
            self._told(told)

    def _is_outdated(self) -> bool:
        """Return whether the structure that is known is that of before a new start or a reload."""
        known, newest = self._structure.value, self._history.newest
        return self._renewed or (
            known is not None and newest is not None and known.generation != newest.component.generation
        )

    def _update_silence(self) -> None:
        present = self.identity in self._communicator.identities()
        silent = not present or time.monotonic() - self._heard > _SILENT
        with self._order:
            self._become(silent)

    def _become(self, silent: bool) -> None:
        if silent != self._silent:
            self._silent = silent
            self._told(self.silence)

    def _is_of_older(self, snapshot: ComponentSnapshot) -> bool:
        """Return whether a snapshot is of another process that serves the same name, and was started earlier.

        As long as the younger one speaks that one is followed, or each would end the run of the other.
        """
        before = self._history.newest
        speaks = time.monotonic() - self._heard <= _SILENT
        return before is not None and speaks and snapshot.startedAt < before.component.startedAt

    def _on_snapshot(self, sample: Sample[ComponentSnapshot]) -> None:
        if self._closed.is_set():
            return
        snapshot = sample.value
        before = self._history.newest
        if not is_sound(snapshot) or self._is_of_older(snapshot):
            return
        self._heard, self._heard_at = time.monotonic(), time.time()
        if before is not None and snapshot.startedAt != before.component.startedAt:
            self._run += 1
            self._history = History()
            self._renewed = True
        live = LiveSnapshot(sample.wall_time, snapshot, self._robot.read())
        self._history.add(live)
        with self._order:
            self._become(False)  # if that was the last word of one that is gone, it is silent again
            self._told(live)
        self._closed.wait(max(_PACE, _PACE_EACH * len(snapshot.automata)))
