"""Serve `HfsmMonitor`: publish what a component does, and let clients steer it."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, Final, Self

from interfaces import hfsm
from zenoh_ice import Communicator, Current
from zenoh_ice.data import typed

from .._component_run import ComponentRun
from .._robot import connect
from .._variables import check_kind
from ..component import Component, require_declared
from ..errors import EventError, ReloadRefusedError, UnknownElementError, ValueTypeError
from ..observer import Observer
from ..tree import Actor, ChangeKind
from ._breakpoints import Breakpoints
from ._explanation import explain
from ._expressions import plain
from .reload import Reloading
from .snapshot import structure_of, take_snapshot

_INTERVAL: Final = 0.1
"""Seconds of wall time between snapshots while nothing changes."""
_CLOSE_LIMIT: Final = 2.0  # s
_LONGEST_REASON: Final = 2000
"""Most characters of a reason, which may be the text of an exception from user code."""
_LONGEST_NAME: Final = 200
_LARGEST_VALUE: Final = 65_536
"""Most bytes of JSON that are accepted as a value."""

_logger = logging.getLogger(__name__)


class _Servant(hfsm.HfsmMonitor):
    """The servant of one component; `connect` connects proxies that a reload adds."""

    ice_concurrent = True  # a step may take long, and must not block other clients

    def __init__(
        self, runtime: ComponentRun, breakpoints: Breakpoints, connect: Callable[[Component], None]
    ) -> None:
        self._runtime = runtime
        self._breakpoints = breakpoints
        self._reloading = Reloading(runtime, connect)
        self._started_at = time.time()

    def getStructure(self, current: Current) -> hfsm.ComponentStructure:  # noqa: ARG002
        return structure_of(self._runtime)

    def getSnapshot(self, current: Current | None = None) -> hfsm.ComponentSnapshot:  # noqa: ARG002
        return take_snapshot(self._runtime, self._started_at, self._breakpoints)

    def pause(self, current: Current | None = None) -> None:  # noqa: ARG002
        self._runtime.pause()

    def resume(self, current: Current | None = None) -> None:  # noqa: ARG002
        # Not both under the tree's lock: a cycle of a recorded component takes another lock before that one.
        self._breakpoints.leave(self._runtime.tree.actors)
        self._runtime.resume()

    def step(self, automaton: int, current: Current | None = None) -> None:  # noqa: ARG002
        with _translated_errors():
            actors = self._runtime.tree.actors if automaton == 0 else (self._runtime.actor(automaton),)
            self._breakpoints.leave(actors)
            self._runtime.step(automaton)

    def forceTransition(self, automaton: int, transition: int, current: Current) -> None:  # noqa: ARG002
        with _translated_errors():
            self._runtime.force(automaton, transition)

    def setBreakpoints(self, breakpoints: list[hfsm.Breakpoint], current: Current) -> None:  # noqa: ARG002
        with _translated_errors():
            self._breakpoints.set(breakpoints)

    def getBreakpoints(self, current: Current) -> list[hfsm.Breakpoint]:  # noqa: ARG002
        return self._breakpoints.all

    def setVariable(self, automaton: int, name: str, value: str, current: Current | None = None) -> None:  # noqa: ARG002
        with _translated_errors():
            read = _read_json(value)
            if automaton:
                check_kind(self._runtime.actor(automaton).automaton, name, read)
            self._runtime.set_variable(automaton, _checked(name), read)

    def sendEvent(self, name: str, data: str, current: Current | None = None) -> None:  # noqa: ARG002
        with _translated_errors():
            sent = _read_json(data) if data else None
            require_declared(self._runtime.component, _checked(name))
            self._runtime.send(name, sent)

    def setSpeed(self, speed: float, current: Current) -> None:  # noqa: ARG002
        with _translated_errors():
            self._runtime.set_speed(speed)

    def explain(self, automaton: int, current: Current) -> hfsm.Explanation:  # noqa: ARG002
        with _translated_errors():
            return explain(self._runtime.tree, self._runtime.actor(automaton), self._runtime.component_time)

    def reload(self, current: Current | None = None) -> hfsm.ReloadReport:  # noqa: ARG002
        with _translated_errors():
            report = self._reloading.reload()
        report.notKept += self._breakpoints.renew()
        return report

    def stop(self, current: Current | None = None) -> None:  # noqa: ARG002
        self._runtime.request_stop()  # before the log, whose handlers may be user code
        self._runtime.component._hfsm_log.warning("the monitor ends the component")


@contextmanager
def _translated_errors() -> Iterator[None]:
    """Raise the exceptions of the interface for errors in a `with` block."""
    try:
        yield
    except UnknownElementError as error:
        raise hfsm.NoSuchElement(str(error)) from error
    except (ValueTypeError, EventError) as error:
        raise hfsm.InvalidValue(str(error)) from error
    except ReloadRefusedError as error:
        raise hfsm.ReloadRefused(str(error)[:_LONGEST_REASON]) from error


def _read_json(text: str) -> Any:  # noqa: ANN401 - whatever JSON knows
    """Return a value that came over the network as JSON; raises ValueTypeError."""
    if len(text.encode()) > _LARGEST_VALUE:
        raise ValueTypeError(f"the value has more than {_LARGEST_VALUE} bytes")
    try:
        return plain(typed.from_json(text.encode()))
    except (ValueError, RecursionError) as error:  # msgspec's own errors are ValueErrors
        raise ValueTypeError(f"the value is not JSON, or not accepted: {error}") from None


def _checked(name: str) -> str:
    if not name or len(name) > _LONGEST_NAME or not name.isprintable():
        raise ValueTypeError(f"a name has 1 to {_LONGEST_NAME} visible characters")
    return name


class Monitor(Observer):
    """Serve the monitor of a component as `Hfsm.<name>` during a `with` block.

    Snapshots are published every 0.1 s and at every change of state, while there are listeners. Changes that
    are faster than they can be sent share a snapshot. The last snapshot is taken at the end. A run that
    is recorded gets them all. `connect_proxies` connects proxies that a reload adds, by default over the
    same communicator.
    Raises UnknownElementError and ValueTypeError for invalid breakpoints.
    """

    def __init__(
        self,
        runtime: ComponentRun,
        communicator: Communicator,
        breakpoints: Iterable[hfsm.Breakpoint] = (),
        connect_proxies: Callable[[Component], None] | None = None,
    ) -> None:
        self.identity: Final = f"Hfsm.{runtime.name}"
        self.runtime: Final = runtime
        points = Breakpoints(runtime)
        points.set(breakpoints)
        connect_all = connect_proxies or partial(connect, communicator=communicator)
        self.servant: Final = _Servant(runtime, points, connect_all)
        self._adapter = communicator.createObjectAdapter(self.identity)
        self._changed = threading.Event()
        self._closing = False
        self._thread = threading.Thread(target=self._publish, name="monitor", daemon=True)
        runtime.tree.observers.append(self)

    def __enter__(self) -> Self:
        self._adapter.add(self.servant, self.identity)
        self._adapter.activate()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closing = True
        self._changed.set()
        self._thread.join(_CLOSE_LIMIT)
        self._adapter.destroy()

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        """Publish a snapshot soon."""
        self._changed.set()

    def _publish(self) -> None:
        publisher = self.servant.getSnapshotPublisher
        last = reported = False
        while not last:
            last = self._closing
            record = self.runtime.record_snapshot
            if publisher.listening or record is not None:
                try:
                    snapshot = self.servant.getSnapshot()
                    publisher.publish(snapshot, self.runtime.clock.now())
                    if record is not None:
                        record(snapshot)
                    reported = False
                except BaseException:  # variables are user objects, whose errors must not end the monitor
                    if not reported:  # ten reports a second would hide everything else
                        _logger.exception("snapshots cannot be published")
                    reported = True
            if not last:
                self._changed.wait(_INTERVAL)
                self._changed.clear()
