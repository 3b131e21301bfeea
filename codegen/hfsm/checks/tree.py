"""Check that the automata of a document are a tree."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, Protocol

from ...diagnostics import Note
from ..document import NO_CHILD, Automaton, Document, State
from .labels import state_label
from .report import Node, Report

__all__ = ["check_tree", "check_unique_ids"]

_MAX_DEPTH: Final = 64
"""Automata above one another: far more than a person draws, far less than Python's stack."""


class _Numbered(Node, Protocol):
    @property
    def id(self) -> int: ...


def check_tree(document: Document, report: Report) -> None:
    """Check that there is one root, and that every other automaton is owned by a state of its father."""
    roots = [automaton for automaton in document.automata if automaton.father == NO_CHILD]
    if not roots:
        what = "there is no automaton" if not document.automata else "no automaton is the root"
        report.error("E511", f'{what}: one `SubAutomata` has `idFather="0"`', report.place(document))
    for second in roots[1:]:
        message = f"automaton {second.id} is a second root"
        report.error("E511", message, report.place(second), [report.first(roots[0])])
    check_unique_ids(document.automata, "automaton", report)
    automata: dict[int, Automaton] = {}
    for automaton in document.automata:
        automata.setdefault(automaton.id, automaton)
    owned = _check_owners(document, automata, report)
    for automaton in document.automata:
        if automaton.father != NO_CHILD and automaton.id not in owned:
            report.error("E512", f"no state owns automaton {automaton.id}", report.place(automaton))
        else:
            _check_ancestors(automaton, automata, report)


def check_unique_ids(items: Sequence[_Numbered], kind: str, report: Report) -> None:
    """Check that ids are at least 1 and that no two of `items` share one."""
    first: dict[int, _Numbered] = {}
    for item in items:
        if item.id == 0:
            report.error("E517", f"the id of a {kind} is at least 1", report.place(item))
        elif item.id in first:
            message = f"a second {kind} has the id {item.id}"
            report.error("E517", message, report.place(item), [report.first(first[item.id])])
        first.setdefault(item.id, item)


def _check_owners(document: Document, automata: dict[int, Automaton], report: Report) -> Iterable[int]:
    """Return the ids of the automata that a state owns."""
    owners: dict[int, State] = {}
    for automaton, state in document.states():
        for number in state.children:
            child = automata.get(number)
            if child is None:
                message = f"{state_label(state)} owns automaton {number}, which does not exist"
                note = Note("the state runs as one without an automaton")
                report.warning("W512", message, report.place(state), [note])
            elif number in owners:
                first = [report.first(owners[number])]
                report.error("E512", f"automaton {number} already has an owner", report.place(state), first)
            else:
                owners[number] = state
                if child.father != automaton.id:
                    message = f"automaton {number} says that its father is {child.father}"
                    note = Note(f"but a state of automaton {automaton.id} owns it", report.place(state))
                    report.error("E512", message, report.place(child), [note])
    return owners


def _check_ancestors(automaton: Automaton, automata: dict[int, Automaton], report: Report) -> None:
    above: set[int] = set()
    current = automata.get(automaton.father)
    while current is not None and current.id not in above:  # a ring above it is told of its own members
        if current is automaton:
            message = f"automaton {automaton.id} is its own ancestor"
            report.error("E512", message, report.place(automaton))
            return
        above.add(current.id)
        if len(above) == _MAX_DEPTH:
            message = f"automaton {automaton.id} is nested deeper than {_MAX_DEPTH}"
            report.error("E512", message, report.place(automaton))
            return
        current = automata.get(current.father)
