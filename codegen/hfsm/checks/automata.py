"""Check the states and transitions of an automaton, each by itself."""

from __future__ import annotations

from typing import Final

from ...diagnostics import Note
from ..document import Automaton, State, Transition
from .constants import delay, milliseconds
from .labels import state_label, transition_label
from .report import Report
from .tree import check_unique_ids

__all__ = ["TRIGGERS", "check_automaton"]

TRIGGERS: Final = ("time", "condition", "event", "finished")
"""What a transition may wait for."""

HISTORIES: Final = ("resume", "restart")
"""What may become of a state's automata when it is entered again; the first is the default."""


def check_automaton(automaton: Automaton, report: Report) -> None:
    """Check one automaton, but not how its states hang together."""
    if not automaton.states:
        report.error("E513", f"automaton {automaton.id} has no state", report.place(automaton))
    else:
        _check_initial_state(automaton, report)
    check_unique_ids(automaton.states, "state", report)
    check_unique_ids(automaton.transitions, "transition", report)
    _check_names(automaton, report)
    if milliseconds(automaton.iteration_time) is None:
        written = automaton.iteration_time.text.strip()[:40]
        message = f"`iteration_time` is a positive number of milliseconds, not `{written}`"
        report.error("E516", message, report.place(automaton, automaton.iteration_time))
    for state in automaton.states:
        _check_state(automaton, state, report)
    states = {state.id for state in automaton.states}
    for transition in automaton.transitions:
        _check_transition(automaton, transition, states, report)


def _check_initial_state(automaton: Automaton, report: Report) -> None:
    initial = [state for state in automaton.states if state.initial]
    if not initial:
        message = f"automaton {automaton.id} has no initial state"
        first = automaton.states[0]
        note = Note(
            f'it begins in the first, {state_label(first)}: say so with `initial="true"`', report.place(first)
        )
        report.warning("W513", message, report.place(automaton), [note])
    for second in initial[1:]:
        message = f"{state_label(second)} is a second initial state of automaton {automaton.id}"
        note = Note(f"it begins in the first, {state_label(initial[0])}", report.place(initial[0]))
        report.warning("W513", message, report.place(second), [note])


def _check_names(automaton: Automaton, report: Report) -> None:
    first: dict[str, State] = {}
    for state in automaton.states:
        name = state.name.strip()
        if not name:
            report.warning("W510", f"state {state.id} has no name", report.place(state))
        elif name in first:
            message = f"a second state is called `{name}` in automaton {automaton.id}"
            report.warning("W511", message, report.place(state), [report.first(first[name])])
        else:
            first[name] = state


def _check_state(automaton: Automaton, state: State, report: Report) -> None:
    history = state.history.text.strip()
    if history not in ("", *HISTORIES):
        message = f"`history` is {' or '.join(f'`{known}`' for known in HISTORIES)}, not `{history[:40]}`"
        report.error("E519", message, report.place(state, state.history))
    if not state.final:
        return
    outgoing = automaton.outgoing(state.id)
    left = [
        *(["an automaton"] if state.children else []),
        *(["code"] if not state.code.is_blank else []),
        *(["exit code"] if not state.exit.is_blank else []),
        *([transition_label(outgoing[0])] if outgoing else []),
    ]
    if left:
        what = f"{', '.join(left[:-1])} and {left[-1]}" if len(left) > 1 else left[0]
        message = f"{state_label(state)} is final, and {what} of it will never run"
        note = Note("an automaton that enters a final state has finished: of the state only `entry` runs")
        report.warning("W519", message, report.place(state), [note])


def _check_transition(automaton: Automaton, transition: Transition, states: set[int], report: Report) -> None:
    name = transition_label(transition)
    for end, state in (("leaves", transition.origin), ("enters", transition.destination)):
        if state not in states:
            message = f"{name} {end} state {state}, which automaton {automaton.id} does not have"
            report.error("E514", message, report.place(transition))
    trigger = report.place(transition, transition.trigger)
    if transition.type == "time":
        _check_time(transition, report)
    elif transition.type == "event":
        if transition.trigger.is_blank:
            report.error("E515", f"{name} names no event", report.place(transition))
    elif transition.type not in TRIGGERS:
        *others, last = (f'"{known}"' for known in TRIGGERS)
        message = f"{name} has the type `{transition.type[:40]}`: it is {', '.join(others)} or {last}"
        report.error("E515", message, trigger)
    if transition.type == "condition" and not transition.guard.is_blank:
        message = f"{name} fires by a condition, which has no guard"
        note = Note("write both into the condition, joined by `and`, or delete the guard")
        report.error("E515", message, report.place(transition, transition.guard), [note])
    _check_priority(automaton, transition, report)


def _check_time(transition: Transition, report: Report) -> None:
    name = transition_label(transition)
    place = report.place(transition, transition.trigger)
    if delay(transition.trigger) is None:
        written = transition.trigger.text.strip()[:40]
        message = f"the time of {name} is a positive number of milliseconds, not `{written}`"
        report.error("E515", message, place)
    elif milliseconds(transition.trigger) is None:
        note = Note("write a condition that is `True`, if no time is meant")
        report.warning("W531", f"{name} waits for no time: it fires in the next cycle", place, [note])


def _check_priority(automaton: Automaton, transition: Transition, report: Report) -> None:
    priority = transition.priority
    if priority.is_blank:
        return
    number = _number(transition)
    if number is None:
        written = priority.text.strip()[:40]
        message = f"the priority of {transition_label(transition)} is a whole number from 1, not `{written}`"
        report.error("E518", message, report.place(transition, priority))
        return
    for other in automaton.transitions:
        if other is transition:
            return
        if other.origin == transition.origin and _number(other) == number:
            who = f"{transition_label(transition)} has priority {number}"
            message = f"{who}, as {transition_label(other)} out of the same state"
            note = Note(
                "of two equal priorities the first in the document counts",
                report.place(other, other.priority),
            )
            report.warning("W530", message, report.place(transition, priority), [note])
            return


def _number(transition: Transition) -> int | None:
    digits = transition.priority.text.strip()
    usable = digits.isascii() and digits.isdigit() and len(digits) < 10
    return int(digits) if usable and int(digits) else None
