"""Check the model of a document, and report it: what can happen, what cannot, and what its properties say."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, TypeVar

from ...diagnostics import Diagnostics, Location, Note
from ..analysis import Analysis
from ..checks.report import Report, state_label, transition_label
from ..codes import Code
from ..document import Document, Text
from .commands import Commands, Operations
from .conflicts import Conflict, Use, find_conflicts, uses_of
from .exploration import Budget
from .fireability import Events, analyze, events_of
from .model import AutomatonModel, Model, TransitionModel, read_model
from .properties import PropertyResult, Verdict, check_property
from .reachability import (
    Deadlock,
    Reachability,
    StateResult,
    TransitionResult,
    WhyNever,
    find_deadlocks,
    find_reachable,
    state_results,
    transition_results,
)

__all__ = [
    "DEFAULT_LIMIT",
    "QUICK_LIMIT",
    "ModelReport",
    "check_model",
    "report_impossible",
    "report_model",
    "report_properties",
]

DEFAULT_LIMIT: Final = 500_000
"""The work of a check, in automata that are looked at in configurations: about a second."""

QUICK_LIMIT: Final = 30_000
"""A limit for checks on the way to something else, such as generation."""

_SHOWN_STEPS: Final = 12
"""Steps of a counterexample that are shown at its beginning and at its end."""

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
    fireability = analyze(model, events)
    reached = find_reachable(model, fireability, budget.share(4))
    conflicts, unclear = find_conflicts(model, uses, fireability, reached, budget.share(3))
    stated = model.document.properties
    properties = [
        check_property(model, one, fireability, budget.share(len(stated) - done))
        for done, one in enumerate(stated)
    ]
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


def report_model(report: ModelReport, diagnostics: Diagnostics) -> None:
    """Report what was found. A violated property is an error, one that stays undecided a warning."""
    reporter = _Reporter(report, diagnostics)
    report_impossible(report, diagnostics)
    for conflict in report.conflicts:
        reporter.conflict(conflict)
    explained = reporter.without_way_out() | reporter.without_chance()
    for deadlock in report.deadlocks:
        if (0, deadlock.state) not in explained:
            reporter.deadlock(deadlock.state, deadlock.paths)
    for found in report.doubtful:
        assert found.location is not None
        message = f"{found.message}: what depends on it is undecided"
        diagnostics.note(Code.UNCLEAR_CODE, message, found.location)
    report_properties(report, diagnostics)


def report_impossible(report: ModelReport, diagnostics: Diagnostics) -> None:
    """Report the states that no transitions lead to, and the transitions that can never fire.

    Of what follows from them nothing is said, nor of events that nothing sends: that the checks report.
    """
    reporter = _Reporter(report, diagnostics)
    for state in report.states:
        if state.why is WhyNever.GRAPH:
            reporter.state(state)
    for transition in report.transitions:
        if transition.why not in (WhyNever.NONE, WhyNever.ORIGIN, WhyNever.EVENT):
            reporter.transition(transition)


def report_properties(report: ModelReport, diagnostics: Diagnostics, *, with_undecided: bool = True) -> None:
    """Report what was found of the properties alone."""
    reporter = _Reporter(report, diagnostics)
    for result in report.properties:
        if with_undecided or result.verdict is not Verdict.UNDECIDED:
            reporter.property(result)


class _Reporter:
    def __init__(self, report: ModelReport, diagnostics: Diagnostics) -> None:
        self._found = report
        self._model = report.model
        self._report = Report(report.model.path, diagnostics)

    def state(self, result: StateResult) -> None:
        model = self._model.by_id[result.automaton]
        state = next(item.source for item in model.states if item.source.id == result.state)
        initial = model.states[model.initial].source
        message = f"no transitions lead from {state_label(initial)} to {state_label(state)}"
        self._report.warning(Code.NEVER_ENTERED, message, self._report.place(state))

    def transition(self, result: TransitionResult) -> None:
        model = self._model.by_id[result.automaton]
        transition = next(item for item in model.transitions if item.source.id == result.transition)
        source = transition.source
        code, why, place = Code.NEVER_FIRES, "", self._report.place(source, source.trigger)
        notes: list[Note] = []
        if result.why is WhyNever.GUARD:
            is_condition = source.type == "condition"
            why = f"its {'condition' if is_condition else 'guard'} is always false"
            place = self._report.place(source, source.trigger if is_condition else source.guard)
        elif result.why is WhyNever.CHILDREN:
            code, place = Code.NEVER_FINISHES, self._report.place(source)
            why, notes = self._endless(model, transition)
        elif result.why is WhyNever.ANCESTORS:
            code, why = Code.NO_TIME_TO_FIRE, "the states above are left before there is time for it"
        else:
            earlier = [item for item in model.transitions if item.source.id in result.earlier]
            code = (
                Code.NO_TIME_TO_FIRE
                if any(_is_timed_out(model, transition, each) for each in earlier)
                else Code.NEVER_FIRES
            )
            why = "another always fires before it"
            notes = [
                Note(
                    f"{transition_label(other.source)} fires first",
                    self._report.place(other.source, other.source.trigger),
                )
                for other in earlier
            ]
        target = model.states[transition.target]
        if self._is_never_entered(result.automaton, target.source.id):
            path = self._model.state_path(model.index, target.index)
            notes.append(Note(f"the state `{path}` is never entered", self._report.place(target.source)))
        self._report.warning(code, f"{transition_label(source)} can never fire: {why}", place, notes)

    def _endless(self, model: AutomatonModel, transition: TransitionModel) -> tuple[str, list[Note]]:
        """Return why the automata below a state never finish, and which of them."""
        state = model.states[transition.origin]
        below = [self._model.automata[child] for child in state.children]
        finishing = {item.automaton for item in self._found.states if self._is_possible_end(item)}
        endless = next((child.source for child in below if child.source.id not in finishing), None)
        if endless is None:
            return f"{state_label(state.source)} owns no automaton", []
        note = Note("none of its states that can be reached is final", self._report.place(endless))
        return f"automaton {endless.id} never finishes", [note]

    def _is_possible_end(self, result: StateResult) -> bool:
        state = self._model.by_id[result.automaton].source.state(result.state)
        possible = result.reachability is not Reachability.IMPOSSIBLE
        return state is not None and state.final and possible

    def _is_never_entered(self, automaton: int, state: int) -> bool:
        return any(
            (item.automaton, item.state, item.reachability) == (automaton, state, Reachability.IMPOSSIBLE)
            for item in self._found.states
        )

    def without_way_out(self) -> set[tuple[int, int]]:
        """Report the states that no transition leads away from; return their automata and ids."""
        found: set[tuple[int, int]] = set()
        possible = {
            (item.automaton, item.state)
            for item in self._found.states
            if item.reachability is not Reachability.IMPOSSIBLE
        }
        for model in self._model.automata:
            for state in model.states:
                leaves = any(each.target != state.index for each in state.outgoing)
                entered = (model.source.id, state.source.id) in possible
                alone = sum(1 for each in model.states if (model.source.id, each.source.id) in possible) < 2
                if state.final or leaves or alone or not entered:
                    continue
                found.add((model.index, state.source.id))
                label = state_label(state.source)
                message = f"no transition leads away from {label}: the automaton stays there"
                note = Note("mark the state as final if the automaton has finished there")
                self._report.note(Code.NEVER_LEFT, message, self._report.place(state.source), [note])
        return found

    def without_chance(self) -> set[tuple[int, int]]:
        """Return the automata and ids of states that a transition leaves which can never fire."""
        impossible = {
            (item.automaton, item.transition)
            for item in self._found.transitions
            if item.reachability is Reachability.IMPOSSIBLE
        }
        return {
            (model.index, transition.source.origin)
            for model in self._model.automata
            for transition in model.transitions
            if (model.source.id, transition.source.id) in impossible
        }

    def conflict(self, conflict: Conflict) -> None:
        first, second = conflict.first, conflict.second
        servant = first.command.identity
        may = "command" if conflict.certain else "may command"
        where = f"`{self._path(first)}` and `{self._path(second)}` both {may} `{servant}`"
        how = "one runs below the other" if conflict.nested else "they run side by side"
        notes = [Note(f"`{second.command.operation}` is called here", second.place)]
        if conflict.counterexample is not None and conflict.counterexample.steps:
            notes.append(Note(f"this is how both come to run:\n{conflict.counterexample}"))
        tell = self._report.warning if conflict.certain else self._report.note
        code = Code.CONFLICT if conflict.certain else Code.POSSIBLE_CONFLICT
        tell(code, f"{where}, and {how}", first.place, notes)

    def deadlock(self, id: int, paths: tuple[str, ...]) -> None:
        root = self._model.automata[0]
        state = next(item.source for item in root.states if item.source.id == id)
        listed = ", ".join(f"`{path}`" for path in paths)
        self._report.note(
            Code.DEADLOCK,
            f"nothing ever changes any more in {listed}, which is no final state",
            self._report.place(state),
        )

    def property(self, result: PropertyResult) -> None:
        stated = result.property
        name = f"`{stated.name}`" if stated.name.strip() else "this property"
        if result.verdict is Verdict.INVALID:
            self._invalid(result, name)
        elif result.verdict is Verdict.VIOLATED:
            assert result.counterexample is not None
            expression = " ".join(stated.expression.text.split())
            within = f" within {stated.within.text.strip()} ms" if not stated.within.is_blank else ""
            message = f"{name} is violated: {stated.kind.strip()} {expression[:200]}{within}"
            notes = [Note(f"by these steps:\n{_shortened(str(result.counterexample))}")]
            self._report.error(
                Code.VIOLATED_PROPERTY, message, self._report.place(stated, stated.expression), notes
            )
        elif result.verdict is Verdict.UNDECIDED:
            found = f"explored {result.explored} configurations up to {result.until_ms / 1000:g} s"
            message = f"{name} is undecided ({found})"
            notes = list(self._found.doubtful)
            self._report.warning(
                Code.UNDECIDED_PROPERTY, message, self._report.place(stated, stated.expression), notes
            )

    def _invalid(self, result: PropertyResult, name: str) -> None:
        stated = result.property
        if result.error is None:
            self._report.error(
                Code.BAD_PROPERTY, f"{name}: {result.problem}", self._report.place(stated, stated.within)
            )
            return
        error = result.error
        place = _within(
            self._report.place(stated, stated.expression), stated.expression, error.offset, error.length
        )
        notes = [Note(hint) for hint in error.hints]
        self._report.error(Code.BAD_EXPRESSION, f"{name}: {error.message}", place, notes)

    def _path(self, use: Use) -> str:
        return self._model.state_path(use.automaton, use.state)


def _is_timed_out(model: AutomatonModel, transition: TransitionModel, other: TransitionModel) -> bool:
    """Return whether another fires first because of its time, and not because it is tried first."""
    if not transition.delay or transition.delay == other.delay:
        return False
    outgoing = model.states[transition.origin].outgoing
    return bool(other.delay) or outgoing.index(other) > outgoing.index(transition)


def _shortened(text: str) -> str:
    lines = text.split("\n")
    if len(lines) <= 2 * _SHOWN_STEPS:
        return text
    left = len(lines) - 2 * _SHOWN_STEPS
    return "\n".join([*lines[:_SHOWN_STEPS], f"{'':18}... {left} more ...", *lines[-_SHOWN_STEPS:]])


def _within(start: Location, text: Text, offset: int, length: int) -> Location:
    """Return the place of a character within a text."""
    before = text.text[:offset]
    newlines = before.count("\n")
    if not newlines:
        return Location(start.path, start.line, start.column + offset, length)
    return Location(start.path, start.line + newlines, offset - before.rindex("\n"), length)
