"""The structure of automata: what a generated component returns, and nothing that changes while it runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

from .errors import DefinitionError

__all__ = ["Automaton", "State", "Transition"]


@dataclass(frozen=True, kw_only=True)
class State:
    """A state: `code` runs once a cycle while it is the current one; it may own automata, its children."""

    id: int
    name: str
    initial: bool = False
    code: Callable[[], object] | None = None
    children: tuple[Automaton, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Transition:
    """A transition from the state `origin` to the state `destination`, both ids.

    It fires `seconds` of active time after the entry into its origin, or when `guard` returns something
    true; `condition` is the guard as text. `code` runs after the change of state.
    """

    id: int
    name: str = ""
    origin: int
    destination: int
    seconds: float | None = None
    guard: Callable[[], object] | None = None
    condition: str = ""
    code: Callable[[], object] | None = None

    @cached_property
    def delay(self) -> int | None:
        """The time after which it fires in ns, None for one with a guard."""
        return None if self.seconds is None else round(self.seconds * 1e9)


@dataclass(frozen=True, kw_only=True)
class Automaton:
    """An automaton; `period` is the time between its cycles in s. Raises DefinitionError."""

    id: int
    name: str
    period: float = 0.1
    states: tuple[State, ...]
    transitions: tuple[Transition, ...] = ()
    _by_id: dict[int, State] = field(init=False, repr=False, compare=False)
    _outgoing: dict[int, tuple[Transition, ...]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        by_id = {state.id: state for state in self.states}
        object.__setattr__(self, "_by_id", by_id)
        outgoing = {
            origin: tuple(transition for transition in self.transitions if transition.origin == origin)
            for origin in by_id
        }
        object.__setattr__(self, "_outgoing", outgoing)
        self._check()

    @cached_property
    def initial(self) -> State:
        """The state in which it starts."""
        return next(state for state in self.states if state.initial)

    @cached_property
    def interval(self) -> int:
        """The time between its cycles in ns."""
        return round(self.period * 1e9)

    def state(self, id: int) -> State:
        """Return the state with this id; raises KeyError."""
        return self._by_id[id]

    def outgoing(self, state: State) -> tuple[Transition, ...]:
        """Return the transitions out of a state, in the order in which they are tried."""
        return self._outgoing[state.id]

    def tree(self) -> Iterator[Automaton]:
        """Yield this automaton and all below it, each before its children."""
        yield self
        for state in self.states:
            for child in state.children:
                yield from child.tree()

    def _check(self) -> None:
        label = f"automaton {self.id} ({self.name!r})"
        if len(self._by_id) != len(self.states):
            raise DefinitionError(f"{label} has two states with one id")
        if sum(state.initial for state in self.states) != 1:
            raise DefinitionError(f"{label} needs exactly one initial state")
        if not _positive(self.period):
            raise DefinitionError(f"{label} has the period {self.period}: it is a positive number of seconds")
        for transition in self.transitions:
            what = f"transition {transition.id} ({transition.name!r}) of {label}"
            if not {transition.origin, transition.destination} <= self._by_id.keys():
                raise DefinitionError(f"{what} joins states that do not exist")
            if (transition.seconds is None) == (transition.guard is None):
                raise DefinitionError(f"{what} needs either a time or a guard")
            if transition.seconds is not None and not _positive(transition.seconds):
                raise DefinitionError(f"{what} fires after {transition.seconds} s: it is a positive number")


def _positive(seconds: float) -> bool:
    return math.isfinite(seconds) and round(seconds * 1e9) >= 1
