"""Check the model of a document: what can happen, what cannot, and what its properties say of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, TypeVar

from ...diagnostics import Note
from ..analysis import Analysis
from ..document import Document
from .commands import Commands, Operations
from .conflicts import Conflict, Use, find_conflicts, uses_of
from .exploration import Budget
from .fireability import Events, analyze, events_of
from .model import Model, read_model
from .properties import PropertyResult, Verdict, check_property
from .reachability import (
    Deadlock,
    Reachability,
    StateResult,
    TransitionResult,
    find_deadlocks,
    find_reachable,
    state_results,
    transition_results,
)

__all__ = ["DEFAULT_LIMIT", "QUICK_LIMIT", "ModelReport", "check_model"]

DEFAULT_LIMIT: Final = 500_000
"""The work of a check, in automata that are looked at in configurations: about a second."""

QUICK_LIMIT: Final = 30_000
"""A limit for checks on the way to something else, such as generation."""

_Result = TypeVar("_Result", StateResult, TransitionResult)


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
    doubtful: tuple[Note, ...] = ()
    """The code that cannot be followed, where something is undecided because of it."""


def check_model(
    document: Document,
    path: Path,
    *,
    operations: Operations | None = None,
    limit: int = DEFAULT_LIMIT,
    analysis: Analysis | None = None,
) -> ModelReport:
    """Check the automata of a document, whose imports are resolved, whatever values their guards have.

    `operations` tells which operations of the interfaces command something, by default their names do.
    `limit` is how much work may be spent, in automata that are looked at in configurations. What it leaves
    undecided is reported as such. `analysis` is that of the document, where it has been made.
    """
    model = read_model(document, path, analysis=analysis)
    events = events_of(model)
    uses = uses_of(model, Commands(model.analysis, operations))
    doubtful = (*model.doubtful, *events.places)
    if not doubtful:
        return _check(model, events, uses, Budget(limit))
    report = _check(model, events, uses, Budget(limit // 2))
    trusting = read_model(document, path, analysis=model.analysis, trusting=True)
    likely = _check(trusting, events.certain, uses, Budget(limit // 2))
    return _agreed(report, likely, doubtful)


def _check(model: Model, events: Events, uses: list[list[Use]], budget: Budget) -> ModelReport:
    limit = budget.left
    fireability = analyze(model, events)
    share = budget.share(limit // 4)
    reached = find_reachable(model, fireability, share)
    budget.give_back(share)
    share = budget.share(limit // 4)
    conflicts, unclear = find_conflicts(model, uses, fireability, reached, share)
    budget.give_back(share)
    properties: list[PropertyResult] = []
    stated = model.document.properties
    for done, one in enumerate(stated):
        share = budget.share(budget.left // (len(stated) - done))
        properties.append(check_property(model, one, fireability, share))
        budget.give_back(share)
    return ModelReport(
        model=model,
        states=tuple(state_results(model, fireability, reached)),
        transitions=tuple(transition_results(model, fireability, reached)),
        conflicts=tuple(conflicts),
        deadlocks=tuple(find_deadlocks(model, reached)),
        properties=tuple(properties),
        work=budget.spent,
        complete=not reached.unknown
        and not unclear
        and all(conflict.certain for conflict in conflicts)
        and all(result.verdict is not Verdict.UNDECIDED for result in properties),
        doubtful=tuple(unclear),
    )


def _agreed(report: ModelReport, likely: ModelReport, doubtful: tuple[Note, ...]) -> ModelReport:
    """Return what is so whatever the code does that cannot be followed.

    `report` lets it do anything, so that what it calls impossible or proved is so; what `likely` finds
    happens without it. All else is undecided.
    """
    servants = {_pair(found) for found in likely.conflicts if found.certain}
    agreed = replace(
        report,
        states=tuple(map(_agreed_result, report.states, likely.states)),
        transitions=tuple(map(_agreed_result, report.transitions, likely.transitions)),
        conflicts=tuple(
            replace(found, certain=found.certain and _pair(found) in servants) for found in report.conflicts
        ),
        properties=tuple(map(_agreed_property, report.properties, likely.properties)),
    )
    undecided = agreed != report
    return replace(
        agreed,
        work=report.work + likely.work,
        complete=report.complete and likely.complete and not undecided,
        doubtful=(*report.doubtful, *(doubtful if undecided else ())),
    )


def _pair(conflict: Conflict) -> tuple[int, int, str]:
    return conflict.first.automaton, conflict.second.automaton, conflict.first.command.identity


def _agreed_result(one: _Result, likely: _Result) -> _Result:
    if one.reachability is Reachability.IMPOSSIBLE:
        return one
    if likely.reachability is Reachability.POSSIBLE:
        return likely
    return replace(one, reachability=Reachability.UNDECIDED)


def _agreed_property(one: PropertyResult, likely: PropertyResult) -> PropertyResult:
    if one.verdict in (Verdict.HOLDS, Verdict.INVALID):
        return one
    if likely.verdict is Verdict.VIOLATED:
        return likely
    return replace(one, verdict=Verdict.UNDECIDED, counterexample=None)
