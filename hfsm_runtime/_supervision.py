"""Handle errors: log them, remember them for the monitor, and apply the policy."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Final

import msgspec

from interfaces.hfsm import ErrorReport
from interfaces.jderobot import CommandRefusedException, HardwareFailedException
from zenoh_ice.data.exceptions import (
    BusyException,
    CommunicatorDestroyedException,
    ConnectionLostException,
    ObjectNotExistException,
    TimeoutException,
    ZenohIceError,
)
from zenoh_ice.data.text import encodable, printable, sentence

from ._advice import explain
from ._automaton import Event, Transition
from ._cycle import CycleEnded
from ._limits import RuntimeLimits
from ._own_threads import report_ignored
from ._timeline import Timeline
from ._variables import short_repr
from .component import Component, source_of
from .errors import OnError, OnRefused, describe, exit_code_of, part_of_component
from .observer import Observer
from .places import locate
from .tree import Actor, DropReason, Tree

_KEPT: Final = 10_000
"""Errors; so many that a test or a judge counts all of a run."""
_LONGEST_MESSAGE: Final = 1000
_LOG_PERIOD: Final = 10.0
"""Wall seconds in which a repeated error is logged once."""
_HARDWARE_FAILURES: Final = 10
"""Consecutive cycles with failing hardware that make an error; fewer may just mean a late picture."""

UNAVAILABLE: Final = (
    ConnectionLostException,
    ObjectNotExistException,
    BusyException,
    TimeoutException,
)
"""Exceptions of a proxy while its server is offline: not the user's fault, and possibly temporary."""


class Refusal(msgspec.Struct, frozen=True):
    """A refused command: where and why (`message`), and the holder of the robot, if any.

    `since` is monotonic wall time in s.
    """

    message: str
    holder: str
    since: float


class _Outage:
    """Automata that wait for the same thing, each until it completes a cycle or becomes a ghost."""

    def __init__(self) -> None:
        self.waiting: set[Actor] = set()
        self._began = 0.0

    def add(self, actor: Actor) -> bool:
        """Add an automaton; return whether it is the first."""
        first = not self.waiting
        if first:
            self._began = time.monotonic()
        self.waiting.add(actor)
        return first

    def recovered(self, actor: Actor) -> float | None:
        """Note a completed cycle; return the duration of the outage in s if it is over now."""
        before, self.waiting = self.waiting, {r for r in self.waiting if r.active and r is not actor}
        return time.monotonic() - self._began if before and not self.waiting else None


class Supervision(Observer):
    """Handle the errors in the cycles of one component.

    `on_error` and `on_refused` are the policies, by default those of the document. `halt` is called with an
    exit code when an error is to stop the component, `pause` when a refused command is to pause it, and
    `stop` to stop everything where exit code failed, or does not run.

    While a server is offline, the cycles that need it are ended, and tried again at their next time; the log
    reports once that it is offline and once that it is back. It is back when `servers_present` returns true
    and the automata that missed it have completed a cycle or become ghosts. A refusal is logged in the same
    way: it is over when the refused automata complete a cycle.
    """

    def __init__(
        self,
        tree: Tree,
        timeline: Timeline,
        component: Component,
        on_error: OnError | None = None,
        on_refused: OnRefused | None = None,
        *,
        halt: Callable[[int], None],
        pause: Callable[[Refusal], None],
        stop: Callable[[Component], None],
        servers_present: Callable[[], bool] = lambda: True,
        hand_over: float = RuntimeLimits.hand_over,
    ) -> None:
        self.hand_over = hand_over
        self.now = timeline.now
        self._tree = tree
        self._timeline = timeline
        self._policies = on_error, on_refused
        self._halt = halt
        self._pause = pause
        self._stop = stop
        self._servers_present = servers_present
        self._lock = threading.Lock()
        self._records: deque[ErrorReport] = deque(maxlen=_KEPT)
        self._logged: dict[tuple[int, int, str], tuple[float, int]] = {}
        self._without_server = _Outage()
        self._refusals = _Outage()
        self._hardware_failures: dict[Actor, tuple[int, int]] = {}
        """Cycles in a row in which hardware failed: how many, and the number of the last one."""
        self.raised = False
        """True once code has raised an exception."""
        self.halted = False
        """True once an error has ended the component."""
        self._crashes: list[BaseException] = []
        self._dropped: set[tuple[int, int, str]] = set()
        """Dropped events: the automaton, its state, and the event with the reason."""
        tree.observers.append(self)
        self.turn_to(component)

    def turn_to(self, component: Component) -> None:
        """Continue with another version of the component."""
        self._component = component
        self._log = component._hfsm_log
        on_error, on_refused = self._policies
        self.on_error: OnError = on_error or component._hfsm_on_error
        self.on_refused = on_refused or component._hfsm_on_refused
        self._file = source_of(component)

    @property
    def records(self) -> tuple[ErrorReport, ...]:
        """The errors, oldest first: the newest 10,000."""
        with self._lock:
            return tuple(self._records)

    def heard(self, actor: Actor, error: Exception) -> bool:
        """Return whether a state, from the automaton up, hears an exception of a servant as an event.

        A picture that may just be late is none.
        """
        self.raised = True
        if not isinstance(error, ZenohIceError) or isinstance(error, CommunicatorDestroyedException):
            return False
        if isinstance(error, HardwareFailedException) and self._may_be_late(actor):
            return False
        heard = self._tree.send_refusal(actor, printable(str(getattr(error, "what", error))))
        if heard:
            self._log.info("%s: %s", _place(actor), describe(error))
        return heard

    def failed(self, actor: Actor, error: Exception) -> None:
        """Handle an exception of user code; raises CycleEnded to end the cycle."""
        if isinstance(error, CommunicatorDestroyedException):
            raise CycleEnded from error  # the component has ended without this cycle
        location = locate(error, self._file)
        automata = [each.automaton for each in actor.chain()]
        message = explain(error, self._component, automata)[:_LONGEST_MESSAGE]
        if isinstance(error, UNAVAILABLE):
            self._wait(self._without_server, actor, location, message, "waiting for the server")
            raise CycleEnded from error
        if isinstance(error, CommandRefusedException) and self.on_refused is OnRefused.PAUSE:
            # A cycle may still run when the component pauses for a stop, which has said who ends that.
            until = "pauses already" if self._timeline.paused else "pauses until commands are accepted again"
            self._wait(self._refusals, actor, location, message, until)
            self._pause(Refusal(f"{_place(actor)}: {message}", error.holder, time.monotonic()))
            raise CycleEnded from error
        self._record(actor, location, message)
        place = f" at {location}" if location else ""
        self._log_seldom(actor, location, f"{_place(actor)}: {message}{place}", error)
        is_late = isinstance(error, HardwareFailedException) and self._may_be_late(actor)
        if isinstance(error, HardwareFailedException):
            self._hardware_failures[actor] = self._failures_before(actor) + 1, actor.cycle.count
        if self.on_error is OnError.STOP:
            if is_late:
                raise CycleEnded from error
            self._halt_for_error()
            raise CycleEnded from error

    def pauses_for(self, why: str) -> bool:
        """Return whether refused commands pause the component; if so, log why it pauses without one."""
        if self.on_refused is OnRefused.PAUSE:
            self._log.warning("%s; pauses until a person lets it go on", why)
            return True
        return False

    def crashed(self, actor: Actor, error: BaseException) -> None:
        """Log and remember, once, what ends the component, such as `sys.exit()` in user code."""
        if any(error is crash for crash in self._crashes):
            return
        self._crashes.append(error)
        try:
            self._report_crash(actor, error)
        finally:  # to log may run user code, too
            self._halt(exit_code_of(error) if isinstance(error, SystemExit) else 1)

    def succeeded(self, actor: Actor) -> None:
        """End the outages that a completed cycle has recovered from; report what Python only writes."""
        report_ignored()
        if self._hardware_failures and self._hardware_failures.get(actor, (0, -1))[1] != actor.cycle.count:
            self._hardware_failures.pop(actor, None)
        if self._refusals.waiting:
            with self._lock:
                seconds = self._refusals.recovered(actor)
                if seconds is not None:
                    self._log.warning("commands are accepted again: continuing after %.1f s", seconds)
        if self._without_server.waiting and self._servers_present():
            with self._lock:
                seconds = self._without_server.recovered(actor)
                if seconds is not None:
                    self._log.warning("the server is back after %.1f s", seconds)

    def left_early(self) -> None:
        """Stop everything since exit code failed, or does not run: nobody may stop it any more."""
        self._stop(self._component)

    def skipped(self, actor: Actor, transition: Transition) -> None:
        """Report the code of a transition that does not run."""
        name = transition.name or transition.id
        self._log.warning(
            "%s: the code of the transition %s does not run, since exit code before it ended the cycle",
            _place(actor),
            name,
        )

    def not_handed_over(self, actor: Actor, late: list[Actor]) -> None:
        """Report automata still in a cycle below a state that was left."""
        for child in late:
            message = sentence(
                f"still in a cycle {self.hand_over:g} s after {actor.automaton.name} left the state "
                f"{actor.current.name}: "
                "its code must not block, and others drive the robot with it until it ends"
            )
            self._record(child, "", message)
            self._log.error("%s: %s", _place(child), message)

    def note(self, actor: Actor, message: str) -> None:
        """Log and remember a problem of an automaton that is not an error of its code."""
        self._record(actor, "", message)
        self._log.warning("%s: %s", _place(actor), message)

    def thread_failed(self, location: str, message: str) -> None:
        """Handle an exception that has ended a thread which user code started.

        Nothing tries again what it did, whatever the exception is.
        """
        try:
            self.report(self._tree.root, location, message)
        finally:
            if self.on_error is OnError.STOP:
                self._halt_for_error()

    def may_pass(self, location: str, message: str, error: BaseException) -> bool:
        """Handle what a callback met and the next one need not meet, as in a cycle; false for all else."""
        is_refused = isinstance(error, CommandRefusedException) and self.on_refused is OnRefused.PAUSE
        if not (is_refused or isinstance(error, (*UNAVAILABLE, HardwareFailedException))):
            return False
        self.report(self._tree.root, location, message)
        if isinstance(error, CommandRefusedException):
            self._pause(Refusal(message, error.holder, time.monotonic()))
        return True

    def report(self, actor: Actor, location: str, message: str) -> None:
        """Log and remember an error that ends nothing."""
        self._record(actor, location, message[:_LONGEST_MESSAGE])
        place = f" at {location}" if location else ""
        self._log_seldom(actor, f"{location} {message}", f"{_place(actor)}: {message}{place}", None)

    def event_dropped(self, actor: Actor, event: Event, reason: DropReason) -> None:
        """Log a dropped event: a full queue is an error, other reasons are logged once for each place."""
        message = sentence(f"the event {event.name!r} is dropped: {reason}")
        if reason is DropReason.OVERFLOW:
            self._record(actor, "", message)
            self._log_seldom(actor, event.name, f"{_place(actor)}: {message}", None)
            return
        place = (actor.automaton.id, actor.current.id, f"{event.name}: {reason}")
        first = place not in self._dropped
        self._dropped.add(place)
        self._log.log(logging.INFO if first else logging.DEBUG, "%s: %s", _place(actor), message)

    def _report_crash(self, actor: Actor, error: BaseException) -> None:
        location = locate(error, self._file)
        place = f" at {location}" if location else ""
        if not isinstance(error, SystemExit):
            self._record(actor, location, describe(error)[:_LONGEST_MESSAGE])
            trace = type(error), error, part_of_component(error, self._file)
            self._log.critical("%s: its thread failed%s", _place(actor), place, exc_info=trace)
        elif exit_code_of(error) == 0:
            self._log.warning("%s: sys.exit() ends the component%s", _place(actor), place)
        else:
            what = f"sys.exit({short_repr(error.code)})"
            message = sentence(f"{what} ends the component; a final state would end it without an error")
            self._record(actor, location, message)
            self._log.error("%s: %s%s", _place(actor), message, place)

    def _halt_for_error(self) -> None:
        self.halted = True
        try:
            self._log.error("the component halts: its document does not say to go on after an error")
        finally:
            self._halt(1)

    def _may_be_late(self, actor: Actor) -> bool:
        """Return whether hardware fails in too few cycles in a row, with this one, for an error."""
        return self._failures_before(actor) + 1 < _HARDWARE_FAILURES

    def _failures_before(self, actor: Actor) -> int:
        """Return in how many cycles in a row, before this one, hardware failed."""
        failures, cycle = self._hardware_failures.get(actor, (0, -1))
        return failures - (cycle == actor.cycle.count)

    def _wait(self, outage: _Outage, actor: Actor, location: str, message: str, what: str) -> None:
        with self._lock:
            first = outage.add(actor)
        if first:
            self._record(actor, location, message)
            level = logging.WARNING if outage is self._refusals else logging.ERROR
            self._log.log(level, "%s: %s; %s", _place(actor), message, what)

    def _record(self, actor: Actor, location: str, message: str) -> None:
        at, place, text = self.now() / 1e9, encodable(location), encodable(message)  # the monitor sends them
        report = ErrorReport(at, actor.automaton.id, actor.current.id, place, text)
        with self._lock:
            self._records.append(report)

    def _log_seldom(self, actor: Actor, location: str, text: str, error: Exception | None) -> None:
        key = (actor.automaton.id, actor.current.id, location)
        now = time.monotonic()
        with self._lock:
            logged_at, repeated = self._logged.get(key, (float("-inf"), 0))
            if now - logged_at < _LOG_PERIOD:
                self._logged[key] = (logged_at, repeated + 1)
                return
            self._logged[key] = (now, 0)
        again = f" ({repeated} times more since it was last logged)" if repeated else ""
        trace = error and (type(error), error, part_of_component(error, self._file))
        self._log.error("%s%s", text, again, exc_info=trace)


def _place(actor: Actor) -> str:
    return f"{actor.automaton.name}/{actor.current.name}"
