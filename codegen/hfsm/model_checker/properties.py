"""Prove or refute the properties that a document states of its automata."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from ..document import Property
from .cones import cone_of
from .counterexample import Counterexample, counterexample
from .exclusion import may_hold
from .exploration import Budget, find_avoiding
from .expressions import ExpressionError, Holds, parse
from .fireability import Fireability
from .model import Model, nanoseconds
from .search import search
from .transition_system import TransitionSystem

__all__ = ["KINDS", "PropertyResult", "Verdict", "check_property"]

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


def check_property(
    model: Model, stated: Property, fireability: Fireability, budget: Budget
) -> PropertyResult:
    """Prove a property of all runs, or find one that violates it."""
    kind = stated.kind.strip()
    if kind not in KINDS:
        return _invalid(stated, f"a property is `always`, `eventually` or `never`, not `{kind[:40]}`")
    within = nanoseconds(stated.within)
    if within is None and not stated.within.is_blank:
        written = stated.within.text.strip()[:40]
        return _invalid(stated, f"`within` is a positive number of milliseconds, not `{written}`")
    try:
        expression = parse(stated.expression.text, model)
    except ExpressionError as error:
        return PropertyResult(stated, Verdict.INVALID, error=error)
    if not model.automata:
        return _invalid(stated, "there is no automaton")
    cone = cone_of(model, expression.automata or {0}, fireability)
    if kind == "eventually":
        system = TransitionSystem(model, cone, fireability)
        outcome = find_avoiding(system, expression.bind(system.position), within, budget)
    else:
        bad = kind == "never"
        if not may_hold(model, expression, bad, fireability):
            return PropertyResult(stated, Verdict.HOLDS)
        searched = search(
            model,
            cone,
            fireability,
            lambda positions: _has_value(expression.bind(positions), bad),
            budget=budget,
            within=within,
            goals=expression.states,
        )
        system, outcome = searched.system, searched.outcome
    verdict = Verdict.HOLDS if outcome.complete else Verdict.UNDECIDED
    found = None
    if outcome.run is not None:
        verdict, found = Verdict.VIOLATED, counterexample(model, system, outcome.run)
    return PropertyResult(stated, verdict, found, outcome.explored, outcome.until / 1e6)


def _has_value(holds: Holds, value: bool) -> Holds:
    return holds if value else lambda configuration: not holds(configuration)


def _invalid(stated: Property, problem: str) -> PropertyResult:
    return PropertyResult(stated, Verdict.INVALID, problem=problem)
