"""Check the tree of automata, and each state, transition and annotation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from ...diagnostics import Note, did_you_mean
from ...messages import Message, Value, all_of, any_of
from ..code._values import delay, milliseconds
from ..codes import Code
from ..document import (
    ANNOTATION_COLORS,
    ANNOTATION_KINDS,
    NO_CHILD,
    SMALLEST_ANNOTATION,
    Annotation,
    Automaton,
    Document,
    State,
    Transition,
)
from .report import Report, state_label, transition_label

_MAX_DEPTH: Final = 64
"""Levels of nested automata: far more than a person draws, far fewer than Python's stack allows."""


_TRIGGERS: Final = ("time", "condition", "event", "finished")
"""The types of transitions."""

_LARGEST_ANNOTATION: Final = 1e6  # pixels: no canvas is larger

_HISTORIES: Final = ("resume", "restart")
"""The ways in which the automata of a state go on when it is entered again; the first is the default."""


def check_tree(document: Document, report: Report) -> None:
    """Check that there is one root, and that a state of its father owns every other automaton."""
    roots = [automaton for automaton in document.automata if automaton.father == NO_CHILD]
    if not roots:
        message = Message('no automaton is the root: one `SubAutomata` has `idFather="0"`')
        if not document.automata:
            message = Message('there is no automaton: one `SubAutomata` has `idFather="0"`')
        report.error(Code.NOT_ONE_ROOT, message, document)
    for second in roots[1:]:
        message = Message("automaton {id} is a second root", id=second.id)
        report.error(Code.NOT_ONE_ROOT, message, second, [report.first(roots[0])])
    _check_unique_ids(document.automata, Message("automaton"), report)
    automata: dict[int, Automaton] = {}
    for automaton in document.automata:
        automata.setdefault(automaton.id, automaton)
    owned = _check_owners(document, automata, report)
    for automaton in document.automata:
        if automaton.father != NO_CHILD and automaton.id not in owned:
            message = Message("no state owns automaton {id}", id=automaton.id)
            report.error(Code.NOT_A_TREE, message, automaton)
        else:
            _check_ancestors(automaton, automata, report)


def _check_unique_ids(items: Sequence[Automaton | State | Transition], kind: Message, report: Report) -> None:
    """Check that ids are at least 1 and that no two of `items` share one."""
    first: dict[int, Automaton | State | Transition] = {}
    for item in items:
        if item.id == 0:
            report.error(Code.REPEATED_ID, Message("the id of a {kind} is at least 1", kind=kind), item)
        elif item.id in first:
            message = Message("a second {kind} has the id {id}", kind=kind, id=item.id)
            report.error(Code.REPEATED_ID, message, item, [report.first(first[item.id])])
        first.setdefault(item.id, item)


def _check_owners(document: Document, automata: dict[int, Automaton], report: Report) -> Iterable[int]:
    """Return the ids of the automata that a state owns."""
    owners: dict[int, State] = {}
    for automaton, state in document.states():
        for number in state.children:
            child = automata.get(number)
            if child is None:
                message = Message(
                    "{state} owns automaton {id}, which does not exist", state=state_label(state), id=number
                )
                note = Note(Message("the state runs without an automaton"))
                report.warning(Code.MISSING_AUTOMATON, message, state, [note])
            elif number in owners:
                first = [report.first(owners[number])]
                message = Message("automaton {id} already has an owner", id=number)
                report.error(Code.NOT_A_TREE, message, state, first)
            else:
                owners[number] = state
                if child.father != automaton.id:
                    message = Message(
                        "automaton {id} says that its father is {father}", id=number, father=child.father
                    )
                    note = Note(
                        Message("but a state of automaton {id} owns it", id=automaton.id), report.place(state)
                    )
                    report.error(Code.NOT_A_TREE, message, child, [note])
    return owners


def _check_ancestors(automaton: Automaton, automata: dict[int, Automaton], report: Report) -> None:
    above: set[int] = set()
    current = automata.get(automaton.father)
    while current is not None and current.id not in above:  # a cycle above it is reported for its members
        if current is automaton:
            message = Message("automaton {id} is its own ancestor", id=automaton.id)
            report.error(Code.NOT_A_TREE, message, automaton)
            return
        above.add(current.id)
        if len(above) == _MAX_DEPTH:
            message = Message(
                "automaton {id} is nested deeper than {limit}", id=automaton.id, limit=_MAX_DEPTH
            )
            report.error(Code.NOT_A_TREE, message, automaton)
            return
        current = automata.get(current.father)


def check_automaton(automaton: Automaton, report: Report) -> None:
    """Check one automaton, but not the paths between its states."""
    if not automaton.states and automaton.imported is None:
        message = Message("automaton {id} has no state", id=automaton.id)
        report.error(Code.NO_STATE, message, automaton)
    elif automaton.states:
        _check_initial_state(automaton, report)
    _check_unique_ids(automaton.states, Message("state"), report)
    _check_unique_ids(automaton.transitions, Message("transition"), report)
    _check_names(automaton, report)
    if milliseconds(automaton.iteration_time) is None:
        written = automaton.iteration_time.text.strip()[:40]
        message = Message(
            "`iteration_time` must be a positive number of milliseconds, not `{written}`", written=written
        )
        report.error(Code.BAD_PERIOD, message, report.place(automaton, automaton.iteration_time))
    for state in automaton.states:
        _check_state(automaton, state, report)
    states = {state.id for state in automaton.states}
    first: dict[tuple[int, int], Transition] = {}
    for transition in automaton.transitions:
        _check_transition(automaton, transition, states, report)
        _check_priority(transition, first, report)
    _check_annotations(automaton, report)


def _check_initial_state(automaton: Automaton, report: Report) -> None:
    initial = [state for state in automaton.states if state.initial]
    if not initial:
        message = Message("automaton {id} has no initial state", id=automaton.id)
        first = automaton.states[0]
        note = Note(
            Message(
                'it starts in the first, {state}: mark that with `initial="true"`', state=state_label(first)
            ),
            report.place(first),
        )
        report.warning(Code.NOT_ONE_INITIAL_STATE, message, automaton, [note])
    for second in initial[1:]:
        message = Message(
            "{state} is a second initial state of automaton {automaton}",
            state=state_label(second),
            automaton=automaton.id,
        )
        note = Note(
            Message("it starts in the first, {state}", state=state_label(initial[0])),
            report.place(initial[0]),
        )
        report.warning(Code.NOT_ONE_INITIAL_STATE, message, second, [note])


def _check_names(automaton: Automaton, report: Report) -> None:
    first: dict[str, State] = {}
    for state in automaton.states:
        name = state.name.strip()
        if not name:
            message = Message("state {id} has no name", id=state.id)
            report.warning(Code.STATE_WITHOUT_NAME, message, state)
        elif name in first:
            message = Message(
                "a second state has the name `{name}` in automaton {automaton}",
                name=name,
                automaton=automaton.id,
            )
            report.warning(Code.REPEATED_STATE_NAME, message, state, [report.first(first[name])])
        else:
            first[name] = state


def _check_state(automaton: Automaton, state: State, report: Report) -> None:
    history = state.history.text.strip()
    if history not in ("", *_HISTORIES):
        message = Message(
            "`history` must be {known}, not `{history}`",
            known=any_of([f"`{known}`" for known in _HISTORIES]),
            history=history[:40],
        )
        report.error(Code.BAD_HISTORY, message, report.place(state, state.history))
    if not state.final:
        return
    outgoing = automaton.outgoing(state.id)
    left = [
        *([Message("automata")] if state.children else []),
        *([Message("code")] if not state.code.is_blank else []),
        *([Message("exit code")] if not state.exit.is_blank else []),
        *([transition_label(outgoing[0])] if outgoing else []),
    ]
    if left:
        what = all_of(left)
        message = Message("{state} is final: its {what} will never run", state=state_label(state), what=what)
        note = Note(
            Message(
                "an automaton that enters a final state has finished: only the `entry` code of the state runs"
            )
        )
        report.warning(Code.CODE_IN_FINAL_STATE, message, state, [note])


def _check_transition(automaton: Automaton, transition: Transition, states: set[int], report: Report) -> None:
    name = transition_label(transition)
    ends: dict[str, Value] = {"transition": name, "automaton": automaton.id}
    if transition.origin not in states:
        message = Message(
            "{transition} leaves state {state}, which automaton {automaton} does not have",
            state=transition.origin,
            **ends,
        )
        report.error(Code.MISSING_STATE, message, transition)
    if transition.destination not in states:
        message = Message(
            "{transition} enters state {state}, which automaton {automaton} does not have",
            state=transition.destination,
            **ends,
        )
        report.error(Code.MISSING_STATE, message, transition)
    trigger = report.place(transition, transition.trigger)
    if transition.type == "time":
        _check_time(transition, report)
    elif transition.type == "event":
        if transition.trigger.is_blank:
            report.error(Code.BAD_TRIGGER, Message("{transition} has no event", transition=name), transition)
    elif transition.type not in _TRIGGERS:
        message = Message(
            "{transition} has the type `{type}`: use {known}",
            transition=name,
            type=transition.type[:40],
            known=any_of([f'"{known}"' for known in _TRIGGERS]),
        )
        report.error(Code.BAD_TRIGGER, message, trigger)
    if transition.type == "condition" and transition.trigger.is_blank:
        message = Message("{transition} has no condition: it never fires", transition=name)
        report.warning(Code.NO_CONDITION, message, transition)
    if transition.type == "condition" and not transition.guard.is_blank:
        message = Message("{transition} has a condition, and cannot have a guard", transition=name)
        note = Note(Message("join both with `and` in the condition, or delete the guard"))
        report.error(Code.BAD_TRIGGER, message, report.place(transition, transition.guard), [note])


def _check_time(transition: Transition, report: Report) -> None:
    name = transition_label(transition)
    place = report.place(transition, transition.trigger)
    if delay(transition.trigger) is None:
        written = transition.trigger.text.strip()[:40]
        message = Message(
            "the time of {transition} must be a positive number of milliseconds, not `{written}`",
            transition=name,
            written=written,
        )
        report.error(Code.BAD_TRIGGER, message, place)
    elif milliseconds(transition.trigger) is None:
        note = Note(Message("if no time is meant, write the condition `True`"))
        message = Message("{transition} does not wait: it fires in the next cycle", transition=name)
        report.warning(Code.NO_TIME, message, place, [note])


def _check_priority(transition: Transition, first: dict[tuple[int, int], Transition], report: Report) -> None:
    """Check a priority; `first` are the earlier transitions by origin and priority."""
    priority = transition.priority
    if priority.is_blank:
        return
    number = transition.rank
    if number is None:
        written = priority.text.strip()[:40]
        message = Message(
            "the priority of {transition} must be a positive integer, not `{written}`",
            transition=transition_label(transition),
            written=written,
        )
        report.error(Code.BAD_PRIORITY, message, report.place(transition, priority))
        return
    other = first.setdefault((transition.origin, number), transition)
    if other is not transition:
        message = Message(
            "{transition} has priority {priority}, as {other} out of the same state",
            transition=transition_label(transition),
            priority=number,
            other=transition_label(other),
        )
        place = report.place(other, other.priority)
        note = Note(Message("of two equal priorities the first in the document is used"), place)
        report.warning(Code.EQUAL_PRIORITIES, message, report.place(transition, priority), [note])


# Notes and frames: whatever is wrong with one, the component is generated.


def _check_annotations(automaton: Automaton, report: Report) -> None:
    """Check the kind, size and color of each note and frame of an automaton."""
    for each in automaton.annotations:
        _check_word("kind", each.kind, ANNOTATION_KINDS, each, report)
        color = each.color.text.strip()
        if color:
            _check_word("color", color, ANNOTATION_COLORS, each, report)
        for name, size in (("width", each.width), ("height", each.height)):
            if not SMALLEST_ANNOTATION <= size <= _LARGEST_ANNOTATION:
                message = Message(
                    "the {attribute} of annotation {id} must be from {smallest:.0f} to {largest:.0f} pixels, "
                    "not {size:g}: it is drawn as large as the nearest of these",
                    attribute=name,
                    id=each.id,
                    smallest=SMALLEST_ANNOTATION,
                    largest=_LARGEST_ANNOTATION,
                    size=size,
                )
                report.warning(Code.BAD_ANNOTATION, message, each)


def _check_word(what: str, word: str, known: tuple[str, ...], annotation: Annotation, report: Report) -> None:
    if word not in known:
        message = Message(
            "the {attribute} of annotation {id} must be {known}, not `{word}`: it is drawn as `{usual}`",
            attribute=what,
            id=annotation.id,
            known=any_of([f"`{each}`" for each in known]),
            word=word[:40],
            usual=known[0],
        )
        report.warning(Code.BAD_ANNOTATION, message, annotation, did_you_mean(word, known))
