"""Serve `HfsmMonitor`: show what a component does to whoever watches, and let them steer it."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Final, Self

from interfaces.hfsm import (
    Breakpoint,
    ComponentSnapshot,
    ComponentStructure,
    Explanation,
    HfsmMonitor,
    InvalidValue,
    NoSuchElement,
    ReloadRefused,
    ReloadReport,
)
from zenoh_ice import Communicator, Current

from ..errors import EventError, ReloadRefusedError, UnknownElementError, ValueTypeError
from ..observer import Observer
from ..robot import connect
from ..runtime import Runtime
from ..tree import ChangeKind, Run
from .debugger import Debugger
from .snapshot import structure_of, take_snapshot

__all__ = ["Monitor", "MonitorServant"]

_INTERVAL: Final = 0.1
"""Seconds of wall time between snapshots while nothing changes."""
_CLOSE: Final = 2.0
_LONGEST_REASON: Final = 2000
"""Characters of what user code may have raised."""

_logger = logging.getLogger(__name__)


class MonitorServant(HfsmMonitor):
    """The servant of one component."""

    ice_concurrent = True  # a step may last, and must not keep others from looking

    def __init__(self, debugger: Debugger) -> None:
        self._runtime = debugger.runtime
        self._debugger = debugger
        self._started_at = time.time()

    def snapshot(self) -> ComponentSnapshot:
        """Return what the component is doing."""
        return take_snapshot(self._runtime, self._debugger.breakpoints, self._started_at)

    def getStructure(self, current: Current) -> ComponentStructure:  # noqa: ARG002
        """Return the automata of the component."""
        return structure_of(self._runtime)

    def getSnapshot(self, current: Current) -> ComponentSnapshot:  # noqa: ARG002
        """Return what the component is doing."""
        return self.snapshot()

    def pause(self, current: Current) -> None:  # noqa: ARG002
        """Let running cycles end and start none."""
        self._runtime.pause()

    def resume(self, current: Current) -> None:  # noqa: ARG002
        """Go on after a pause."""
        self._debugger.resume()

    def step(self, automaton: int, current: Current) -> None:  # noqa: ARG002
        """Run one cycle of one automaton, or of all with 0, while paused."""
        with _told():
            self._debugger.step(automaton)

    def forceTransition(self, automaton: int, transition: int, current: Current) -> None:  # noqa: ARG002
        """Fire a transition at the next cycle of its automaton."""
        with _told():
            self._runtime.force(automaton, transition)

    def setBreakpoints(self, breakpoints: list[Breakpoint], current: Current) -> None:  # noqa: ARG002
        """Replace all breakpoints."""
        with _told():
            self._debugger.set_breakpoints(breakpoints)

    def getBreakpoints(self, current: Current) -> list[Breakpoint]:  # noqa: ARG002
        """Return all breakpoints."""
        return list(self._debugger.breakpoints.all)

    def setVariable(self, automaton: int, name: str, value: str, current: Current) -> None:  # noqa: ARG002
        """Set a variable of an automaton, or a parameter of the component."""
        with _told():
            self._debugger.set_variable(automaton, name, value)

    def sendEvent(self, name: str, data: str, current: Current) -> None:  # noqa: ARG002
        """Send an event to every active automaton."""
        with _told():
            self._debugger.send_event(name, data)

    def explain(self, automaton: int, current: Current) -> Explanation:  # noqa: ARG002
        """Say of each transition out of the current state why it has not fired."""
        with _told():
            return self._debugger.explain(automaton)

    def reload(self, current: Current) -> ReloadReport:  # noqa: ARG002
        """Load the component's file again and go on in it."""
        with _told():
            done = self._debugger.reload()
        return ReloadReport(generation=done.generation, held=done.held, notKept=list(done.not_kept))

    def stop(self, current: Current) -> None:  # noqa: ARG002
        """End the component."""
        self._runtime.component._hfsm_log.warning("the monitor ends the component")
        self._runtime.request_stop()


@contextmanager
def _told() -> Iterator[None]:
    """Tell whoever asked for something why it cannot be."""
    try:
        yield
    except UnknownElementError as error:
        raise NoSuchElement(str(error)) from error
    except (ValueTypeError, EventError) as error:
        raise InvalidValue(str(error)) from error
    except ReloadRefusedError as error:
        raise ReloadRefused(str(error)[:_LONGEST_REASON]) from error


class Monitor(Observer):
    """Serve the monitor of a component as `Hfsm.<name>` for the time of a `with` block.

    Snapshots are published each 0.1 s and at every change of state, while somebody listens. Changes that
    follow each other faster than they can be sent are shown together. The last snapshot is taken at the end.
    """

    def __init__(self, runtime: Runtime, communicator: Communicator) -> None:
        self.identity: Final = f"Hfsm.{runtime.name}"
        self._runtime = runtime
        self.debugger: Final = Debugger(runtime, lambda component: connect(component, communicator))
        self._servant = MonitorServant(self.debugger)
        self._adapter = communicator.createObjectAdapter(self.identity)
        self._changed = threading.Event()
        self._closing = False
        self._thread = threading.Thread(target=self._publish, name="monitor", daemon=True)
        runtime.tree.observers.append(self)

    def __enter__(self) -> Self:
        self._adapter.add(self._servant, self.identity)
        self._adapter.activate()
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing = True
        self._changed.set()
        self._thread.join(_CLOSE)
        self._adapter.destroy()

    def changed(self, now: int, run: Run, kind: ChangeKind) -> None:  # noqa: ARG002
        """Publish a snapshot soon."""
        self._changed.set()

    def _publish(self) -> None:
        publisher = self._servant.getSnapshotPublisher
        last = told = False
        while not last:
            last = self._closing
            if publisher.listening:
                try:
                    publisher.publish(self._servant.snapshot(), self._runtime.clock.now())
                    told = False
                except Exception:  # variables are user objects, and a watcher must not end the watching
                    if not told:  # ten times a second would hide all else
                        _logger.exception("snapshots cannot be published")
                    told = True
            if not last:
                self._changed.wait(_INTERVAL)
                self._changed.clear()
