"""A behavior of an agent on a robot: a process that ends in time, and what happened to it."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, Self, TypeVar

import msgspec

from interfaces.hfsm import ComponentSnapshot, HfsmMonitorPrx
from interfaces.nao import GroundTruthPrx, HealthPrx, SafetyPrx
from visualhfsm import Project
from visualhfsm.plugins import MONITOR_PREFIX, Automata, child_environment, digest_of, kill_group
from visualhfsm.trials import Archive, unpack
from zenoh_ice import Communicator, ObjectPrx, ZenohIceError
from zenoh_ice.application import tether_command

from . import _component as component
from ._code import identities_of, require_tame
from ._limits import Limits

_PERIOD: Final = 0.1  # s
_GRACE: Final = 5.0
"""Seconds that a component may take beyond its time, and from each signal to the next."""
_LONGEST: Final = "the longest run that a person allows"
_MOST_LINES: Final = 200
_LONGEST_LINE: Final = 500
_P = TypeVar("_P", bound=ObjectPrx)


class Prepared:
    """A private copy of a document with all that it uses, and its component, whose code is tame."""

    def __init__(self, archive: Archive) -> None:
        """Raise AgentError where code is not tame, VisualHfsmError where there is no component."""
        self._folder = TemporaryDirectory(prefix="visualhfsm-agent-", ignore_cleanup_errors=True)
        try:
            top = Path(self._folder.name)
            unpack(archive.content, top)
            self.document: Final = top / archive.document
            self.digest: Final = digest_of(archive)
            with Project(top, journals=top / ".journals") as project:
                self.component: Final = project.open(self.document).generate()
            require_tame(self.document.parent)
            self.identities: Final = identities_of(self.component)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Delete the copy."""
        self._folder.cleanup()


class LimitedRun:
    """A component that was started; it is stopped after the longest run, whatever it does."""

    def __init__(
        self,
        prepared: Prepared,
        realm: Communicator,
        limits: Limits,
        environment: Mapping[str, str],
        held: int,
    ) -> None:
        """Start it; it keeps a file open that holds the lock of the project, to its own end."""
        self.name: Final = prepared.component.stem
        self._prepared = prepared
        self._realm = realm
        self._began = time.monotonic()
        self._limit = limits.longest_run
        self._stopped_by = ""
        self._snapshot: ComponentSnapshot | None = None
        self._structure: Automata | None = None
        self._lines: deque[str] = deque(maxlen=_MOST_LINES)
        self._start = self._robot()
        allowed = msgspec.json.encode((limits.interfaces, limits.most)).decode()
        command = [
            sys.executable,
            "-P",
            "-m",
            component.__name__,
            str(prepared.component),
            "--seconds",
            f"{self._limit + _GRACE}",  # should this process stand still
        ]
        self._process = subprocess.Popen(
            [*tether_command(), *command],
            env={**child_environment(), **environment, component.LIMITS: allowed},
            cwd=prepared.component.parent,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            pass_fds=[held],
        )
        parts = self._read, self._watch, self._end
        self._threads = [threading.Thread(target=each, daemon=True) for each in parts]
        for thread in self._threads:
            thread.start()

    @property
    def runs(self) -> bool:
        """Whether it runs."""
        return self._process.poll() is None

    def wait(self, seconds: float) -> None:
        """Wait for its end, for some s."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(seconds)

    def stop(self, by: str) -> None:
        """End the component, which stops the robot; wait until it has ended."""
        if self.runs:
            self._stopped_by = self._stopped_by or by
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
                self._process.send_signal(number)
                try:
                    self._process.wait(_GRACE)
                    break
                except subprocess.TimeoutExpired:
                    continue
        kill_group(self._process)
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(_GRACE)
        self._prepared.close()

    def report(self) -> dict[str, Any]:
        """Return what happened: where it is, how it ended, what the robot did; texts of others are data."""
        if not self.runs:  # what it wrote last may still be on its way
            self._threads[0].join(_GRACE)
        now, snapshot = self._robot(), self._snapshot
        path = [] if snapshot is None or self._structure is None else self._structure.current_path(snapshot)
        moved = None
        if (before := self._start.get("place")) and (after := now.get("place")):
            moved = round(math.dist(before, after), 3)
        limited = now.get("limited", 0) - self._start.get("limited", 0)
        return {
            "runs": self.runs,
            "exit_code": self._process.poll(),
            "stopped_by": self._ended_by(),
            "seconds": round(time.monotonic() - self._began, 1),
            "component_seconds": None if snapshot is None else round(snapshot.time, 3),
            "status": snapshot.status.name.lower() if snapshot is not None and self.runs else "",
            "limited_commands": max(0, limited),
            "moved_m": moved,
            "fallen": now.get("fallen"),
            "emergency_stop": now.get("stopped"),
            "data": {
                "component": self.name,
                "states": path,
                "variables": {} if snapshot is None else _variables(snapshot),
                "errors": []
                if snapshot is None
                else [f"{e.message} ({e.location})" for e in snapshot.errors],
                "refused": "" if snapshot is None else snapshot.refusal,
                "events": now.get("events", []),
                "why_stopped": now.get("why", ""),
                "output": [*self._lines][-40:],
            },
        }

    def _ended_by(self) -> str:
        """Return who or what has ended it; empty while it runs."""
        code = self._process.poll()
        if code is None or self._stopped_by:
            return self._stopped_by
        if code == 0:
            return "itself"
        return f"signal {-code}" if code < 0 else "an error"

    def _read(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as output:
            while line := output.readline(_LONGEST_LINE):
                self._lines.append(line.decode(errors="replace").rstrip())

    def _watch(self) -> None:
        monitor = HfsmMonitorPrx.uncheckedCast(self._realm.stringToProxy(f"{MONITOR_PREFIX}{self.name}"))
        while self.runs:
            try:
                if self._structure is None:
                    self._structure = Automata(monitor.getStructure())
                self._snapshot = monitor.getSnapshot()
            except ZenohIceError:
                pass  # it starts, or ends
            time.sleep(_PERIOD)

    def _end(self) -> None:
        """Leave nothing behind after its end, which comes in time whatever it, or its monitor, answers."""
        self.wait(self._limit)
        self.stop(_LONGEST)

    def _robot(self) -> dict[str, Any]:
        """Return what the robot says of itself, as far as it answers."""
        found: dict[str, Any] = {}
        if health := self._asked(HealthPrx, "Health", HealthPrx.getHealth):
            events = [f"{each.source}: {each.message}" for each in health.events]
            found |= {"limited": health.limitedCommands, "fallen": health.fallen, "events": events}
        if safety := self._asked(SafetyPrx, "Safety", SafetyPrx.getSafetyState):
            found |= {"stopped": safety.stopped, "why": safety.reason or safety.lost}
        if truth := self._asked(GroundTruthPrx, "GroundTruth", GroundTruthPrx.getGroundTruth):
            found["place"] = (truth.torso.position.x, truth.torso.position.y)
        return found

    def _asked(self, kind: type[_P], identity: str, ask: Callable[[_P], Any]) -> Any:  # noqa: ANN401
        if identity not in self._realm.identities():
            return None
        try:
            return ask(kind.uncheckedCast(self._realm.stringToProxy(identity)))
        except ZenohIceError:  # it has just gone
            return None


def _variables(snapshot: ComponentSnapshot) -> dict[str, str]:
    return {name: value for each in snapshot.automata for name, value in each.variables.items()}
