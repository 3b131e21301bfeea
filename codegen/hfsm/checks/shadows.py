"""Find transitions that can never fire because another one always fires first."""

from __future__ import annotations

import ast
from collections.abc import Callable

from ...diagnostics import Note
from ..code.answers import Answer, Answers
from ..document import Document, State, Transition
from .constants import delay, truth
from .graph import Graph
from .labels import state_label, transition_label
from .pieces import AutomatonCode
from .report import Report

__all__ = ["check_shadows", "is_unguarded"]


def is_unguarded(transition: Transition, code: AutomatonCode) -> bool:
    """Return whether nothing but its trigger decides that a transition fires."""
    if transition.type == "condition":
        return _truth(transition, code) is True
    return transition.guard.is_blank or _truth(transition, code) is True


def check_shadows(
    document: Document, graph: Graph, code: AutomatonCode, answers: Callable[[], Answers], report: Report
) -> None:
    """Check the transitions out of each state against those that are tried before them.

    `answers` returns what is known of guards that are asked again.
    """
    if not graph.sound:
        return
    for state in graph.automaton.states:
        _check_finished(document, graph, state, report)
        earlier = _Earlier(code)
        outgoing = graph.outgoing(state)
        for place, transition in enumerate(outgoing):
            _check_constant(transition, code, report)
            first = earlier.preceding(transition)
            if first is not None and earlier.is_by_guard(first, transition):
                again = answers().of_state(graph.automaton, outgoing)[place]
                first = first if again is Answer.SAME else None
            if first is None:
                earlier.add(transition)
            else:
                _report(transition, first, code, report)


class _Earlier:
    """The transitions out of a state that are tried before the next one."""

    def __init__(self, code: AutomatonCode) -> None:
        self._code = code
        self._always: Transition | None = None
        self._by_trigger: dict[tuple[object, ...], Transition] = {}

    def add(self, transition: Transition) -> None:
        """Add the next one."""
        if is_unguarded(transition, self._code):
            if transition.type == "condition":
                self._always = self._always or transition
            trigger = _trigger(transition)
            if trigger is not None:
                self._by_trigger.setdefault((*trigger, None), transition)
            return
        key = self._key(transition)
        condition = self._code.condition(transition)
        if key is not None and condition is not None:
            self._by_trigger.setdefault(key, transition)

    def preceding(self, transition: Transition) -> Transition | None:
        """Return one that fires whenever a transition would."""
        if self._always is not None:
            return self._always
        trigger = _trigger(transition)
        if trigger is None:
            return None
        return self._by_trigger.get((*trigger, None)) or self._by_trigger.get(self._key(transition) or ())

    def is_by_guard(self, first: Transition, transition: Transition) -> bool:
        """Return whether one precedes another only because their guards read the same."""
        return not is_unguarded(first, self._code) and self._key(transition) is not None

    def _key(self, transition: Transition) -> tuple[object, ...] | None:
        """Return what transitions have in common that fire by the same; None when nothing can be said."""
        trigger, condition = _trigger(transition), self._code.condition(transition)
        return None if trigger is None or condition is None else (*trigger, ast.dump(condition))


def _trigger(transition: Transition) -> tuple[object, ...] | None:
    """Return the type of a transition and what it waits for; None for a time that is none."""
    match transition.type:
        case "condition" | "finished":
            return (transition.type,)
        case "event":
            return ("event", transition.trigger.text.strip())
        case "time":  # those with different times are compared by the check of timers
            time = delay(transition.trigger)
            return None if time is None else ("time", time)
    return None


def _report(transition: Transition, first: Transition, code: AutomatonCode, report: Report) -> None:
    always = first.type == "condition" and is_unguarded(first, code)
    why = "is always true" if always else "fires by the same and is tried first"
    note = Note(f"{transition_label(first)} {why}", report.place(first, first.trigger))
    message = f"{transition_label(transition)} can never fire"
    report.warning("W516", message, report.place(transition, transition.trigger), [note])


def _check_constant(transition: Transition, code: AutomatonCode, report: Report) -> None:
    if _truth(transition, code) is False:
        what = "its condition" if transition.type == "condition" else "its guard"
        message = f"{transition_label(transition)} can never fire: {what} is always false"
        text = transition.trigger if transition.type == "condition" else transition.guard
        report.warning("W516", message, report.place(transition, text))


def _check_finished(document: Document, graph: Graph, state: State, report: Report) -> None:
    """Check that automata whose end is waited for can end."""
    children = [child for number in state.children if (child := document.automaton(number)) is not None]
    endless = next((child for child in children if _never_finishes(Graph(child))), None)
    for transition in graph.outgoing(state):
        if transition.type != "finished" or (children and endless is None):
            continue
        message = f"{transition_label(transition)} can never fire: {state_label(state)} owns no automaton"
        notes = []
        if endless is not None:
            message = f"{transition_label(transition)} can never fire: automaton {endless.id} never finishes"
            notes = [Note("none of its states that can be reached is final", report.place(endless))]
        report.warning("W518", message, report.place(transition), notes)


def _never_finishes(graph: Graph) -> bool:
    return graph.sound and not graph.can_finish


def _truth(transition: Transition, code: AutomatonCode) -> bool | None:
    condition = code.condition(transition)
    return None if condition is None else truth(condition)
