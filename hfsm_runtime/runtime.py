"""A component that runs on threads: started, watched, steered and stopped here."""

from __future__ import annotations

import threading
from collections.abc import Callable
from enum import StrEnum
from typing import Final

from zenoh_ice.clock import Clock

from .automaton import Transition
from .component import Component, make_automata, source_of
from .errors import ComponentError, ComponentStoppedError
from .supervision import ErrorRecord, OnError, Supervision
from .threads import Threads
from .timeline import Timeline
from .tree import Run, Tree

__all__ = ["Runtime", "Status", "UnknownElementError"]

_STOP: Final = 2.0
"""The longest wait in wall seconds for the running cycles when the component ends."""


class Status(StrEnum):
    """What a component is doing."""

    RUNNING = "running"
    PAUSED = "paused"
    HALTED = "halted"


class UnknownElementError(ComponentError):
    """A request names an automaton or a transition that the component does not have, or not now."""


class Runtime:
    """The life of a component: made, started, perhaps paused and resumed, and stopped once.

    Making it runs the variables of the document; raises what `make_automata` does. `ended` is set when the
    component is to end: by an error, by `request_stop`, or by its own code. `servers_present` tells whether
    the servants of the component's proxies can be reached, as far as is known.
    """

    def __init__(
        self,
        component: Component,
        clock: Clock,
        on_error: OnError | None = None,
        servers_present: Callable[[], bool] = lambda: True,
    ) -> None:
        self.component = component
        self.ended = threading.Event()
        self.failed = False
        """Whether an error ended the component."""
        component.clock = clock
        vars(component)["sleep"] = self._sleep
        self.tree = Tree(make_automata(component))
        self.timeline = Timeline(clock)
        self._supervision = Supervision(
            self.tree,
            self.timeline,
            component.log,
            on_error=on_error or component._hfsm_on_error,
            file=source_of(component),
            document=component._hfsm_document,
            halt=self._halt,
            servers_present=servers_present,
        )
        self._threads = Threads(self.tree, self.timeline, self._supervision, self._crashed)

    @property
    def name(self) -> str:
        """The name of the component."""
        return self.tree.root.automaton.name

    @property
    def status(self) -> Status:
        """What the component is doing."""
        if self.ended.is_set():
            return Status.HALTED
        return Status.PAUSED if self.timeline.paused else Status.RUNNING

    @property
    def errors(self) -> tuple[ErrorRecord, ...]:
        """The newest errors, oldest first."""
        return self._supervision.records

    @property
    def in_cycle(self) -> bool:
        """Whether a cycle is running at this moment."""
        return any(run.in_cycle for run in self.tree.runs)

    def start(self) -> None:
        """Start the automata."""
        self._threads.start()

    def request_stop(self) -> None:
        """Let no further cycle begin and tell `ended`; returns at once."""
        with self.tree.lock:
            self.tree.held = True
            self.ended.set()
        self._threads.wake()

    def stop(self) -> None:
        """End the automata: running cycles end, or are told as errors after 2 s."""
        self.request_stop()
        for run in self._threads.stop(_STOP):
            self.component.log.error(
                "the cycle of %s in the state %s did not end within %g s and is abandoned: "
                "its code must not block",
                run.automaton.name,
                run.current.name,
                _STOP,
            )

    def pause(self) -> None:
        """Let running cycles end and start none."""
        self._threads.pause()

    def resume(self) -> None:
        """Go on after a pause."""
        with self.tree.lock:
            if not self.ended.is_set():
                self._threads.resume()

    def step(self, automaton: int) -> None:
        """Run one cycle of one automaton, or of all with 0, while paused. Raises UnknownElementError."""
        runs = self.tree.runs if automaton == 0 else (self._run(automaton),)
        if not self.ended.is_set():
            self._threads.step(runs)

    def force(self, automaton: int, transition: int) -> None:
        """Fire a transition at the next cycle of its automaton, whatever its guard says.

        Raises UnknownElementError, also when the transition does not leave the current state.
        """
        run = self._run(automaton)
        found = _transition(run, transition)
        with self.tree.lock:
            if found.origin != run.current.id:
                origin = run.automaton.state(found.origin).name
                raise UnknownElementError(
                    f"transition {transition} leaves the state {origin!r}, "
                    f"and automaton {automaton} is in {run.current.name!r}"
                )
            run.forced = found

    def _run(self, automaton: int) -> Run:
        run = self.tree.run(automaton)
        if run is None:
            known = ", ".join(str(run.automaton.id) for run in self.tree.runs)
            raise UnknownElementError(f"there is no automaton {automaton}: there are {known}")
        return run

    def _sleep(self, seconds: float) -> None:
        self.component.clock.wait(self.ended, max(0.0, seconds))
        if self.ended.is_set():
            raise ComponentStoppedError

    def _halt(self) -> None:
        self.failed = True
        self.request_stop()

    def _crashed(self, run: Run, error: BaseException) -> None:
        if isinstance(error, SystemExit):
            self.failed = self.failed or error.code not in (None, 0)
            self.component.log.warning("the code of %s ends the component", run.automaton.name)
        else:
            self.failed = True
            self.component.log.critical("the thread of %s failed", run.automaton.name, exc_info=error)
        self.request_stop()


def _transition(run: Run, id: int) -> Transition:
    for transition in run.automaton.transitions:
        if transition.id == id:
            return transition
    raise UnknownElementError(f"automaton {run.automaton.id} has no transition {id}")
