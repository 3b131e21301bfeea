"""Say what the model checker found as diagnostics, at its places in the document."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from ...diagnostics import Diagnostics, Location, Note
from ..checks.report import state_label, transition_label
from ..codes import Code
from ..document import Property, State, Text, Transition
from .checker import ModelReport
from .conflicts import Conflict, Use
from .model import AutomatonModel, TransitionModel
from .properties import PropertyResult, Verdict
from .reachability import Reachability, StateResult, TransitionResult, WhyNever

__all__ = ["report_impossible", "report_model", "report_properties"]

_SHOWN_STEPS: Final = 12


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
        self._report = report
        self._model = report.model
        self._diagnostics = diagnostics

    def state(self, result: StateResult) -> None:
        model = self._model.by_id[result.automaton]
        state = next(item.source for item in model.states if item.source.id == result.state)
        initial = model.states[model.initial].source
        message = f"no transitions lead from {state_label(initial)} to {state_label(state)}"
        self._diagnostics.warning(Code.NEVER_ENTERED, message, self._place(state))

    def transition(self, result: TransitionResult) -> None:
        model = self._model.by_id[result.automaton]
        transition = next(item for item in model.transitions if item.source.id == result.transition)
        source = transition.source
        code, why, place = Code.NEVER_FIRES, "", self._text_location(source, source.trigger)
        notes: list[Note] = []
        if result.why is WhyNever.GUARD:
            is_condition = source.type == "condition"
            why = f"its {'condition' if is_condition else 'guard'} is always false"
            place = self._text_location(source, source.trigger if is_condition else source.guard)
        elif result.why is WhyNever.CHILDREN:
            code, place = Code.NEVER_FINISHES, self._place(source)
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
                Note(f"{transition_label(other.source)} fires first", self._trigger_place(other.source))
                for other in earlier
            ]
        target = model.states[transition.target]
        if self._is_never_entered(result.automaton, target.source.id):
            path = self._model.state_path(model.index, target.index)
            notes.append(Note(f"the state `{path}` is never entered", self._place(target.source)))
        self._diagnostics.warning(code, f"{transition_label(source)} can never fire: {why}", place, notes)

    def _endless(self, model: AutomatonModel, transition: TransitionModel) -> tuple[str, list[Note]]:
        """Return why the automata below a state never finish, and which of them."""
        state = model.states[transition.origin]
        below = [self._model.automata[child] for child in state.children]
        finishing = {item.automaton for item in self._report.states if self._is_possible_end(item)}
        endless = next((child.source for child in below if child.source.id not in finishing), None)
        if endless is None:
            return f"{state_label(state.source)} owns no automaton", []
        place = Location(endless.path or self._model.path, endless.line, max(1, endless.column))
        note = Note("none of its states that can be reached is final", place)
        return f"automaton {endless.id} never finishes", [note]

    def _is_possible_end(self, result: StateResult) -> bool:
        state = self._model.by_id[result.automaton].source.state(result.state)
        possible = result.reachability is not Reachability.IMPOSSIBLE
        return state is not None and state.final and possible

    def _is_never_entered(self, automaton: int, state: int) -> bool:
        return any(
            (item.automaton, item.state, item.reachability) == (automaton, state, Reachability.IMPOSSIBLE)
            for item in self._report.states
        )

    def without_way_out(self) -> set[tuple[int, int]]:
        """Report the states that no transition leads away from; return their automata and ids."""
        found: set[tuple[int, int]] = set()
        possible = {
            (item.automaton, item.state)
            for item in self._report.states
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
                self._diagnostics.note(Code.NEVER_LEFT, message, self._place(state.source), [note])
        return found

    def without_chance(self) -> set[tuple[int, int]]:
        """Return the automata and ids of states that a transition leaves which can never fire."""
        impossible = {
            (item.automaton, item.transition)
            for item in self._report.transitions
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
        tell = self._diagnostics.warning if conflict.certain else self._diagnostics.note
        code = Code.CONFLICT if conflict.certain else Code.POSSIBLE_CONFLICT
        tell(code, f"{where}, and {how}", first.place, notes)

    def deadlock(self, id: int, paths: tuple[str, ...]) -> None:
        root = self._model.automata[0]
        state = next(item.source for item in root.states if item.source.id == id)
        listed = ", ".join(f"`{path}`" for path in paths)
        self._diagnostics.note(
            Code.DEADLOCK,
            f"nothing ever changes any more in {listed}, which is no final state",
            self._place(state),
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
            self._diagnostics.error(
                Code.VIOLATED_PROPERTY, message, self._text_place(stated, stated.expression), notes
            )
        elif result.verdict is Verdict.UNDECIDED:
            found = f"explored {result.explored} configurations up to {result.until_ms / 1000:g} s"
            message = f"{name} is undecided ({found})"
            notes = list(self._report.doubtful)
            self._diagnostics.warning(
                Code.UNDECIDED_PROPERTY, message, self._text_place(stated, stated.expression), notes
            )

    def _invalid(self, result: PropertyResult, name: str) -> None:
        stated = result.property
        if result.error is None:
            self._diagnostics.error(
                Code.BAD_PROPERTY, f"{name}: {result.problem}", self._text_place(stated, stated.within)
            )
            return
        error = result.error
        place = _within(
            self._text_place(stated, stated.expression), stated.expression, error.offset, error.length
        )
        notes = [Note(hint) for hint in error.hints]
        self._diagnostics.error(Code.BAD_EXPRESSION, f"{name}: {error.message}", place, notes)

    def _path(self, use: Use) -> str:
        return self._model.state_path(use.automaton, use.state)

    def _text_location(self, item: State | Transition, text: Text) -> Location:
        if not text.line:
            return self._place(item)
        return Location(item.path or self._model.path, text.line, max(1, text.column))

    def _trigger_place(self, transition: Transition) -> Location:
        return self._text_location(transition, transition.trigger)

    def _place(self, item: State | Transition) -> Location:
        return Location(item.path or self._model.path, item.line, max(1, item.column))

    def _text_place(self, stated: Property, text: Text) -> Location:
        path: Path = stated.path or self._model.path
        line, column = (text.line, text.column) if text.line else (stated.line, stated.column)
        return Location(path, line, max(1, column))


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
