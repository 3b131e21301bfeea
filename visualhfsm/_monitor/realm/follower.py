"""Follow one component: its structure, its snapshots, and whether it is silent."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final, NamedTuple

import msgspec

from interfaces.hfsm import Breakpoint, ComponentSnapshot, ComponentStructure, HfsmMonitorPrx
from visualhfsm._monitor.realm.description import DescribedRobot, DescriptionMonitor, nao
from visualhfsm._monitor.realm.realm import DRY_RUN_PREFIX, MONITOR_PREFIX, PolledValue
from visualhfsm._monitor.realm.robot import RobotMonitor, posed_robot
from visualhfsm._monitor.realm.run_log import LiveSnapshot, RunLog, is_sound
from zenoh_ice import Communicator, Sample

_HIGHEST_RATE: Final = 50.0
"""Limit of the published snapshots per second; of more, only the newest is published."""
_AUTOMATA_A_SECOND: Final = 2_000
"""Limit of the automata in them per second, for large components: the page cannot process more."""


class LiveStructure(msgspec.Struct, frozen=True, rename="camel"):
    """The constant data of a component; `run` counts how many times it was started.

    `body` is the hash of a dry run's robot; empty for a component that has the realm's.
    """

    structure: ComponentStructure
    run: int
    breakpoints: list[Breakpoint] = []
    cameras: list[str] = []
    body: str = ""


class Silence(NamedTuple):
    """A component has been silent since a wall time in s; 0 when it sends again."""

    since: float


News = LiveSnapshot | LiveStructure | Silence


class Follower:
    """Follow one component; `update` it a few times a second, and `close` it.

    `publish` is called from any thread, with a snapshot at every change of state and at least ten times a
    second, with the structure when it is known and when it has changed, with what was done to the run, and
    with the beginning and the end of silence: after `silence` s without a snapshot. A component that is
    restarted begins a new log; one that is reloaded continues the same log.
    """

    def __init__(
        self,
        communicator: Communicator,
        component: str,
        robot: RobotMonitor,
        publish: Callable[[News], object] = lambda _: None,
        *,
        silence: float = 1.0,
        awaited: bool = False,
    ) -> None:
        self.component: Final = component
        self.identity: Final = f"{MONITOR_PREFIX}{component}"
        self.monitor: Final = HfsmMonitorPrx.uncheckedCast(communicator.stringToProxy(self.identity))
        self._communicator = communicator
        self._robot = robot
        self._publish = publish
        self._polled_structure = PolledValue(self.monitor.getStructure.begin)
        self._breakpoints: PolledValue[list[Breakpoint]] = PolledValue(self.monitor.getBreakpoints.begin)
        self._tried = DescriptionMonitor(communicator, f"{DRY_RUN_PREFIX}{component}")
        self._structure: LiveStructure | None = None
        self._run = 1
        self._restarted = False
        self._log = RunLog()
        self._received = time.monotonic()
        self._received_at = time.time()
        self._was_present = not awaited
        self._silent = False
        self._longest_silence = silence
        self._order = threading.Lock()  # of snapshots and silences: the last published one is valid
        self._rate = _HIGHEST_RATE
        self._subscription = self.monitor.getSnapshot.subscribe(self._on_snapshot, rate=self._rate)

    @property
    def log(self) -> RunLog:
        """The log of the component since it was started or followed."""
        return self._log

    @property
    def structure(self) -> LiveStructure | None:
        """The structure; None until it is known."""
        return self._structure

    @property
    def knows(self) -> bool:
        """Whether structure and state of the component are known."""
        return self._structure is not None and self._log.newest is not None

    @property
    def described(self) -> DescribedRobot | None:
        """The robot that it drives, as it is drawn; None while that is not known."""
        newest = self._log.newest
        if newest is not None and newest.component.speed:
            return self._tried.robot or nao()
        return self._robot.described

    @property
    def silence(self) -> Silence:
        """Whether it is silent."""
        return Silence(self._received_at if self._silent else 0.0)

    @property
    def age(self) -> float:
        """Wall seconds since its last snapshot, or since it was present first."""
        return time.monotonic() - self._received

    def close(self) -> None:
        """Stop listening."""
        self._subscription.close()

    def forget_breakpoints(self) -> None:
        """Request the breakpoints again: another client may have changed them."""
        self._breakpoints.forget()

    def update(self) -> None:
        """Request missing data, and publish changes."""
        present = self.identity in self._communicator.identities()
        if present and not self._was_present:
            self._was_present, self._received = True, time.monotonic()
        if not self._was_present and self._log.newest is None:
            return  # it has just been started
        with self._order:
            self._set_silent(not present or self.age > self._longest_silence)
        if self._silent and (self._log.newest is None or self.age > self._longest_silence):
            return  # one without a presence token is received anyway
        if self._is_outdated():
            self._restarted = False
            self._polled_structure.forget()
            self._breakpoints.forget()
        structure, breakpoints = self._polled_structure.poll(), self._breakpoints.poll()
        if structure is None or (breakpoints is None and not self._breakpoints.trouble):
            return  # unknown breakpoints must not be published as none
        known = LiveStructure(
            structure, self._run, breakpoints or [], self._robot.cameras(), self._body_of_dry_run()
        )
        if known != self._structure:
            self._structure = known
            self._limit_rate(len(structure.automata))
            self._publish(known)

    def _body_of_dry_run(self) -> str:
        """Return the hash of a dry run's robot; empty for a component that is none."""
        newest = self._log.newest
        if newest is None or not newest.component.speed:
            return ""
        self._tried.update()
        return "" if self._tried.robot is None else self._tried.robot.hash

    def _limit_rate(self, automata: int) -> None:
        rate = min(_HIGHEST_RATE, _AUTOMATA_A_SECOND / max(automata, 1))
        if rate != self._rate:
            self._rate = rate
            self._subscription.close()
            self._subscription = self.monitor.getSnapshot.subscribe(self._on_snapshot, rate=rate)

    def _is_outdated(self) -> bool:
        """Return whether the known structure is from before a restart or a reload."""
        known, newest = self._polled_structure.value, self._log.newest
        return self._restarted or (
            known is not None and newest is not None and known.generation != newest.component.generation
        )

    def _set_silent(self, silent: bool) -> None:
        if silent != self._silent:
            self._silent = silent
            self._publish(self.silence)

    def _is_of_older(self, snapshot: ComponentSnapshot) -> bool:
        """Return whether a snapshot comes from an older process that serves the same name.

        The newer one is followed as long as it sends; otherwise each would end the run of the other.
        """
        before = self._log.newest
        if before is None or self.age > self._longest_silence:
            return False
        return snapshot.startedAt < before.component.startedAt

    def _on_snapshot(self, sample: Sample[ComponentSnapshot]) -> None:
        snapshot = sample.value
        before = self._log.newest
        if not is_sound(snapshot) or self._is_of_older(snapshot):
            return
        self._received, self._received_at = time.monotonic(), time.time()
        if before is not None and snapshot.startedAt != before.component.startedAt:
            self._run += 1
            self._log = RunLog()
            self._restarted = True
        described = self._tried.robot or nao()
        robot = posed_robot(snapshot.joints, described) if snapshot.speed else self._robot.read()
        live = LiveSnapshot(sample.wall_time, snapshot, robot)
        self._log.add(live)
        with self._order:
            self._set_silent(False)  # if that was the last snapshot of a lost component, it is silent again
            self._publish(live)
