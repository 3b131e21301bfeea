"""Check the model of a document: what can happen, what cannot, and what its properties say of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ..document import Document
from .actuators import Commands, Operations
from .conflicts import Conflict, find_conflicts, uses_of
from .deadlock import Deadlock, find_deadlocks
from .events import events_of
from .exploration import Budget
from .fireability import analyze
from .model import Model, read_model
from .properties import PropertyResult, Verdict, check_property
from .reachability import (
    StateResult,
    TransitionResult,
    find_reachable,
    state_results,
    transition_results,
)

__all__ = ["DEFAULT_LIMIT", "QUICK_LIMIT", "ModelReport", "check_model"]

DEFAULT_LIMIT: Final = 500_000
"""The work of a check, in automata that are looked at in configurations: about a second."""

QUICK_LIMIT: Final = 30_000
"""A limit for checks on the way to something else, such as generation."""


@dataclass(frozen=True)
class ModelReport:
    """What is known of the automata of a document.

    `work` is what of the limit was spent; with `complete` nothing is left undecided.
    """

    model: Model
    states: tuple[StateResult, ...]
    transitions: tuple[TransitionResult, ...]
    conflicts: tuple[Conflict, ...]
    deadlocks: tuple[Deadlock, ...]
    properties: tuple[PropertyResult, ...]
    work: int
    complete: bool


def check_model(
    document: Document,
    path: Path,
    *,
    operations: Operations | None = None,
    commands: Commands | None = None,
    limit: int = DEFAULT_LIMIT,
) -> ModelReport:
    """Check the automata of a document, whose imports are resolved, whatever values their guards have.

    `operations` tells which operations of the interfaces command something, by default their names do;
    `commands` which the code uses, by default what it says. `limit` is how much work may be spent, in
    automata that are looked at in configurations. What it leaves undecided is reported as such.
    """
    model = read_model(document, path)
    fireability = analyze(model, events_of(model))
    budget = Budget(limit)
    share = budget.share(limit // 4)
    reached = find_reachable(model, fireability, share)
    budget.give_back(share)
    uses = uses_of(model, commands or Commands(document, operations or {}))
    share = budget.share(limit // 4)
    conflicts = find_conflicts(model, uses, fireability, reached, share)
    budget.give_back(share)
    properties: list[PropertyResult] = []
    for done, stated in enumerate(document.properties):
        share = budget.share(budget.left // (len(document.properties) - done))
        properties.append(check_property(model, stated, fireability, share))
        budget.give_back(share)
    return ModelReport(
        model=model,
        states=tuple(state_results(model, reached)),
        transitions=tuple(transition_results(model, fireability, reached)),
        conflicts=tuple(conflicts),
        deadlocks=tuple(find_deadlocks(model, fireability)),
        properties=tuple(properties),
        work=budget.spent,
        complete=not reached.unknown
        and all(conflict.certain for conflict in conflicts)
        and all(result.verdict is not Verdict.UNDECIDED for result in properties),
    )
