"""Build components from automata that are defined in a test."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import count
from typing import Any

from hfsm_runtime import Automaton, Component, State, Transition

Code = Callable[[], object]

_ids = count(1)

__all__ = ["Code", "after", "automaton", "component", "finished", "on", "when"]


def after(
    seconds: float, origin: int, destination: int, code: Code | None = None, *, name: str = "", **others: Any
) -> Transition:
    """Return a timed transition."""
    return Transition(name, origin, destination, id=next(_ids), seconds=seconds, code=code, **others)


def when(
    guard: Code, origin: int, destination: int, code: Code | None = None, *, name: str = "", **others: Any
) -> Transition:
    """Return a transition with a guard."""
    return Transition(name, origin, destination, id=next(_ids), guard=guard, code=code, **others)


def on(event: str, origin: int, destination: int, *, name: str = "", **others: Any) -> Transition:
    """Return a transition that fires at an event."""
    return Transition(name, origin, destination, id=next(_ids), event=event, **others)


def finished(origin: int, destination: int, *, name: str = "", **others: Any) -> Transition:
    """Return a transition that fires when the children of its origin have finished."""
    return Transition(name, origin, destination, id=next(_ids), finished=True, **others)


def automaton(
    id: int,
    name: str,
    states: Iterable[State],
    transitions: Iterable[Transition] = (),
    period: float = 0.1,
    **others: Any,
) -> Automaton:
    """Return an automaton whose first state is the initial one."""
    first, *rest = states
    return Automaton(
        id=id,
        name=name,
        period=period,
        states=(replace(first, initial=True), *rest),
        transitions=tuple(transitions),
        **others,
    )


def component(
    root: Automaton | Callable[[Component], Automaton], on_error: str = "stop", on_refused: str = "pause"
) -> Component:
    """Return a component with these automata; a function gets the component and returns its root.

    Unless it is a function, every event that the automata wait for may come from outside.
    """
    automata = root.tree() if isinstance(root, Automaton) else ()
    events = {event for each in automata for event in each.events}

    class Written(Component, document="written.xml", on_error=on_error, on_refused=on_refused, events=events):
        def automaton(self) -> Automaton:
            return root if isinstance(root, Automaton) else root(self)

    return Written()
