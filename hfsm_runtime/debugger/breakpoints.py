"""Breakpoints: where a component is to pause, and where it did."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from interfaces.hfsm import Breakpoint

from ..automaton import Transition
from ..errors import UnknownElementError, ValueTypeError
from ..tree import Run, Tree
from ..variables import cells_of, did_you_mean, values_of
from .expressions import Expression, ExpressionError, Members

__all__ = ["MOST", "Breakpoints", "Hit"]

MOST: Final = 1000
"""How many breakpoints a component takes."""

SELF: Final = "self"
"""The name through which conditions read the parameters of the component."""


@dataclass(frozen=True, slots=True)
class Hit:
    """A breakpoint that was reached; `trouble` tells why its condition had no value, if it had none."""

    breakpoint: Breakpoint
    trouble: str = ""


class Breakpoints:
    """The breakpoints of one component, and those at which it stands."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._all: tuple[Breakpoint, ...] = ()
        self._by_automaton: Mapping[int, tuple[tuple[Breakpoint, Expression | None], ...]] = {}
        self._stopped_at: dict[int, tuple[Breakpoint, ...]] = {}

    @property
    def all(self) -> tuple[Breakpoint, ...]:
        """All breakpoints, in the order in which they were set."""
        return self._all

    @property
    def stopped_at(self) -> tuple[Breakpoint, ...]:
        """The breakpoints that were reached by automata that have not gone on since."""
        with self._lock:
            return tuple(one for stopped in self._stopped_at.values() for one in stopped)

    def set(self, breakpoints: Iterable[Breakpoint], tree: Tree, parameters: Iterable[str] = ()) -> None:
        """Replace all breakpoints; none is replaced when one of them is wrong.

        Raises UnknownElementError for elements that the tree does not have, and ValueTypeError for conditions
        that are none, or use names that the automaton's code does not use.
        """
        found = tuple(breakpoints)
        if len(found) > MOST:
            raise ValueTypeError(f"there are {len(found)} breakpoints: at most {MOST} are allowed")
        found = tuple(one for index, one in enumerate(found) if one not in found[:index])
        known = tuple(parameters)
        checked = [(one, _check(one, tree, known)) for one in found]
        by_automaton: dict[int, tuple[tuple[Breakpoint, Expression | None], ...]] = {}
        for one, condition in checked:
            by_automaton[one.automaton] = (*by_automaton.get(one.automaton, ()), (one, condition))
        with self._lock:
            self._all, self._by_automaton = found, by_automaton

    def renew(self, tree: Tree, parameters: Iterable[str] = ()) -> list[str]:
        """Drop the breakpoints whose elements the automata do not have any more; say which, for people."""
        kept, told, known = [], [], tuple(parameters)
        for one in self._all:
            try:
                _check(one, tree, known)
            except (UnknownElementError, ValueTypeError) as error:
                told.append(f"a breakpoint is dropped: {error}")
            else:
                kept.append(one)
        self.set(kept, tree, known)
        with self._lock:
            for automaton, stopped in list(self._stopped_at.items()):
                self._stopped_at[automaton] = tuple(one for one in stopped if one in kept)
        return told

    def reached(self, run: Run, transition: Transition | None, parameters: Mapping[str, object]) -> list[Hit]:
        """Return the breakpoints at which an automaton stands that has entered its current state."""
        hits = []
        for one, condition in self._by_automaton.get(run.automaton.id, ()):
            here = one.state == run.current.id if one.state else transition is not None
            if here and (one.state or (transition is not None and one.transition == transition.id)):
                holds, trouble = _holds(condition, run, parameters)
                if holds:
                    hits.append(Hit(one, trouble))
        return hits

    def stop_at(self, run: Run, hits: Iterable[Hit]) -> None:
        """Remember where an automaton stands."""
        with self._lock:
            self._stopped_at[run.automaton.id] = tuple(hit.breakpoint for hit in hits)

    def go_on(self, automata: Iterable[int] | None = None) -> None:
        """Forget where some automata stood, by their ids, or all of them."""
        with self._lock:
            for automaton in list(self._stopped_at) if automata is None else automata:
                self._stopped_at.pop(automaton, None)


def _check(one: Breakpoint, tree: Tree, parameters: Iterable[str]) -> Expression | None:
    run = tree.run(one.automaton)
    if run is None:
        raise UnknownElementError(f"there is no automaton {one.automaton}")
    if (one.state == 0) == (one.transition == 0):
        raise ValueTypeError("a breakpoint is at a state or at a transition: one of the two is 0")
    label = f"automaton {one.automaton} ({run.automaton.name})"
    if one.state and all(state.id != one.state for state in run.automaton.states):
        raise UnknownElementError(f"{label} has no state {one.state}")
    if one.transition and all(t.id != one.transition for t in run.automaton.transitions):
        raise UnknownElementError(f"{label} has no transition {one.transition}")
    if not one.condition.strip():
        return None
    try:
        condition = Expression(one.condition)
    except ExpressionError as error:
        raise ValueTypeError(f"the condition of the breakpoint: {error}") from None
    known = {*cells_of(run.automaton), *([SELF] if any(True for _ in parameters) else [])}
    for name in sorted(condition.names - known):
        owners = [other.automaton for other in tree.runs if name in cells_of(other.automaton)]
        hint = f"; automaton {owners[0].id} ({owners[0].name}) does" if owners else did_you_mean(name, known)
        raise ValueTypeError(
            f"the condition of the breakpoint: column {condition.column_of(name)}: "
            f"the code of {label} uses no variable {name}{hint}"
        )
    return condition


def _holds(condition: Expression | None, run: Run, parameters: Mapping[str, object]) -> tuple[bool, str]:
    """Return whether a condition holds; one that has no value counts as one that does, and says why."""
    if condition is None:
        return True, ""
    try:
        return condition.holds({**values_of(run.automaton), SELF: Members(parameters)}), ""
    except ExpressionError as error:
        return True, f"the condition {condition.text!r} has no value: {error}"
