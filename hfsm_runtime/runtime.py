"""A component that runs on threads: started, watched, steered and stopped here."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

from interfaces.hfsm import ComponentStatus, ErrorReport
from zenoh_ice.clock import Clock

from .automaton import Automaton
from .automaton_run import make_event
from .component import Component, equip, make_automata, parameters_of, source_of
from .errors import (
    ComponentStoppedError,
    OnError,
    OnRefused,
    ReloadRefusedError,
    UnknownElementError,
    ValueTypeError,
    exit_code_of,
)
from .marks import Mark, Marks
from .observer import Observer
from .source_map import locate_frame
from .supervision import Refusal, Supervision
from .threads import Threads
from .timeline import Timeline
from .tree import ChangeKind, Replaced, Run, Tree
from .variables import assign, convert, did_you_mean

_STOP_LIMIT: Final = 2.0
"""The longest wait in wall seconds for the running cycles when the component ends."""
_GAP: Final = 0.5
"""Wall seconds to wait for a moment without any cycle, in which the automata are replaced."""
_CYCLES_LIMIT: Final = 0.5
"""Wall seconds for running cycles to end if there is no such moment; meanwhile no other begins."""
_CYCLE_LIMIT: Final = 2.0
"""Wall seconds after which a cycle hangs, if its automaton has a short period."""
_HANGS_PERIODS: Final = 10
"""Periods after which the cycle of any other hangs."""
RETRY_DELAY: Final = 1.0
"""Wall seconds from a refused command until the automata may try again, and between two questions for it."""


class Runtime(Observer):
    """The life of a component: made, started, perhaps paused and resumed, and stopped once.

    Creating it runs the variables of the document; raises the exceptions of `make_automata`. `ended` is set
    when the component is to end: by an error, by `request_stop`, by its own code, or because the root has
    finished. `servers_present` returns whether the servants of the component's proxies can be reached, as far
    as is known.
    """

    def __init__(
        self,
        component: Component,
        clock: Clock,
        on_error: OnError | None = None,
        servers_present: Callable[[], bool] = lambda: True,
        *,
        on_refused: OnRefused | None = None,
    ) -> None:
        self.component = component
        self.reloads = 0
        """Number of reloads of the component."""
        self.ended = threading.Event()
        self.exit_code = 0
        """Why the component ended: 0 as it should, 1 by an error, or the code of `sys.exit` in user code."""
        self.refusal: Refusal | None = None
        """The refused command that pauses the component; None while it runs or is paused by a client."""
        self._asked: Refusal | None = None
        self._ask_at = 0.0
        self.clock = clock
        """The clock of the component."""
        self.speed = 0.0
        """Seconds of component time per wall second in a trial, where it can be changed; otherwise 0."""
        self.joints: Callable[[], dict[str, float]] = dict
        """Returns the joint angles in rad of a trial's fake robot; none outside a trial."""
        self.marks = Marks()
        """The component's marks on the pictures of its cameras."""
        equip(component, clock, self._sleep, self.send, self.mark)
        self.tree = self._make_tree(make_automata(component))
        self.timeline = self._make_timeline(clock)
        self._supervision = Supervision(
            self.tree,
            self.timeline,
            component,
            on_error,
            on_refused,
            halt=self._halt,
            refused=self._refused,
            servers_present=servers_present,
        )
        self._threads = Threads(self.tree, self.timeline, self._supervision, self._crashed)
        self.tree.observers.append(self)

    @property
    def name(self) -> str:
        """The name of the component."""
        return self.tree.root.automaton.name

    @property
    def status(self) -> ComponentStatus:
        """State of the component."""
        if self.ended.is_set():
            return ComponentStatus.Halted
        return ComponentStatus.Paused if self.timeline.paused else ComponentStatus.Running

    @property
    def errors(self) -> tuple[ErrorReport, ...]:
        """The newest errors, oldest first."""
        return self._supervision.records

    @property
    def failed(self) -> bool:
        """Whether an error ended the component."""
        return self.exit_code != 0

    @property
    def in_cycle(self) -> bool:
        """Whether a cycle is running at this moment."""
        return any(run.in_cycle for run in self.tree.runs)

    def hanging(self, run: Run) -> tuple[float, str]:
        """Return for how many wall seconds the cycle of an automaton hangs, and the line that it executes.

        The line is in the form of `locate`. Both are 0 and empty for a cycle that is not longer than 2 s and
        ten periods, or whose code sleeps by `self.sleep`, which ends when it must.
        """
        seconds = time.perf_counter() - run.began_wall
        if not run.in_cycle or seconds < max(_CYCLE_LIMIT, _HANGS_PERIODS * run.automaton.period):
            return 0.0, ""
        frame = self._threads.frame(run)
        if frame is None or not run.in_cycle:
            return 0.0, ""
        return seconds, locate_frame(frame, source_of(self.component))

    def begin_at(self, automaton: int, state: int) -> None:
        """Make a state, and those above it, the first ones to enter; call it before `start`.

        Raises UnknownElementError.
        """
        self.tree.begin_at(automaton, state)

    def start(self) -> None:
        """Start the automata."""
        self._threads.start()

    def request_stop(self) -> None:
        """Let no further cycle begin, and set `ended`; returns at once."""
        with self.tree.lock:
            self.tree.held = True
            self.ended.set()
        self._threads.wake()

    def stop(self) -> None:
        """End the automata: running cycles end, or are logged as errors after 2 s."""
        self.request_stop()
        for run in self._threads.stop(_STOP_LIMIT):
            self.component._hfsm_log.error(
                "the cycle of %s in the state %s did not end within %g s and is abandoned: "
                "its code must not block",
                run.automaton.name,
                run.current.name,
                _STOP_LIMIT,
            )

    def pause(self) -> None:
        """Let running cycles end, and start no others until `resume`."""
        with self.tree.lock:
            self.refusal = None
            self._threads.pause()

    def resume(self, after: Refusal | None = None) -> None:
        """Resume after a pause, or only after the pause for one refused command."""
        with self.tree.lock:
            if not self.ended.is_set() and (after is None or after is self.refusal):
                self.refusal = None
                self._threads.resume()

    def retry(self, commands_accepted: Callable[[str], bool]) -> None:
        """Resume after a refused command if commands are accepted again; call it often.

        `commands_accepted` is called with the reported holder of the robot: at once, to see why commands are
        refused, and then at most once a second. If commands are refused again, the component pauses again.
        """
        refusal = self.refusal
        if refusal is None:
            return
        first = self._asked is not refusal
        if not first and time.monotonic() < self._ask_at:
            return
        self._asked, self._ask_at = refusal, time.monotonic() + RETRY_DELAY
        if commands_accepted(refusal.holder) and not first:
            self.resume(refusal)

    def step(self, automaton: int) -> None:
        """Run one cycle of one automaton, or of all with 0, while paused. Raises UnknownElementError."""
        runs = self.tree.runs if automaton == 0 else (self.run(automaton),)
        if not self.ended.is_set():
            self._threads.step(runs)

    def force(self, automaton: int, transition: int) -> None:
        """Fire a transition in the next cycle of its automaton, whatever its guard returns.

        Raises UnknownElementError, also when the transition does not leave the current state.
        """
        run = self.run(automaton)
        found = next((each for each in run.automaton.transitions if each.id == transition), None)
        if found is None:
            raise UnknownElementError(f"automaton {automaton} has no transition {transition}")
        with self.tree.lock:
            if found.origin != run.current.id:
                origin = run.automaton.state(found.origin).name
                raise UnknownElementError(
                    f"the transition {found.name or transition} leaves the state {origin!r}, "
                    f"and {run.automaton.name} is in {run.current.name!r}"
                )
            run.forced = found

    def set_variable(self, automaton: int, name: str, value: object) -> None:
        """Set a variable of an automaton, or with 0 a parameter of the component.

        Raises UnknownElementError, and ValueTypeError for a value of the wrong type.
        """
        with self.tree.lock:
            if automaton:
                assign(self.run(automaton).automaton, name, value)
                return
            parameters = parameters_of(self.component)
            if name not in parameters:
                hint = did_you_mean(name, parameters)
                raise UnknownElementError(f"the component has no parameter {name!r}{hint}")
            wanted = type(parameters[name].default)
            setattr(self.component, name, convert(value, wanted, f"the parameter {name}"))

    def set_speed(self, speed: float) -> None:  # noqa: ARG002
        """Set the speed of time, in s per wall second. Raises ValueTypeError outside a trial."""
        raise ValueTypeError(f"{self.name} is no trial: it runs in the time of its robot")

    def replace(self, component: Component, runs: tuple[Run, ...], apply: Callable[[int], Replaced]) -> float:
        """Replace the component with another version of it, between two cycles.

        `runs` are its automata; `apply` puts them into the tree at a component time in ns. Returns the wall
        seconds in which no cycle could begin. Raises ReloadRefusedError when the component has ended, a
        cycle does not end within 1 s, or there are no threads for new automata.
        """
        joining = tuple(run for run in runs if self.tree.run(run.automaton.id) is None)
        leaving = joining
        try:
            self._threads.add(joining)
            with self.tree.lock:
                began = self._wait_for_gap()
                self.component = component
                leaving = apply(self.timeline.now()).gone
                self.reloads += 1
                self._supervision.turn_to(component)
                return time.perf_counter() - began
        finally:
            self._threads.remove(leaving)
            self._threads.wake()

    def _wait_for_gap(self) -> float:
        """Wait for a moment without any cycle; return the `perf_counter` since which none could begin.

        If there is no such moment in time, no cycle may begin until there is.
        """
        found, began = self.tree.wait_for_gap(_GAP), time.perf_counter()
        if not found:
            self.tree.held = True
            self._threads.wake()  # code that sleeps
            found = self.tree.wait_for_gap(_CYCLES_LIMIT)
            self.tree.held = self.ended.is_set() or self.timeline.paused
        if self.ended.is_set():
            raise ReloadRefusedError("the component has ended")
        if not found:
            run = next(run for run in self.tree.runs if run.in_cycle)
            raise ReloadRefusedError(
                f"the cycle of {run.automaton.name} in the state {run.current.name} "
                f"did not end within {_GAP + _CYCLES_LIMIT:g} s: its code must not block"
            )
        return began

    def _make_tree(self, root: Automaton) -> Tree:
        return Tree(root)

    def _make_timeline(self, clock: Clock) -> Timeline:
        return Timeline(clock)

    def send(self, name: str, data: object = None) -> None:
        """Send an event to every automaton that is active; raises EventError."""
        self.tree.send(make_event(name, data), self.timeline.now())

    def mark(self, mark: Mark) -> None:
        """Show a mark on the picture of a camera."""
        self.marks.add(mark, self.timeline.now())

    def run(self, automaton: int) -> Run:
        """Return an automaton by its id; raises UnknownElementError."""
        run = self.tree.run(automaton)
        if run is None:
            known = ", ".join(str(run.automaton.id) for run in self.tree.runs)
            raise UnknownElementError(f"there is no automaton {automaton}: there are {known}")
        return run

    def _sleep(self, seconds: float) -> None:
        if not self._threads.sleep(self.clock, seconds, self.ended):
            self.clock.wait(self.ended, max(0.0, seconds))
        if self.ended.is_set():
            raise ComponentStoppedError

    def note(self, run: Run, message: str) -> None:
        """Log and remember a problem of an automaton that is not an error of its code."""
        self._supervision.note(run, message)

    def changed(self, now: int, run: Run, kind: ChangeKind) -> None:  # noqa: ARG002
        """End the component when its root has finished."""
        if kind is ChangeKind.FINISHED and run is self.tree.root:
            self.request_stop()

    def _refused(self, refusal: Refusal) -> None:
        """Pause on the thread of the automaton whose command was refused, unless it is paused already."""
        with self.tree.lock:
            if not self.timeline.paused:
                self._threads.pause()
                self.refusal = refusal

    def _halt(self) -> None:
        self.exit_code = self.exit_code or 1
        self.request_stop()

    def _crashed(self, run: Run, error: BaseException) -> None:
        self._supervision.crashed(run, error)
        code = exit_code_of(error) if isinstance(error, SystemExit) else 1
        self.exit_code = self.exit_code or code
        self.request_stop()
