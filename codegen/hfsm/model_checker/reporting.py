"""Say what the model checker found as diagnostics, at its places in the document."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Final

from ...diagnostics import Diagnostics, Location, Note
from ..document import Property, State, Text, Transition
from .checker import ModelReport
from .conflicts import Conflict, Use
from .model import AutomatonModel
from .properties import PropertyResult, Verdict
from .reachability import Reachability, StateResult, TransitionResult, WhyNever

__all__ = ["STRUCTURAL", "report_model", "report_properties"]

STRUCTURAL: Final = frozenset({WhyNever.GRAPH, WhyNever.GUARD, WhyNever.EVENT})
"""What the structural checks tell already."""

_SHOWN_STEPS: Final = 12


def report_model(
    report: ModelReport, diagnostics: Diagnostics, *, leave_out: Collection[WhyNever] = STRUCTURAL
) -> None:
    """Report what was found; what is impossible for a reason in `leave_out` is told elsewhere.

    A violated property is an error, one that stays undecided a warning.
    """
    reporter = _Reporter(report, diagnostics)
    skipped = {*leave_out, WhyNever.ORIGIN}  # the cause is told, not each consequence
    for transition in report.transitions:
        if transition.reachability is Reachability.IMPOSSIBLE and transition.why not in skipped:
            reporter.transition(transition)
    for state in report.states:
        if state.reachability is Reachability.IMPOSSIBLE and state.why not in skipped:
            reporter.state(state)
    for conflict in report.conflicts:
        reporter.conflict(conflict)
    for deadlock in report.deadlocks:
        reporter.deadlock(deadlock.state, deadlock.paths)
    for found in report.doubtful:
        assert found.location is not None
        message = f"{found.message}: what depends on it is undecided"
        diagnostics.note("N606", message, found.location)
    report_properties(report, diagnostics)


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

    def transition(self, result: TransitionResult) -> None:
        automaton = self._model.by_id[result.automaton].source
        transition = next(item for item in automaton.transitions if item.id == result.transition)
        notes = [
            Note(f"{_name(other)} fires first", self._place(other))
            for other in automaton.transitions
            if other.id in result.earlier
        ]
        why = {
            WhyNever.GRAPH: "its origin is never entered",
            WhyNever.GUARD: "its guard is always false",
            WhyNever.EVENT: f"nothing sends the event `{transition.trigger.text.strip()[:40]}`",
            WhyNever.CHILDREN: "the automata below never finish",
            WhyNever.EARLIER: "another always fires before it",
            WhyNever.ANCESTORS: "timers here and above leave no time for it",
        }[result.why]
        message = f"{_name(transition)} can never fire: {why}"
        self._diagnostics.warning("W602", message, self._place(transition), notes)

    def state(self, result: StateResult) -> None:
        model = self._model.by_id[result.automaton]
        state = next(item for item in model.states if item.source.id == result.state)
        path = self._model.state_path(model.index, state.index)
        place = self._place(state.source)
        self._diagnostics.warning(
            "W601", f"the state `{path}` is never entered: no transition that leads to it can fire", place
        )

    def conflict(self, conflict: Conflict) -> None:
        first, second = conflict.first, conflict.second
        servant = first.command.identity
        may = "command" if conflict.certain else "may command"
        where = f"`{self._path(first)}` and `{self._path(second)}` both {may} `{servant}`"
        how = "one runs below the other" if conflict.nested else "they run side by side"
        notes = [Note(f"`{second.command.operation}` is called here", self._place_of(second))]
        if conflict.counterexample is not None and conflict.counterexample.steps:
            notes.append(Note(f"this is how both come to run:\n{conflict.counterexample}"))
        tell = self._diagnostics.warning if conflict.certain else self._diagnostics.note
        code = "W603" if conflict.certain else "N603"
        tell(code, f"{where}, and {how}", self._place_of(first), notes)

    def deadlock(self, id: int, paths: tuple[str, ...]) -> None:
        root = self._model.automata[0]
        state = next(item.source for item in root.states if item.source.id == id)
        listed = ", ".join(f"`{path}`" for path in paths)
        self._diagnostics.note(
            "N604",
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
            self._diagnostics.error("E610", message, self._text_place(stated, stated.expression), notes)
        elif result.verdict is Verdict.UNDECIDED:
            found = f"explored {result.explored} configurations up to {result.until_ms / 1000:g} s"
            message = f"{name} is undecided ({found})"
            notes = list(self._report.doubtful)
            self._diagnostics.warning("W611", message, self._text_place(stated, stated.expression), notes)

    def _invalid(self, result: PropertyResult, name: str) -> None:
        stated = result.property
        if result.error is None:
            self._diagnostics.error(
                "E612", f"{name}: {result.problem}", self._text_place(stated, stated.within)
            )
            return
        error = result.error
        place = _within(
            self._text_place(stated, stated.expression), stated.expression, error.offset, error.length
        )
        notes = [Note(hint) for hint in error.hints]
        self._diagnostics.error("E613", f"{name}: {error.message}", place, notes)

    def _path(self, use: Use) -> str:
        return self._model.state_path(use.automaton, use.state)

    def _place_of(self, use: Use) -> Location:
        automaton: AutomatonModel = self._model.automata[use.automaton]
        state = automaton.states[use.state].source
        if use.transition is not None:
            transition = next(item for item in automaton.transitions if item.index == use.transition)
            return self._text_location(transition.source, transition.source.code)
        text = {"code": state.code, "entry": state.entry, "exit": state.exit}[use.piece]
        return self._text_location(state, text)

    def _text_location(self, item: State | Transition, text: Text) -> Location:
        if not text.line:
            return self._place(item)
        return Location(item.path or self._model.path, text.line, max(1, text.column))

    def _place(self, item: State | Transition) -> Location:
        return Location(item.path or self._model.path, item.line, max(1, item.column))

    def _text_place(self, stated: Property, text: Text) -> Location:
        path: Path = stated.path or self._model.path
        line, column = (text.line, text.column) if text.line else (stated.line, stated.column)
        return Location(path, line, max(1, column))


def _name(transition: Transition) -> str:
    name = transition.name.strip()
    return f"transition `{name}`" if name else f"transition {transition.id}"


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
