"""Check the model of a document, and report impossible states, conflicts and violated properties."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, TypeVar

from ...diagnostics import Diagnostics, Location, Note
from ...messages import Message, Value, all_of
from .._effects import CodeEffects
from ..codes import Code
from ..document import Document, Text
from ..report import Report, state_label, transition_label
from ._conflicts import Commands, Conflict, Operations, Use, find_conflicts, uses_of
from ._durations import slow_code
from ._exploration import Budget
from ._fireability import events_of, fireability_of
from ._reachability import (
    Reachability,
    StateResult,
    TransitionResult,
    WhyNever,
    by_graph,
    find_reachable,
    state_results,
    transition_results,
)
from ._solitary import Obstacle, remedy
from .model import AutomatonModel, Model, StateModel, TransitionModel, condition_of, read_model
from .properties import PropertyResult, Verdict, check_property

ASSUMPTIONS: Final = Message(
    "Proofs, and what is called impossible, hold as long as cycles begin and end within their periods, "
    "automata side by side change on time, code raises no errors, libraries use only what code passes to "
    "them, and nobody pauses, forces, sets or reloads anything."
)
"""The assumptions of the results; the page has the same words beside properties."""

DEFAULT_LIMIT: Final = 500_000
"""The work of a check, in automata times configurations: about a second."""

QUICK_LIMIT: Final = 30_000
"""A limit for checks during other work, such as generation."""

_SHOWN_STEPS: Final = 12
"""Steps of a counterexample that are shown of its beginning and of its end."""

_SHOWN_GUARDS: Final = 3
"""Guards that a counterexample needs, and that are named."""

_SHOWN_OBSTACLES: Final = 3
"""Obstacles to a decision that are shown."""

_LONG_SEARCH: Final = Message(
    "the search ended at its limit: `within`, periods with a small common multiple, or a higher `limit` of "
    "`check_model` may decide it"
)

_Result = TypeVar("_Result", StateResult, TransitionResult)


@dataclass(frozen=True)
class ModelReport:
    """The results for the automata of a document.

    `work` is the part of the limit that was spent. If it is `complete`, nothing is undecided.
    """

    model: Model
    states: tuple[StateResult, ...]
    transitions: tuple[TransitionResult, ...]
    conflicts: tuple[Conflict, ...]
    properties: tuple[PropertyResult, ...]
    work: int
    complete: bool
    doubtful: tuple[Note, ...] = ()
    """Code that cannot be followed and leaves something undecided."""
    obstacles: tuple[tuple[int, Obstacle], ...] = ()
    """The reasons for searches that ended at their limit, by the ids of automata."""


def check_model(
    document: Document,
    path: Path,
    *,
    operations: Operations | None = None,
    limit: int = DEFAULT_LIMIT,
    effects: CodeEffects | None = None,
) -> ModelReport:
    """Check the automata of a document, whose imports are resolved, for all values of their guards.

    `operations` says which operations of the interfaces are commands; by default, their names decide. `limit`
    is the work that may be spent, in automata times configurations; what it leaves undecided is reported as
    such. `effects` are those of its code, if they are known already.
    """
    model = read_model(document, path, effects=effects)
    events = events_of(model)
    uses = uses_of(model, Commands(model.effects, operations))
    slow, ending = slow_code(model.effects)
    doubtful = (*model.doubtful, *events.places, *slow, *ending)
    if not doubtful:
        return _check(model, events.outside, uses, Budget(limit))
    cautious = read_model(document, path, effects=model.effects, untimed=True) if slow else model
    cautious = replace(cautious, slow=bool(slow), ends=bool(ending))
    report = _check(cautious, events.outside | events.unclear, uses, Budget(limit // 2))
    trusting = read_model(document, path, effects=model.effects, trusting=True)
    likely = _check(trusting, events.outside, uses, Budget(limit // 2))
    return _agreed(report, likely, doubtful)


def _check(model: Model, events: frozenset[str], uses: list[list[Use]], budget: Budget) -> ModelReport:
    fireability = fireability_of(model, events)
    reached = find_reachable(fireability, budget.share(4))
    conflicts, unclear = find_conflicts(uses, fireability, reached, budget.share(3))
    stated = model.document.properties
    properties = [
        check_property(one, fireability, budget.share(len(stated) - done)) for done, one in enumerate(stated)
    ]
    return ModelReport(
        model=model,
        states=tuple(state_results(fireability, reached)),
        transitions=tuple(transition_results(fireability, reached)),
        conflicts=tuple(conflicts),
        properties=tuple(properties),
        work=budget.spent,
        complete=not reached.unknown
        and not unclear
        and all(conflict.certain for conflict in conflicts)
        and all(result.verdict is not Verdict.UNDECIDED for result in properties),
        doubtful=tuple(unclear),
        obstacles=tuple((model.automata[index].source.id, why) for index, why in reached.obstacles.items()),
    )


def _agreed(report: ModelReport, likely: ModelReport, doubtful: tuple[Note, ...]) -> ModelReport:
    """Return the results that hold whatever the code that cannot be followed does.

    In `report` that code may do anything, for any time: its impossible and proved results are certain.
    In `likely` it does nothing, so that the runs found there are possible. All other results are undecided.
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


def report_model(report: ModelReport, diagnostics: Diagnostics, *, quick: bool = False) -> None:
    """Report the results. A violated property is an error, an undecided one a warning.

    Consequences of impossible states and transitions are not reported, nor events that nothing sends, which
    the checks report. A `quick` report has only impossible states and transitions, and violated or invalid
    properties.
    """
    reporter = _Reporter(report, diagnostics)
    reporter.never_entered()
    for transition in report.transitions:
        if transition.why not in (WhyNever.NONE, WhyNever.ORIGIN, WhyNever.EVENT):
            reporter.never_fires(transition)
    if not quick:
        for conflict in report.conflicts:
            reporter.conflict(conflict)
        reporter.never_left()
        reporter.undecided()
        for found in report.doubtful:
            assert found.location is not None
            message = Message("{problem}: what depends on it is undecided", problem=found.message)
            diagnostics.note(Code.UNCLEAR_CODE, message, found.location)
    for result in report.properties:
        if not (quick and result.verdict is Verdict.UNDECIDED):
            reporter.property(result)


def report_graph(effects: CodeEffects, diagnostics: Diagnostics) -> None:
    """Report what transitions show of states, whatever makes them fire: in a part of a document, too."""
    model = read_model(effects.analysis.document, effects.analysis.path, effects=effects)
    reporter = _Reporter(ModelReport(model, (), (), (), (), work=0, complete=False), diagnostics)
    reporter.never_entered()
    reporter.never_left()


class _Reporter:
    def __init__(self, report: ModelReport, diagnostics: Diagnostics) -> None:
        self._found = report
        self._model = report.model
        self._report = Report(report.model.path, diagnostics)
        self._impossible = {
            (item.automaton, item.state)
            for item in report.states
            if item.reachability is Reachability.IMPOSSIBLE
        }

    def never_entered(self) -> None:
        for model in self._model.automata:
            initial, connected = model.states[model.initial].source, by_graph(model)
            for state in (each.source for each in model.states if each.index not in connected):
                if (model.source.id, initial.id) not in self._impossible:
                    labels: dict[str, Value] = {"initial": state_label(initial), "state": state_label(state)}
                    message = Message("no transitions lead from {initial} to {state}", **labels)
                    self._report.warning(Code.NEVER_ENTERED, message, state)

    def never_fires(self, result: TransitionResult) -> None:
        model = self._model.by_id[result.automaton]
        transition = next(item for item in model.transitions if item.source.id == result.transition)
        source = transition.source
        code = Code.NEVER_FIRES
        text = source.trigger
        notes = list[Note]()
        if result.why is WhyNever.GUARD:
            text = condition_of(source)
            why = Message("its guard is always false")
            if source.type == "condition":
                why = Message("its condition is always false")
        elif result.why is WhyNever.CHILDREN:
            code, text = Code.NEVER_FINISHES, Text()
            why, notes = self._endless(model.states[transition.origin])
        elif result.why is WhyNever.ANCESTORS:
            code, why = Code.FIRES_TOO_LATE, Message("the states above are left before there is time for it")
        else:
            why = Message("another always fires before it")
            for other in (item for item in model.transitions if item.source.id in result.earlier):
                if _is_timed_out(model, transition, other):
                    code = Code.FIRES_TOO_LATE
                place = self._report.place(other.source, other.source.trigger)
                first = Message("{transition} fires first", transition=transition_label(other.source))
                notes.append(Note(first, place))
        target = model.states[transition.target]
        if (result.automaton, target.source.id) in self._impossible:
            path = self._model.state_path(model.index, target.index)
            entered = Message("the state `{path}` is never entered", path=path)
            notes.append(Note(entered, self._report.place(target.source)))
        message = Message("{transition} can never fire: {why}", transition=transition_label(source), why=why)
        self._report.warning(code, message, self._report.place(source, text), notes, assumes=ASSUMPTIONS)

    def _endless(self, state: StateModel) -> tuple[Message, list[Note]]:
        """Return why the automata below a state never finish, and notes that name them."""
        for child in (self._model.automata[index].source for index in state.children):
            if not any(each.final and (child.id, each.id) not in self._impossible for each in child.states):
                message = Message("none of its states that can be reached is final")
                notes = [Note(message, self._report.place(child))]
                return Message("automaton {id} never finishes", id=child.id), notes
        return Message("{state} owns no automaton", state=state_label(state.source)), []

    def never_left(self) -> None:
        """Report states without a way out, in automata that have other states."""
        for model in self._model.automata:
            entered = [
                model.states[index]
                for index in sorted(by_graph(model))
                if (model.source.id, model.states[index].source.id) not in self._impossible
            ]
            for state in entered if len(entered) > 1 else ():
                if not state.final and all(each.target == state.index for each in state.outgoing):
                    label = state_label(state.source)
                    message = Message(
                        "no transition leads away from {state}: the automaton stays there", state=label
                    )
                    note = Note(Message("mark the state as final if the automaton has finished there"))
                    self._report.note(Code.NEVER_LEFT, message, self._report.place(state.source), [note])

    def undecided(self) -> None:
        """Report what the searches left undecided, and what would decide it."""
        obstacles = self._found.obstacles
        what = []
        if states := _count_undecided(self._found.states):
            what.append(Message.counted("{count} state", "{count} states", count=states))
        if transitions := _count_undecided(self._found.transitions):
            what.append(Message.counted("{count} transition", "{count} transitions", count=transitions))
        if not what or not obstacles:
            return
        notes = []
        for automaton, obstacle in obstacles[:_SHOWN_OBSTACLES]:
            model = self._model.by_id[automaton]
            notes.append(Note(remedy(self._model, model, obstacle), self._report.place(model.source)))
        if len(obstacles) > len(notes):
            more = len(obstacles) - len(notes)
            so = Message.counted(
                "so it is with {count} more automaton", "so it is with {count} more automata", count=more
            )
            notes.append(Note(so))
        message = Message(
            "the search ended at its limit: it is undecided whether {what} can happen", what=all_of(what)
        )
        place = self._report.place(self._model.by_id[obstacles[0][0]].source)
        self._report.note(Code.UNDECIDED, message, place, notes)

    def conflict(self, conflict: Conflict) -> None:
        paths = [
            self._model.state_path(use.automaton, use.state) for use in (conflict.first, conflict.second)
        ]
        how = Message("one runs below the other") if conflict.nested else Message("they run side by side")
        two: dict[str, Value] = {
            "first": paths[0],
            "second": paths[1],
            "servant": conflict.first.command.identity,
            "how": how,
        }
        message = Message("`{first}` and `{second}` both may command `{servant}`, and {how}", **two)
        if conflict.certain:
            message = Message("`{first}` and `{second}` both command `{servant}`, and {how}", **two)
        called = Message("`{operation}` is called here", operation=conflict.second.command.operation)
        notes = [Note(called, conflict.second.place)]
        if conflict.counterexample is not None and conflict.counterexample.steps:
            steps = conflict.counterexample.text
            notes.append(Note(Message("with these steps both run:\n{steps}", steps=steps)))
        if conflict.certain:
            self._report.warning(Code.CONFLICT, message, conflict.first.place, notes)
        else:
            self._report.note(Code.POSSIBLE_CONFLICT, message, conflict.first.place, notes)

    def property(self, result: PropertyResult) -> None:
        stated = result.property
        name = Message.verbatim(f"`{stated.name}`") if stated.name.strip() else Message("this property")
        place = self._report.place(stated, stated.expression)
        if result.verdict is Verdict.VIOLATED:
            expression = " ".join(stated.expression.text.split())
            what = Message.verbatim(f"{stated.kind.strip()} {expression[:200]}")
            if not stated.within.is_blank:
                what = Message("{what} within {time} ms", what=what, time=stated.within.text.strip())
            assert result.counterexample is not None
            message = _violated(name, what, result.counterexample.guards)
            steps = result.counterexample.shortened(_SHOWN_STEPS)
            notes = [Note(Message("by these steps:\n{steps}", steps=steps))]
            self._report.error(Code.VIOLATED_PROPERTY, message, place, notes)
        elif result.verdict is Verdict.UNDECIDED:
            message = Message(
                "{name} is undecided (explored {count} configurations up to {time:g} s)",
                name=name,
                count=result.explored,
                time=result.until_ms / 1000,
            )
            notes = [*self._found.doubtful] or [Note(_LONG_SEARCH)]
            self._report.warning(Code.UNDECIDED_PROPERTY, message, place, notes)
        elif result.error is not None:
            error = result.error
            place = _within(place, stated.expression, error.offset, error.length)
            notes = [Note(hint) for hint in error.hints]
            notes[:1] = [replace(each, misspelt=error.misspelt) for each in notes[:1]]
            message = Message("{name}: {problem}", name=name, problem=error.message)
            self._report.error(Code.BAD_EXPRESSION, message, place, notes)
        elif result.problem:
            place = self._report.place(stated, stated.within)
            message = Message("{name}: {problem}", name=name, problem=result.problem)
            self._report.error(Code.BAD_PROPERTY, message, place)


def _violated(name: Message, what: Message, guards: tuple[str, ...]) -> Message:
    """Return that a property is violated, and the guards that must hold for it."""
    if not guards:
        return Message("{name} is violated: {what}", name=name, what=what)
    if len(guards) == 1:
        (guard,) = guards
        return Message(
            "{name} is violated if the guard `{guard}` ever holds: {what}", name=name, guard=guard, what=what
        )
    listed = [Message.verbatim(f"`{guard}`") for guard in guards[:_SHOWN_GUARDS]]
    if len(guards) > len(listed):
        listed.append(Message("{count} more", count=len(guards) - len(listed)))
    return Message(
        "{name} is violated if the guards {guards} ever hold: {what}",
        name=name,
        guards=all_of(listed),
        what=what,
    )


def _count_undecided(results: Iterable[StateResult | TransitionResult]) -> int:
    return sum(each.reachability is Reachability.UNDECIDED for each in results)


def _is_timed_out(model: AutomatonModel, transition: TransitionModel, other: TransitionModel) -> bool:
    """Return whether another fires first because of its time, not because of its order."""
    if not transition.delay or transition.delay == other.delay:
        return False
    outgoing = model.states[transition.origin].outgoing
    return bool(other.delay) or outgoing.index(other) > outgoing.index(transition)


def _within(start: Location, text: Text, offset: int, length: int) -> Location:
    """Return the place of a character within a text."""
    before = text.text[:offset]
    newlines = before.count("\n")
    if not newlines:
        return Location(start.path, start.line, start.column + offset, length)
    return Location(start.path, start.line + newlines, offset - before.rindex("\n"), length)
