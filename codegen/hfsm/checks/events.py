"""Find events that are waited for in vain, and events that nobody waits for."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from ...diagnostics import Location, did_you_mean
from ..document import Document
from .accesses import Access
from .extension import Extension
from .labels import transition_label
from .report import Report

__all__ = ["check_events"]


def check_events(
    document: Document, extension: Extension, found: Iterable[Access], report: Report, *, is_complete: bool
) -> None:
    """Compare the events that are awaited, sent and declared.

    `found` is every use of `self` in the code, of which none was missed when it `is_complete`.
    """
    sent, is_certain = _sent(found)
    is_certain = is_certain and is_complete and not extension.exists
    declared = {event.name.strip(): report.place(event) for event in document.events}
    awaited: set[str] = set()
    for automaton in document.automata:
        for transition in automaton.transitions:
            name = transition.trigger.text.strip()
            if transition.type != "event" or not name:
                continue
            awaited.add(name)
            if is_certain and name not in sent and name not in declared:
                who = transition_label(transition)
                message = f"{who} waits for the event `{name}`, which nothing sends or declares"
                known = did_you_mean(name, {*sent, *declared})
                report.warning("W526", message, report.place(transition, transition.trigger), known)
    for name, place in {**sent, **declared}.items():
        if name not in awaited:
            message = f"no transition waits for the event `{name}`"
            report.warning("W527", message, place, did_you_mean(name, awaited))


def _sent(found: Iterable[Access]) -> tuple[dict[str, Location], bool]:
    """Return the events that code sends, and whether these are all."""
    sent: dict[str, Location] = {}
    is_certain = True
    for access in found:
        if access.path != ("send",):
            continue
        name = None if access.call is None else _name(access.call)
        if isinstance(name, ast.Constant) and isinstance(name.value, str):
            sent.setdefault(name.value, access.piece.place(name))
        else:
            is_certain = False
    return sent, is_certain


def _name(call: ast.Call) -> ast.expr | None:
    if call.args:
        return call.args[0]
    return next((keyword.value for keyword in call.keywords if keyword.arg == "name"), None)
