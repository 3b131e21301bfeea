"""Prove or refute the properties that a document states of its automata.

Some need no search, because states exclude each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import product
from typing import Final

from ..document import Property
from .counterexample import Counterexample, counterexample
from .exploration import Budget, Holds, find, find_avoiding
from .expressions import Expression, ExpressionError, parse
from .fireability import Fireability
from .model import Model, nanoseconds
from .transition_system import ACTIVE, BEGUN, FINISHED, Configuration, Local, TransitionSystem

__all__ = ["PropertyResult", "Verdict", "check_property"]

_MOST: Final = 20_000
"""Combinations to look at; of more nothing is said."""


def may_hold(model: Model, expression: Expression, wanted: bool, fireability: Fireability) -> bool:
    """Return whether an expression may have a value, false only if it is certain that it never has."""
    automata = sorted(expression.automata)
    positions = {index: position for position, index in enumerate(automata)}
    holds: Holds = expression.bind(positions)
    tree = _Tree(model, positions)
    locals_ = [list(_locals(model, index, expression, fireability)) for index in automata]
    combinations = 1
    for of_one in locals_:
        combinations *= len(of_one)
    if combinations > _MOST:
        return True
    return any(
        holds(configuration) is wanted for configuration in product(*locals_) if tree.allows(configuration)
    )


def _locals(model: Model, index: int, expression: Expression, fireability: Fireability) -> Iterator[Local]:
    """Yield what an automaton may be like; one state stands for all that nobody asks for."""
    automaton = model.automata[index]
    possible = fireability.states[index]
    asked = {state for other, state in expression.states if other == index}
    for below in expression.automata:
        asked |= {owner.index for above, owner in model.ancestors(below) if above.index == index}
    others = {automaton.states[state].final: state for state in possible - asked}
    for state in {*(possible & asked), *others.values()}:
        yield state, ACTIVE | BEGUN, 0
        if index > 0:
            yield state, BEGUN, 0
        if automaton.states[state].final:
            yield state, ACTIVE | BEGUN | FINISHED, 0
            yield state, BEGUN | FINISHED, 0
    if index > 0:
        yield automaton.initial, 0, 0


class _Tree:
    """What the tree of automata says of some of them."""

    def __init__(self, model: Model, positions: dict[int, int]) -> None:
        self._chains: list[dict[int, int]] = []
        """The states above each automaton, by index."""
        self._above: list[list[tuple[int, int]]] = []
        """The positions of those above it that are looked at, with the state."""
        self._wakes: list[tuple[int, int] | None] = []
        """The position of its parent and the state in which that wakes it at once."""
        for index in positions:
            chain = {above.index: owner.index for above, owner in model.ancestors(index)}
            self._chains.append(chain)
            self._above.append([(positions[a], state) for a, state in chain.items() if a in positions])
            parent = model.automata[index].parent
            waking = None
            if parent in positions:
                owner = model.automata[parent].states[chain[parent]]
                waking = None if owner.owes or owner.final else (positions[parent], owner.index)
            self._wakes.append(waking)

    def allows(self, configuration: Configuration) -> bool:
        """Return whether the automata may be like this at one time."""
        chain: dict[int, int] = {}
        for position, (_, flags, _) in enumerate(configuration):
            if flags & ACTIVE:
                for above, state in self._above[position]:
                    index, of_above, _ = configuration[above]
                    if index != state or of_above & (ACTIVE | FINISHED) != ACTIVE:
                        return False
                for above, state in self._chains[position].items():
                    if chain.setdefault(above, state) != state:
                        return False
            elif (waking := self._wakes[position]) is not None:
                index, of_parent, _ = configuration[waking[0]]
                if index == waking[1] and of_parent & ACTIVE:
                    return False
        return True


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
    system = TransitionSystem(model, expression.automata or {0}, fireability)
    holds = expression.bind(system.position)
    if kind == "eventually":
        outcome = find_avoiding(system, holds, budget, within)
    else:
        bad = kind == "never"
        if not may_hold(model, expression, bad, fireability):
            return PropertyResult(stated, Verdict.HOLDS)
        goals = expression.states
        outcome = find(system, lambda each: holds(each) is bad, budget, within=within, goals=goals)
    verdict = Verdict.HOLDS if outcome.complete else Verdict.UNDECIDED
    found = None
    if outcome.run is not None:
        verdict, found = Verdict.VIOLATED, counterexample(outcome.run)
    return PropertyResult(stated, verdict, found, outcome.explored, outcome.until / 1e6)


def _invalid(stated: Property, problem: str) -> PropertyResult:
    return PropertyResult(stated, Verdict.INVALID, problem=problem)
