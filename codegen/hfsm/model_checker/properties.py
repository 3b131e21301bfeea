"""Prove or refute the properties that a document states of its automata.

Some need no search, because states exclude each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import islice
from typing import Final

from ..document import Property
from .counterexample import Counterexample, counterexample
from .exploration import Budget, find, find_avoiding
from .expressions import Expression, ExpressionError, parse
from .fireability import Fireability
from .model import StateModel, nanoseconds
from .transition_system import ACTIVE, FINISHED, Configuration, Local, TransitionSystem

__all__ = ["PropertyResult", "Verdict", "check_property"]

_MOST: Final = 20_000
"""Configurations to look at; of more nothing is said."""


def may_hold(expression: Expression, wanted: bool, fireability: Fireability) -> bool:
    """Return whether an expression may have a value, false only if it is certain that it never has.

    All is looked at that the tree of automata allows; one state stands for all that nobody asks for.
    """
    model = fireability.model
    above = {above.index for index in expression.automata for above, _ in model.ancestors(index)}
    looked_at = sorted({0, *expression.automata, *above})
    holds = expression.bind({index: position for position, index in enumerate(looked_at)})
    asked = {(model.automata[index].parent, model.automata[index].owner) for index in looked_at}
    asked |= expression.states

    def below(index: int, is_active: bool) -> Iterator[Configuration]:
        """Yield what an automaton and those below it may be like."""
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
        children = [child for child in looked_at if model.automata[child].parent == index]
        for local, state in locals_:
            for rest in under(children, state):
                yield local, *rest

    def under(children: list[int], state: StateModel | None) -> Iterator[Configuration]:
        """Yield what the automata below one may be like, which is active in a state, or not."""
        if not children:
            yield ()
            return
        owns = state is not None and children[0] in state.children and not state.final
        for is_active in (True, False) if state is not None and owns and state.owes else (owns,):
            for first in below(children[0], is_active):
                for rest in under(children[1:], state):
                    yield first + rest

    configurations = [*islice(below(0, is_active=True), _MOST + 1)]
    return len(configurations) > _MOST or any(holds(each) is wanted for each in configurations)


KINDS: Final = ("always", "eventually", "never")


class Verdict(StrEnum):
    """What is known of a property."""

    HOLDS = "holds"
    VIOLATED = "violated"
    UNDECIDED = "undecided"
    INVALID = "invalid"
    """It cannot be understood: see the error."""


@dataclass(frozen=True, slots=True)
class PropertyResult:
    """What became of a property. `explored` configurations were looked at, all of them up to `until_ms`."""

    property: Property
    verdict: Verdict
    counterexample: Counterexample | None = None
    explored: int = 0
    until_ms: float = 0.0
    error: ExpressionError | None = None
    problem: str = ""
    """What is wrong with its kind or its time."""


def check_property(stated: Property, fireability: Fireability, budget: Budget) -> PropertyResult:
    """Prove a property of all runs, or find one that violates it."""
    kind = stated.kind.strip()
    if kind not in KINDS:
        return _invalid(stated, f"a property is `always`, `eventually` or `never`, not `{kind[:40]}`")
    within = nanoseconds(stated.within)
    if within is None and not stated.within.is_blank:
        written = stated.within.text.strip()[:40]
        return _invalid(stated, f"`within` is a positive number of milliseconds, not `{written}`")
    try:
        expression = parse(stated.expression.text, fireability.model)
    except ExpressionError as error:
        return PropertyResult(stated, Verdict.INVALID, error=error)
    if not fireability.model.automata:
        return _invalid(stated, "there is no automaton")
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


def _invalid(stated: Property, problem: str) -> PropertyResult:
    return PropertyResult(stated, Verdict.INVALID, problem=problem)
