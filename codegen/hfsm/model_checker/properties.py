"""Prove or refute the properties that a document states about its automata.

Properties of states that exclude each other need no search.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import islice
from typing import Final

from ...messages import NO_MESSAGE, Message
from ..document import Property
from ._counterexample import Counterexample, counterexample
from ._exploration import Budget, find, find_avoiding
from ._fireability import Fireability
from .expressions import Expression, ExpressionError, parse
from .model import StateModel, nanoseconds
from .transition_system import ACTIVE, FINISHED, Configuration, Local, TransitionSystem

_MOST_CONFIGURATIONS: Final = 20_000
"""The most configurations to enumerate; with more, the search decides."""


def may_hold(expression: Expression, wanted: bool, fireability: Fireability) -> bool:
    """Return whether an expression may have a value; False only if it certainly never has.

    This enumerates what the tree of automata allows. One state represents all that the expression ignores.
    """
    model = fireability.model
    above = {above.index for index in expression.automata for above, _ in model.ancestors(index)}
    automata = sorted({0, *expression.automata, *above})
    holds = expression.bind({index: position for position, index in enumerate(automata)})
    asked = {(model.automata[index].parent, model.automata[index].owner) for index in automata}
    asked |= expression.states

    def below(index: int, is_active: bool) -> Iterator[Configuration]:
        """Yield the possible locals of an automaton and those below it."""
        automaton = model.automata[index]
        possible = [automaton.states[state] for state in sorted(fireability.states[index])]
        others = {state.final: state for state in possible if (index, state.index) not in asked}
        shown = [*(state for state in possible if (index, state.index) in asked), *others.values()]
        locals_: list[tuple[Local, StateModel | None]] = []
        if is_active:
            locals_ += [((state.index, ACTIVE, 0), state) for state in shown]
            locals_ += [((state.index, ACTIVE | FINISHED, 0), state) for state in shown if state.final]
        else:
            locals_.append(((automaton.initial, 0, 0), None))
            locals_ += [((state.index, FINISHED, 0), None) for state in shown if state.final]
        children = [child for child in automata if model.automata[child].parent == index]
        for local, state in locals_:
            for rest in under(children, state):
                yield local, *rest

    def under(children: list[int], state: StateModel | None) -> Iterator[Configuration]:
        """Yield the possible locals of automata below one that is active in a state, or not active."""
        if not children:
            yield ()
            return
        owns = state is not None and children[0] in state.children and not state.final
        may_sleep = state is not None and owns and (state.owes or model.slow)
        for is_active in (True, False) if may_sleep else (owns,):
            for first in below(children[0], is_active):
                for rest in under(children[1:], state):
                    yield first + rest

    configurations = [*islice(below(0, is_active=True), _MOST_CONFIGURATIONS + 1)]
    return len(configurations) > _MOST_CONFIGURATIONS or any(holds(each) is wanted for each in configurations)


KINDS: Final = ("always", "eventually", "never")


class Verdict(StrEnum):
    """The verdict on a property."""

    HOLDS = "holds"
    VIOLATED = "violated"
    UNDECIDED = "undecided"
    INVALID = "invalid"
    """It is not valid: see the error."""


@dataclass(frozen=True, slots=True)
class PropertyResult:
    """The result of a property: `explored` configurations were seen, all of them up to `until_ms`."""

    property: Property
    verdict: Verdict
    counterexample: Counterexample | None = None
    explored: int = 0
    until_ms: float = 0.0
    error: ExpressionError | None = None
    problem: Message = NO_MESSAGE
    """The error in its kind or its time."""


def check_property(stated: Property, fireability: Fireability, budget: Budget) -> PropertyResult:
    """Prove a property for all runs, or find a run that violates it."""
    kind = stated.kind.strip()
    if kind not in KINDS:
        message = Message(
            "a property must be `always`, `eventually` or `never`, not `{kind}`", kind=kind[:40]
        )
        return _invalid(stated, message)
    within = nanoseconds(stated.within)
    if within is None and not stated.within.is_blank:
        written = stated.within.text.strip()[:40]
        message = Message(
            "`within` must be a positive number of milliseconds, not `{written}`", written=written
        )
        return _invalid(stated, message)
    try:
        expression = parse(stated.expression.text, fireability.model)
    except ExpressionError as error:
        return PropertyResult(stated, Verdict.INVALID, error=error)
    if not fireability.model.automata:
        return _invalid(stated, Message("there is no automaton"))
    system = TransitionSystem(expression.automata or {0}, fireability)
    holds = expression.bind(system.position)
    if kind == "eventually":
        outcome = find_avoiding(system, holds, budget, within)
    else:
        bad = kind == "never"
        if not may_hold(expression, bad, fireability):
            return PropertyResult(stated, Verdict.HOLDS)
        outcome = find(
            system, lambda each: holds(each) is bad, budget, within=within, watched=expression.automata
        )
    verdict = Verdict.HOLDS if outcome.complete else Verdict.UNDECIDED
    found = None
    if outcome.run is not None:
        verdict, found = Verdict.VIOLATED, counterexample(outcome.run)
    return PropertyResult(stated, verdict, found, outcome.explored, outcome.until / 1e6)


def _invalid(stated: Property, problem: Message) -> PropertyResult:
    return PropertyResult(stated, Verdict.INVALID, problem=problem)
