"""Debug a running component: breakpoints, single steps, variables, events, explanations, other versions."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, Final

import msgspec

from interfaces.hfsm import Breakpoint, Explanation

from ..automaton import Transition
from ..automaton_run import Run
from ..component import Component, parameter_values, parameters_of
from ..errors import ValueTypeError
from ..observer import Observer
from ..runtime import Runtime
from .breakpoints import Breakpoints
from .explanation import GuardLog, explain
from .expressions import plain
from .reload import Reloaded, Reloading

__all__ = ["Debugger"]

_LARGEST_VALUE: Final = 65_536
"""Bytes of JSON that are taken for a value."""
_LONGEST_NAME: Final = 200


class Debugger(Observer):
    """What others can do with a component beside running it; make it before the component starts.

    `connect` connects the proxies of a component that are not connected yet.
    """

    def __init__(self, runtime: Runtime, connect: Callable[[Component], None] = lambda _: None) -> None:
        self.runtime = runtime
        self.breakpoints = Breakpoints()
        self._guards = GuardLog()
        self._reloading = Reloading(runtime, connect)
        runtime.tree.observers += [self._guards, self]

    def entered(self, run: Run, transition: Transition | None) -> bool:
        """Pause at a breakpoint, on the automaton's thread."""
        runtime = self.runtime
        if not self.breakpoints.all or runtime.ended.is_set():
            return False
        hits = self.breakpoints.reached(run, transition, parameter_values(runtime.component))
        if hits:
            runtime.pause()
            self.breakpoints.stop_at(run, hits)
            for hit in hits:
                if hit.trouble:
                    runtime.note(run, hit.trouble)
        return bool(hits)

    def resume(self) -> None:
        """Go on after a pause."""
        with self.runtime.tree.lock:
            self.breakpoints.go_on()
            self.runtime.resume()

    def step(self, automaton: int) -> None:
        """Run one cycle of one automaton, or of all with 0, while paused. Raises UnknownElementError."""
        runs = self.runtime.tree.runs if automaton == 0 else (self.runtime.run(automaton),)
        self.breakpoints.go_on(run.automaton.id for run in runs)
        self.runtime.step(automaton)

    def set_breakpoints(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Replace all breakpoints; raises UnknownElementError and ValueTypeError, and then replaces none."""
        runtime = self.runtime
        with runtime.tree.lock:
            self.breakpoints.set(breakpoints, runtime.tree, parameters_of(runtime.component))

    def set_variable(self, automaton: int, name: str, text: str) -> None:
        """Set a variable of an automaton, or with 0 a parameter of the component, to a value in JSON.

        Raises UnknownElementError and ValueTypeError.
        """
        _check_name(name)
        self.runtime.set_variable(automaton, name, _read_json(text))

    def send_event(self, name: str, text: str) -> None:
        """Send an event, with data in JSON or empty, to every active automaton.

        Raises EventError and ValueTypeError.
        """
        _check_name(name)
        self.runtime.send(name, _read_json(text) if text else None)

    def explain(self, automaton: int) -> Explanation:
        """Say why an automaton is where it is; raises UnknownElementError."""
        runtime = self.runtime
        with runtime.tree.lock:
            return explain(runtime.tree, runtime.run(automaton), self._guards, runtime.timeline)

    def reload(self) -> Reloaded:
        """Replace the component by what its file holds now; raises ReloadRefusedError."""
        reloaded = self._reloading.reload()
        self._guards.clear()  # they were those of the former version
        runtime = self.runtime
        with runtime.tree.lock:
            dropped = self.breakpoints.renew(runtime.tree, parameters_of(runtime.component))
        return replace(reloaded, not_kept=(*reloaded.not_kept, *dropped))


def _read_json(text: str) -> Any:  # noqa: ANN401 - whatever JSON knows
    """Return a value that came over the network as JSON; raises ValueTypeError."""
    if len(text.encode()) > _LARGEST_VALUE:
        raise ValueTypeError(f"the value has more than {_LARGEST_VALUE} bytes")
    try:
        return plain(msgspec.json.decode(text.encode()))
    except (ValueError, RecursionError) as error:  # msgspec's own errors are ValueErrors
        raise ValueTypeError(f"the value is not JSON that can be taken: {error}") from None


def _check_name(name: str) -> None:
    if not name or len(name) > _LONGEST_NAME or not name.isprintable():
        raise ValueTypeError(f"a name has 1 to {_LONGEST_NAME} characters that can be seen")
