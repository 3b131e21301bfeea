"""A component at run time: its automata, its time, its errors, and what clients may do to it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from traceback import walk_stack
from types import FrameType
from typing import Final

from interfaces.hfsm import ComponentSnapshot, ComponentStatus, ErrorReport
from zenoh_ice.data.text import sentence
from zenoh_ice.threads.clock import Clock

from ._actor import make_event
from ._automaton import Automaton
from ._limits import LIMITS, RuntimeLimits
from ._marks import Mark, Marks
from ._own_threads import report_threads_of
from ._proofs import Proofs
from ._stop import begin_to_stop_robot
from ._supervision import Refusal, Supervision
from ._timeline import Timeline
from ._variables import assign, convert, did_you_mean
from .component import Component, equip, make_automata, parameters_of, source_of
from .errors import (
    OnError,
    OnRefused,
    ReloadRefusedError,
    UnknownElementError,
    ValueTypeError,
)
from .observer import Observer
from .places import locate_frame
from .tree import Actor, Replaced, Tree

_NOTHING: Final = nullcontext()
_HANGS_PERIODS: Final = 10
"""Periods after which the cycle of an automaton with a long period hangs."""


class _RootWatch(Observer):
    """Ends a component when its root has finished."""

    def __init__(self, component: ComponentRun) -> None:
        self._component = component

    def finished(self, actor: Actor) -> None:
        if actor is self._component.tree.root:
            self._component.request_stop()


class ComponentRun:
    """The life of a component: made, started, perhaps paused and resumed, and stopped once.

    What drives its cycles is in the subclasses: threads, or virtual time. All control is for any thread.

    Creating it runs the variables of the document; raises the exceptions of `make_automata`. `ended` is set
    when the component is to end: by an error, by `request_stop`, by its own code, or because the root has
    finished. `servers_present` returns whether the servants of the component's proxies can be reached, as far
    as is known. `timeline` is component time, by default on the clock, and `tree` makes the automata's tree.
    Its cycles are `ordered` if they run one at a time, in the order of their times.
    """

    def __init__(
        self,
        component: Component,
        clock: Clock,
        on_error: OnError | None = None,
        on_refused: OnRefused | None = None,
        *,
        servers_present: Callable[[], bool] = lambda: True,
        timeline: Timeline | None = None,
        tree: Callable[[Automaton], Tree] = Tree,
        ordered: bool = False,
        limits: RuntimeLimits = LIMITS,
    ) -> None:
        self._limits = limits
        self.component = component
        self.clock = clock
        """The clock of the component."""
        self.reloads = 0
        """Number of reloads of the component."""
        self.ended = threading.Event()
        self.exit_code = 0
        """Why the component ended: 0 as it should, 1 by an error, or the code of `sys.exit` in user code."""
        self.refusal: Refusal | None = None
        """The refused command that pauses the component; None while it runs or is paused by a client."""
        self.on_resumed: Callable[[], object] = lambda: None
        """Called when a person lets the component go on after a pause, before it does."""
        self.speed = 0.0
        """Seconds of component time per wall second in a dry run, where it can be changed; otherwise 0."""
        self.joints: Callable[[], dict[str, float]] = dict
        """Returns the joint angles in rad of a dry run's fake robot; none outside a dry run."""
        self.record_snapshot: Callable[[ComponentSnapshot], object] | None = None
        """Takes what the monitor shows, in a run that is recorded."""
        self.marks = Marks()
        """The component's marks on the pictures of its cameras."""
        equip(component, clock, self._sleep, self.send_by_code, self.mark)
        self.tree = tree(make_automata(component))
        self.component_time = timeline or Timeline(clock, limits.paused)
        """The time of the component in ns."""
        self._supervision = Supervision(
            self.tree,
            self.component_time,
            component,
            on_error,
            on_refused,
            halt=self._halt,
            pause=self._pause_after,
            stop=begin_to_stop_robot,
            servers_present=servers_present,
            hand_over=limits.hand_over,
        )
        self.tree.observers.append(_RootWatch(self))
        self.proofs = Proofs(component, self.tree, self._supervision, self.ended, ordered=ordered)
        """The check, while it runs, of all that proofs about the document rely on."""
        report_threads_of(self)
        self._prepare()

    @property
    def name(self) -> str:
        """The name of the component."""
        return self.tree.root.automaton.name

    @property
    def status(self) -> ComponentStatus:
        """State of the component."""
        if self.ended.is_set():
            return ComponentStatus.Halted
        return ComponentStatus.Paused if self.component_time.paused else ComponentStatus.Running

    @property
    def paused_by_client(self) -> bool:
        """Whether a client, or a breakpoint, pauses the component, not a refused command."""
        with self.tree.lock:
            return self.component_time.paused and self.refusal is None

    @property
    def errors(self) -> tuple[ErrorReport, ...]:
        """The errors, oldest first: the newest 10,000."""
        return self._supervision.records

    @property
    def failed(self) -> bool:
        """Whether an error ended the component."""
        return self.exit_code != 0

    @property
    def in_cycle(self) -> bool:
        """Whether a cycle is running at this moment."""
        return any(actor.in_cycle for actor in self.tree.actors)

    def hanging(self, actor: Actor) -> tuple[float, str]:
        """Return for how many wall seconds the cycle of an automaton hangs, and the line that it executes.

        The line is in the form of `locate`. Both are 0 and empty for a cycle that is not longer than 2 s and
        ten periods, or whose code sleeps by `self.sleep`, which ends when it must.
        """
        seconds = time.perf_counter() - actor.cycle.began_wall
        if not actor.in_cycle or seconds < max(self._limits.hangs, _HANGS_PERIODS * actor.automaton.period):
            return 0.0, ""
        frame = self._frame(actor)
        if frame is None or not actor.in_cycle:
            return 0.0, ""
        return seconds, locate_frame(frame, source_of(self.component))

    def look_at_cycles(self) -> None:
        """Report cycles that hang and must not, by what proofs rely on; call it often.

        Calls of servants may: proofs take them to end.
        """
        for actor in self.tree.actors:
            seconds, where = self.hanging(actor)
            frame = self._frame(actor) if seconds else None
            modules = (
                () if frame is None else (each.f_globals.get("__name__") for each, _ in walk_stack(frame))
            )
            if seconds and not any(f"{each}".startswith("zenoh_ice.") for each in modules):
                self.proofs.hangs(actor, where)

    def begin_at(self, automaton: int, state: int) -> None:
        """Make a state, and those above it, the first ones to enter; call it before `start`.

        Raises UnknownElementError.
        """
        with self.action("begin_at", automaton=automaton, state=state):
            self.proofs.doubt()
            self.tree.begin_at(automaton, state)

    def start(self) -> None:
        """Start the automata."""
        raise NotImplementedError

    def request_stop(self) -> None:
        """Let no further cycle begin, and set `ended`; returns at once."""
        with self.tree.lock:
            self.tree.held = True
            self.ended.set()
        self._wake()

    def stop(self) -> None:
        """End the automata: running cycles end, or are logged as errors when they do not in time."""
        self.request_stop()

    def pause(self) -> None:
        """Let running cycles end, and start no others until `resume`."""
        with self.action("pause"), self.tree.lock:
            self.refusal = None
            self._hold()

    def resume(self, after: Refusal | None = None) -> None:
        """Resume after a pause, or only after the pause for one refused command."""
        if after is None:
            self.on_resumed()
        with self.action("resume"), self.tree.lock:
            if self.ended.is_set() or not (after is None or after is self.refusal):
                return
            self.refusal = None
            self.component_time.resume()
            self.tree.held = False
        self._wake()

    def pause_for(self, why: str) -> None:
        """Pause as after a refused command, if that pauses the component; `why` is for people."""
        with self.tree.lock:
            if not self.component_time.paused and self._supervision.pauses_for(why):
                self._pause_after(Refusal(why, "", time.monotonic()))

    def retry(self, commands_accepted: Callable[[str], bool]) -> None:
        """Resume after a refused command if commands are accepted again; call it often.

        `commands_accepted` is called with the reported holder of the robot. In virtual time the automata try
        again as time passes.
        """

    def step(self, automaton: int) -> None:
        """Run one cycle of one automaton, or of all with 0, while paused. Raises UnknownElementError.

        Ghosts run none. Component time moves on by the shortest period.
        """
        with self.action("step", automaton=automaton):  # without the cycles
            actors = self.tree.actors if automaton == 0 else (self.actor(automaton),)
        if not self.ended.is_set():
            self._step(actors)

    def force(self, automaton: int, transition: int) -> None:
        """Fire a transition in the next cycle of its automaton, whatever its guard returns.

        Raises UnknownElementError, also when the transition does not leave the current state.
        """
        with self.action("force", automaton=automaton, transition=transition), self.tree.lock:
            actor = self.actor(automaton)
            found = next((each for each in actor.automaton.transitions if each.id == transition), None)
            if found is None:
                raise UnknownElementError(f"automaton {automaton} has no transition {transition}")
            if found.origin != actor.current.id:
                origin = actor.automaton.state(found.origin).name
                raise UnknownElementError(
                    f"the transition {found.name or transition} leaves the state {origin!r}, "
                    f"and {actor.automaton.name} is in {actor.current.name!r}"
                )
            self.proofs.doubt()
            actor.forced = found

    def set_variable(self, automaton: int, name: str, value: object) -> None:
        """Set a variable of an automaton, or with 0 a parameter of the component.

        Raises UnknownElementError, and ValueTypeError for a value of the wrong type.
        """
        with self.action("set", automaton=automaton, name=name, value=value), self.tree.lock:
            self.proofs.doubt(values=True)
            if automaton:
                assign(self.actor(automaton).automaton, name, value)
                return
            parameters = parameters_of(self.component)
            if name not in parameters:
                hint = did_you_mean(name, parameters)
                raise UnknownElementError(f"the component has no parameter {name!r}{hint}")
            wanted = type(parameters[name].default)
            setattr(self.component, name, convert(value, wanted, f"the parameter {name}"))

    def set_speed(self, speed: float) -> None:  # noqa: ARG002
        """Set the speed of time, in s per wall second. Raises ValueTypeError outside a dry run."""
        raise ValueTypeError(f"{self.name} is no dry run: it runs in the time of its robot")

    def replace(
        self,
        component: Component,
        actors: tuple[Actor, ...],  # noqa: ARG002 - a subclass may have something to do for each
        apply: Callable[[int], Replaced],
    ) -> float:
        """Replace the component with another version of it, between two cycles.

        `actors` are its automata; `apply` puts them into the tree at a component time in ns. Returns the wall
        seconds in which no cycle could begin. Raises ReloadRefusedError when the component has ended, or a
        cycle does not end within 1 s.
        """
        with self.tree.lock:
            began = self._wait_for_gap()
            self.component = component
            self.proofs.doubt(values=True)
            apply(self.component_time.now())
            self.reloads += 1
            self._supervision.turn_to(component)
            return time.perf_counter() - began

    def send(self, name: str, data: object = None) -> None:
        """Send an event from outside to every automaton that is active; raises EventError."""
        with self.action("send", name=name, value=data):
            event = make_event(name, data)
            self.proofs.arrives(name)
            self.tree.send(event, self.component_time.now())

    def send_by_code(self, name: str, data: object = None) -> None:
        """Send an event for the code of the document, as `send` does for others."""
        with self.action("send", name=name, value=data):
            event = make_event(name, data)
            self.proofs.sent(name, self._actor_here())
            self.tree.send(event, self.component_time.now())

    def mark(self, mark: Mark) -> None:
        """Show a mark on the picture of a camera."""
        self.marks.add(mark, self.component_time.now())

    def action(self, kind: str, **arguments: object) -> AbstractContextManager[None]:  # noqa: ARG002
        """Return the context of what a client, or user code, does to the component; a recording keeps it."""
        return _NOTHING

    def actor(self, automaton: int) -> Actor:
        """Return an automaton by its id; raises UnknownElementError."""
        actor = self.tree.actor(automaton)
        if actor is None:
            known = ", ".join(str(actor.automaton.id) for actor in self.tree.actors)
            raise UnknownElementError(sentence(f"there is no automaton {automaton}: there are {known}"))
        return actor

    def note(self, actor: Actor, message: str) -> None:
        """Log and remember a problem of an automaton that is not an error of its code."""
        self._supervision.note(actor, message)

    def thread_failed(self, location: str, message: str) -> None:
        """Handle an exception that has ended a thread of user code, unless it has ended before."""
        if not self.ended.is_set():
            self._supervision.thread_failed(location, message)

    def callback_failed(self, location: str, message: str, error: BaseException) -> None:
        """Handle what a callback of user code has raised: an error as on a thread, unless it may pass."""
        if not (self.ended.is_set() or self._supervision.may_pass(location, message, error)):
            self.thread_failed(location, message)

    def _wait_for_gap(self) -> float:
        """Wait for a moment without any cycle; return the `perf_counter` since which none could begin.

        If there is no such moment in time, no cycle may begin until there is.
        """
        gap = self._limits.gap
        found, began = self.tree.wait_for_gap(gap), time.perf_counter()
        if not found:
            self.tree.held = True
            self._wake()  # code that sleeps
            found = self.tree.wait_for_gap(gap)
            self.tree.held = self.ended.is_set() or self.component_time.paused
        if self.ended.is_set():
            raise ReloadRefusedError("the component has ended")
        if not found:
            actor, limit = next(actor for actor in self.tree.actors if actor.in_cycle), 2 * gap
            raise ReloadRefusedError(
                sentence(
                    f"the cycle of {actor.automaton.name} in the state {actor.current.name} "
                    f"did not end within {limit:g} s: its code must not block"
                )
            )
        return began

    def _hold(self) -> None:
        """Let no cycle begin, and component time stand still; with the lock of the tree."""
        self.proofs.doubt()
        self.tree.held = True
        self.component_time.pause()
        self._wake()  # code that sleeps

    def _pause_after(self, refusal: Refusal) -> None:
        """Pause on the thread of the automaton whose command was refused, unless it is paused already."""
        with self.tree.lock:
            if not self.component_time.paused:
                self._hold()
                self.refusal = refusal

    def _abandon(self, actor: Actor, seconds: float) -> None:
        """Report a cycle that did not end when the component did, and the line that it executes."""
        frame = self._frame(actor)
        place = "" if frame is None else f" at {locate_frame(frame, source_of(self.component))}"
        what = sentence(
            f"its cycle did not end within {seconds:g} s and is abandoned: its code must not block"
        )
        self.component._hfsm_log.error("%s/%s: %s%s", actor.automaton.name, actor.current.name, what, place)

    def _prepare(self) -> None:
        """Make what drives the automata, which are made."""

    def _halt(self, exit_code: int) -> None:
        self.exit_code = self.exit_code or exit_code
        self.request_stop()

    def _sleep(self, seconds: float) -> None:
        """Wait on behalf of user code."""
        raise NotImplementedError

    def _step(self, actors: tuple[Actor, ...]) -> None:
        """Run one cycle of each automaton that is no ghost, in this order, while paused."""
        raise NotImplementedError

    def _actor_here(self) -> Actor | None:
        """Return the automaton whose cycle runs here; None outside of cycles, as on threads of user code."""
        raise NotImplementedError

    def _frame(self, actor: Actor) -> FrameType | None:  # noqa: ARG002
        """Return what the cycle of an automaton executes now; None where that is unknown, or it sleeps."""
        return None

    def _wake(self) -> None:
        """Make whatever waits check for changes."""
