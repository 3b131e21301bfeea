"""Find transitions that can never fire because another one always fires first."""

from __future__ import annotations

import ast

from ...diagnostics import Note
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


def check_shadows(document: Document, graph: Graph, code: AutomatonCode, report: Report) -> None:
    """Check the transitions out of each state against those that are tried before them."""
    if not graph.sound:
        return
    for state in graph.automaton.states:
        _check_finished(document, graph, state, report)
        earlier: list[Transition] = []
        for transition in graph.outgoing(state):
            _check_constant(transition, code, report)
            first = next((other for other in earlier if _precedes(other, transition, code)), None)
            if first is None:
                earlier.append(transition)
            else:
                _report(transition, first, code, report)


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


def _precedes(first: Transition, second: Transition, code: AutomatonCode) -> bool:
    """Return whether `first`, which is tried before `second`, fires whenever that would."""
    unguarded = is_unguarded(first, code)
    if first.type == "condition" and unguarded:
        return True
    if first.type != second.type:
        return False
    same_guard = unguarded or _same_condition(first, second, code)
    match first.type:
        case "condition":
            return same_guard
        case "event":
            return same_guard and first.trigger.text.strip() == second.trigger.text.strip()
        case "finished":
            return same_guard
        case "time":
            # Those with different times are compared by the check of timers.
            times = delay(first.trigger), delay(second.trigger)
            return same_guard and times[0] == times[1] is not None
    return False


def _same_condition(first: Transition, second: Transition, code: AutomatonCode) -> bool:
    one, other = code.condition(first), code.condition(second)
    if one is None or other is None:
        return first.guard.is_blank and second.guard.is_blank and first.type != "condition"
    text = ast.dump(one)
    return text == ast.dump(other) and not _draws_lots(one)


def _draws_lots(condition: ast.expr) -> bool:
    """Return whether a condition may give another answer when it is asked again on purpose."""
    names = (
        node.id if isinstance(node, ast.Name) else node.attr
        for node in ast.walk(condition)
        if isinstance(node, ast.Name | ast.Attribute)
    )
    asks_again = any(isinstance(node, ast.NamedExpr) for node in ast.walk(condition))
    return asks_again or any("rand" in name.lower() or name in ("choice", "next", "pop") for name in names)


def _truth(transition: Transition, code: AutomatonCode) -> bool | None:
    condition = code.condition(transition)
    return None if condition is None else truth(condition)
