"""Build components from automata written down in a test."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import count

from hfsm_runtime import Automaton, Component, State, Transition

_ids = count(1)

__all__ = ["after", "automaton", "component", "when"]


def after(
    seconds: float, origin: int, destination: int, code: Callable[[], object] | None = None
) -> Transition:
    """Return a timed transition."""
    return Transition(id=next(_ids), origin=origin, destination=destination, seconds=seconds, code=code)


def when(
    guard: Callable[[], object], origin: int, destination: int, code: Callable[[], object] | None = None
) -> Transition:
    """Return a transition with a guard."""
    return Transition(id=next(_ids), origin=origin, destination=destination, guard=guard, code=code)


def automaton(
    id: int, name: str, states: Iterable[State], transitions: Iterable[Transition] = (), period: float = 0.1
) -> Automaton:
    """Return an automaton whose first state is the initial one."""
    found = tuple(states)
    first = State(
        id=found[0].id, name=found[0].name, initial=True, code=found[0].code, children=found[0].children
    )
    return Automaton(
        id=id, name=name, period=period, states=(first, *found[1:]), transitions=tuple(transitions)
    )


def component(root: Automaton | Callable[[Component], Automaton], on_error: str = "stop") -> Component:
    """Return a component with these automata; a function gets the component and returns its root."""

    class Written(Component, document="written.xml", on_error=on_error):
        def automaton(self) -> Automaton:
            return root if isinstance(root, Automaton) else root(self)

    return Written()
