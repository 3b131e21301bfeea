"""Breakpoints: where a component is to pause, and where it has paused."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from interfaces.hfsm import Breakpoint
from zenoh_ice.data.text import sentence

from .._automaton import Transition
from .._component_run import ComponentRun
from .._variables import cells_of, did_you_mean, values_of
from ..component import parameter_values, parameters_of
from ..errors import UnknownElementError, ValueTypeError
from ..observer import Observer
from ..tree import Actor
from ._expressions import Expression, ExpressionError, Members

_MOST_BREAKPOINTS: Final = 1000
"""Largest number of breakpoints of a component."""
_SELF: Final = "self"
"""The name through which conditions read the parameters of the component."""


class Breakpoints(Observer):
    """The breakpoints of a component, and those at which it has paused; create it before the start."""

    def __init__(self, runtime: ComponentRun) -> None:
        self._runtime = runtime
        self._lock = runtime.tree.lock
        self._all: tuple[tuple[Breakpoint, Expression | None], ...] = ()
        self._stopped_at: dict[int, list[Breakpoint]] = {}
        runtime.tree.observers.append(self)

    @property
    def all(self) -> list[Breakpoint]:
        """All breakpoints, in the order in which they were set."""
        return [one for one, _ in self._all]

    @property
    def stopped_at(self) -> list[Breakpoint]:
        """The breakpoints that automata have reached without continuing since."""
        with self._lock:
            return [one for stopped in self._stopped_at.values() for one in stopped]

    def set(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Replace all breakpoints; none is replaced when one of them is wrong.

        Raises UnknownElementError for elements that the component does not have, and ValueTypeError for
        invalid conditions, or conditions with names that the automaton's code does not use.
        """
        found = list(breakpoints)
        if len(found) > _MOST_BREAKPOINTS:
            raise ValueTypeError(
                f"there are {len(found)} breakpoints: at most {_MOST_BREAKPOINTS} are allowed"
            )
        with self._lock:
            different = [one for index, one in enumerate(found) if one not in found[:index]]
            self._all = tuple((one, self._check(one)) for one in different)

    def renew(self) -> list[str]:
        """Drop the breakpoints of elements that are gone; return descriptions of them."""
        kept, dropped = [], []
        with self._lock:
            for one in self.all:
                try:
                    kept.append((one, self._check(one)))
                except (UnknownElementError, ValueTypeError) as error:
                    dropped.append(sentence(f"a breakpoint is dropped: {error}"))
            self._all = tuple(kept)
            for automaton, stopped in self._stopped_at.items():
                self._stopped_at[automaton] = [one for one in stopped if one in self.all]
        return dropped

    def entered(self, actor: Actor, transition: Transition | None) -> bool:
        """Pause at a breakpoint, on the automaton's thread."""
        if not self._all or self._runtime.ended.is_set():
            return False
        hits = [
            one
            for one, condition in self._all
            if one.automaton == actor.automaton.id
            and (
                one.state == actor.current.id if one.state else transition and one.transition == transition.id
            )
            and self._holds(condition, actor)
        ]
        if hits:
            self._runtime.pause()
            with self._lock:
                self._stopped_at[actor.automaton.id] = hits
        return bool(hits)

    def leave(self, actors: Iterable[Actor]) -> None:
        """Forget the positions of automata that continue."""
        with self._lock:
            for actor in actors:
                self._stopped_at.pop(actor.automaton.id, None)

    def _check(self, one: Breakpoint) -> Expression | None:
        actor = self._runtime.actor(one.automaton)
        if (one.state == 0) == (one.transition == 0):
            raise ValueTypeError("a breakpoint is at a state or at a transition: one of the two is 0")
        own = actor.automaton
        if one.state and all(state.id != one.state for state in own.states):
            raise UnknownElementError(sentence(f"automaton {own.id} ({own.name}) has no state {one.state}"))
        if one.transition and all(t.id != one.transition for t in own.transitions):
            raise UnknownElementError(
                sentence(f"automaton {own.id} ({own.name}) has no transition {one.transition}")
            )
        if not one.condition.strip():
            return None
        try:
            condition = Expression(one.condition)
        except ExpressionError as error:
            raise ValueTypeError(f"the condition of the breakpoint: {error}") from None
        known = {*cells_of(own), *([_SELF] if parameters_of(self._runtime.component) else [])}
        for name in sorted(condition.names - known):
            owners = [
                other.automaton for other in self._runtime.tree.actors if name in cells_of(other.automaton)
            ]
            hint = (
                f"; automaton {owners[0].id} ({owners[0].name}) does" if owners else did_you_mean(name, known)
            )
            raise ValueTypeError(
                f"the condition of the breakpoint: column {condition.column_of(name)}: "
                f"the code of automaton {own.id} ({own.name}) uses no variable {name}{hint}"
            )
        return condition

    def _holds(self, condition: Expression | None, actor: Actor) -> bool:
        """Return whether a condition holds; a condition without a value counts as true, and is reported."""
        if condition is None:
            return True
        parameters = Members(parameter_values(self._runtime.component))
        try:
            return condition.holds({**values_of(actor.automaton), _SELF: parameters})
        except ExpressionError as error:
            self._runtime.note(actor, sentence(f"the condition {condition.text!r} has no value: {error}"))
            return True
