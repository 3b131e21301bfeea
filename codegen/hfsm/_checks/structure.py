"""Check the tree of automata, and each state and transition."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from ...diagnostics import Note
from ..code._values import delay, milliseconds
from ..codes import Code
from ..document import NO_CHILD, Automaton, Document, State, Transition
from .report import Report, state_label, transition_label

__all__ = ["check_automaton", "check_tree"]

_MAX_DEPTH: Final = 64
"""Levels of nested automata: far more than a person draws, far fewer than Python's stack allows."""


_TRIGGERS: Final = ("time", "condition", "event", "finished")
"""The types of transitions."""

_HISTORIES: Final = ("resume", "restart")
"""What the automata of a state do when it is entered again; the first is the default."""


def check_tree(document: Document, report: Report) -> None:
    """Check that there is one root, and that a state of its father owns every other automaton."""
    roots = [automaton for automaton in document.automata if automaton.father == NO_CHILD]
    if not roots:
        what = "there is no automaton" if not document.automata else "no automaton is the root"
        report.error(Code.NOT_ONE_ROOT, f'{what}: one `SubAutomata` has `idFather="0"`', document)
    for second in roots[1:]:
        message = f"automaton {second.id} is a second root"
        report.error(Code.NOT_ONE_ROOT, message, second, [report.first(roots[0])])
    _check_unique_ids(document.automata, "automaton", report)
    automata: dict[int, Automaton] = {}
    for automaton in document.automata:
        automata.setdefault(automaton.id, automaton)
    owned = _check_owners(document, automata, report)
    for automaton in document.automata:
        if automaton.father != NO_CHILD and automaton.id not in owned:
            report.error(Code.NOT_A_TREE, f"no state owns automaton {automaton.id}", automaton)
        else:
            _check_ancestors(automaton, automata, report)


def _check_unique_ids(items: Sequence[Automaton | State | Transition], kind: str, report: Report) -> None:
    """Check that ids are at least 1 and that no two of `items` share one."""
    first: dict[int, Automaton | State | Transition] = {}
    for item in items:
        if item.id == 0:
            report.error(Code.REPEATED_ID, f"the id of a {kind} is at least 1", item)
        elif item.id in first:
            message = f"a second {kind} has the id {item.id}"
            report.error(Code.REPEATED_ID, message, item, [report.first(first[item.id])])
        first.setdefault(item.id, item)


def _check_owners(document: Document, automata: dict[int, Automaton], report: Report) -> Iterable[int]:
    """Return the ids of the automata that a state owns."""
    owners: dict[int, State] = {}
    for automaton, state in document.states():
        for number in state.children:
            child = automata.get(number)
            if child is None:
                message = f"{state_label(state)} owns automaton {number}, which does not exist"
                note = Note("the state runs without an automaton")
                report.warning(Code.MISSING_AUTOMATON, message, state, [note])
            elif number in owners:
                first = [report.first(owners[number])]
                report.error(Code.NOT_A_TREE, f"automaton {number} already has an owner", state, first)
            else:
                owners[number] = state
                if child.father != automaton.id:
                    message = f"automaton {number} says that its father is {child.father}"
                    note = Note(f"but a state of automaton {automaton.id} owns it", report.place(state))
                    report.error(Code.NOT_A_TREE, message, child, [note])
    return owners


def _check_ancestors(automaton: Automaton, automata: dict[int, Automaton], report: Report) -> None:
    above: set[int] = set()
    current = automata.get(automaton.father)
    while current is not None and current.id not in above:  # a cycle above it is reported for its members
        if current is automaton:
            message = f"automaton {automaton.id} is its own ancestor"
            report.error(Code.NOT_A_TREE, message, automaton)
            return
        above.add(current.id)
        if len(above) == _MAX_DEPTH:
            message = f"automaton {automaton.id} is nested deeper than {_MAX_DEPTH}"
            report.error(Code.NOT_A_TREE, message, automaton)
            return
        current = automata.get(current.father)


def check_automaton(automaton: Automaton, report: Report) -> None:
    """Check one automaton, but not the paths between its states."""
    if not automaton.states:
        report.error(Code.NO_STATE, f"automaton {automaton.id} has no state", automaton)
    else:
        _check_initial_state(automaton, report)
    _check_unique_ids(automaton.states, "state", report)
    _check_unique_ids(automaton.transitions, "transition", report)
    _check_names(automaton, report)
    if milliseconds(automaton.iteration_time) is None:
        written = automaton.iteration_time.text.strip()[:40]
        message = f"`iteration_time` must be a positive number of milliseconds, not `{written}`"
        report.error(Code.BAD_PERIOD, message, report.place(automaton, automaton.iteration_time))
    for state in automaton.states:
        _check_state(automaton, state, report)
    states = {state.id for state in automaton.states}
    first: dict[tuple[int, int], Transition] = {}
    for transition in automaton.transitions:
        _check_transition(automaton, transition, states, report)
        _check_priority(transition, first, report)


def _check_initial_state(automaton: Automaton, report: Report) -> None:
    initial = [state for state in automaton.states if state.initial]
    if not initial:
        message = f"automaton {automaton.id} has no initial state"
        first = automaton.states[0]
        note = Note(
            f'it starts in the first, {state_label(first)}: mark that with `initial="true"`',
            report.place(first),
        )
        report.warning(Code.NOT_ONE_INITIAL_STATE, message, automaton, [note])
    for second in initial[1:]:
        message = f"{state_label(second)} is a second initial state of automaton {automaton.id}"
        note = Note(f"it starts in the first, {state_label(initial[0])}", report.place(initial[0]))
        report.warning(Code.NOT_ONE_INITIAL_STATE, message, second, [note])


def _check_names(automaton: Automaton, report: Report) -> None:
    first: dict[str, State] = {}
    for state in automaton.states:
        name = state.name.strip()
        if not name:
            report.warning(Code.STATE_WITHOUT_NAME, f"state {state.id} has no name", state)
        elif name in first:
            message = f"a second state has the name `{name}` in automaton {automaton.id}"
            report.warning(Code.REPEATED_STATE_NAME, message, state, [report.first(first[name])])
        else:
            first[name] = state


def _check_state(automaton: Automaton, state: State, report: Report) -> None:
    history = state.history.text.strip()
    if history not in ("", *_HISTORIES):
        message = (
            f"`history` must be {' or '.join(f'`{known}`' for known in _HISTORIES)}, not `{history[:40]}`"
        )
        report.error(Code.BAD_HISTORY, message, report.place(state, state.history))
    if not state.final:
        return
    outgoing = automaton.outgoing(state.id)
    left = [
        *(["automata"] if state.children else []),
        *(["code"] if not state.code.is_blank else []),
        *(["exit code"] if not state.exit.is_blank else []),
        *([transition_label(outgoing[0])] if outgoing else []),
    ]
    if left:
        what = f"{', '.join(left[:-1])} and {left[-1]}" if len(left) > 1 else left[0]
        message = f"{state_label(state)} is final: its {what} will never run"
        note = Note(
            "an automaton that enters a final state has finished: only the `entry` code of the state runs"
        )
        report.warning(Code.CODE_IN_FINAL_STATE, message, state, [note])


def _check_transition(automaton: Automaton, transition: Transition, states: set[int], report: Report) -> None:
    name = transition_label(transition)
    for end, state in (("leaves", transition.origin), ("enters", transition.destination)):
        if state not in states:
            message = f"{name} {end} state {state}, which automaton {automaton.id} does not have"
            report.error(Code.MISSING_STATE, message, transition)
    trigger = report.place(transition, transition.trigger)
    if transition.type == "time":
        _check_time(transition, report)
    elif transition.type == "event":
        if transition.trigger.is_blank:
            report.error(Code.BAD_TRIGGER, f"{name} has no event", transition)
    elif transition.type not in _TRIGGERS:
        *others, last = (f'"{known}"' for known in _TRIGGERS)
        message = f"{name} has the type `{transition.type[:40]}`: use {', '.join(others)} or {last}"
        report.error(Code.BAD_TRIGGER, message, trigger)
    if transition.type == "condition" and transition.trigger.is_blank:
        report.warning(Code.NO_CONDITION, f"{name} has no condition: it never fires", transition)
    if transition.type == "condition" and not transition.guard.is_blank:
        message = f"{name} has a condition, and cannot have a guard"
        note = Note("join both with `and` in the condition, or delete the guard")
        report.error(Code.BAD_TRIGGER, message, report.place(transition, transition.guard), [note])


def _check_time(transition: Transition, report: Report) -> None:
    name = transition_label(transition)
    place = report.place(transition, transition.trigger)
    if delay(transition.trigger) is None:
        written = transition.trigger.text.strip()[:40]
        message = f"the time of {name} must be a positive number of milliseconds, not `{written}`"
        report.error(Code.BAD_TRIGGER, message, place)
    elif milliseconds(transition.trigger) is None:
        note = Note("if no time is meant, write the condition `True`")
        report.warning(Code.NO_TIME, f"{name} does not wait: it fires in the next cycle", place, [note])


def _check_priority(transition: Transition, first: dict[tuple[int, int], Transition], report: Report) -> None:
    """Check a priority; `first` are the earlier transitions by origin and priority."""
    priority = transition.priority
    if priority.is_blank:
        return
    number = _number(transition)
    if number is None:
        written = priority.text.strip()[:40]
        message = (
            f"the priority of {transition_label(transition)} must be a positive integer, not `{written}`"
        )
        report.error(Code.BAD_PRIORITY, message, report.place(transition, priority))
        return
    other = first.setdefault((transition.origin, number), transition)
    if other is not transition:
        who = f"{transition_label(transition)} has priority {number}"
        message = f"{who}, as {transition_label(other)} out of the same state"
        place = report.place(other, other.priority)
        note = Note("of two equal priorities the first in the document is used", place)
        report.warning(Code.EQUAL_PRIORITIES, message, report.place(transition, priority), [note])


def _number(transition: Transition) -> int | None:
    digits = transition.priority.text.strip()
    usable = digits.isascii() and digits.isdigit() and len(digits) < 10
    return int(digits) if usable and int(digits) else None
