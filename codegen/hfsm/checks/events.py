"""Find events that are waited for in vain, and events that nobody waits for."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from ...diagnostics import Location, did_you_mean
from ..code.sends import sends_of
from ..document import Document, Text
from .accesses import Access
from .labels import transition_label
from .pieces import Piece
from .report import Report

__all__ = ["check_events"]


def check_events(
    document: Document,
    pieces: Iterable[Piece],
    found: Iterable[Access],
    report: Report,
    *,
    is_complete: bool,
) -> None:
    """Compare the events that are awaited, sent and declared.

    `pieces` are all code, and `found` is every use of `self` in it. What it sends by other names for the
    component counts, too; when it `is_complete`, nothing more is sent.
    """
    sent = _sent(found)
    otherwise = set[str]().union(*(sends_of(Text("\n".join(piece.code.lines))).names for piece in pieces))
    declared = {event.name.strip(): report.place(event) for event in document.events}
    awaited: set[str] = set()
    for automaton in document.automata:
        for transition in automaton.transitions:
            name = transition.trigger.text.strip()
            if transition.type != "event" or not name:
                continue
            awaited.add(name)
            if is_complete and name not in {*sent, *otherwise, *declared}:
                who = transition_label(transition)
                message = f"{who} waits for the event `{name}`, which nothing sends or declares"
                known = did_you_mean(name, {*sent, *declared})
                report.warning("W526", message, report.place(transition, transition.trigger), known)
    for name, place in {**sent, **declared}.items():
        if name not in awaited:
            message = f"no transition waits for the event `{name}`"
            report.warning("W527", message, place, did_you_mean(name, awaited))


def _sent(found: Iterable[Access]) -> dict[str, Location]:
    """Return the events that code sends by `self`, with the first place of each."""
    sent: dict[str, Location] = {}
    for access in found:
        name = None if access.path != ("send",) or access.call is None else _name(access.call)
        if isinstance(name, ast.Constant) and isinstance(name.value, str):
            sent.setdefault(name.value, access.piece.place(name))
    return sent


def _name(call: ast.Call) -> ast.expr | None:
    if call.args:
        return call.args[0]
    return next((keyword.value for keyword in call.keywords if keyword.arg == "name"), None)
